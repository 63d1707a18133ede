"""Re-evaluation of a map set on held-out seeds: its held-out fitness, and the rank agreement of its maps.

A search reports the fitness of the best of many sets, so the reported fitness is biased by the selection (winner's
curse). The selection bias is the held-out fitness minus the reported fitness.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from statistics import fmean, median
from typing import Any

from evolution.driving import SetResults
from evolution.runs.recorded_experiment import RecordedExperiment
from evolution.search import Fitness, Judgement, order_kept, order_of, values_in_order


@dataclass(frozen=True)
class Reevaluation:
    """A map set judged on held-out seeds.

    Args:
        results: ``results[map][controller][seed]``.
        trials: The judgement of each held-out seed alone: one run of each controller on each map.
        as_searched: The judgements of as many repeats at a time as the search had.
        scores: The score of each map in the search.
        ordered: Whether the ranks of the maps count in the fitness.
    """

    results: SetResults
    trials: tuple[Judgement, ...]
    as_searched: tuple[Judgement, ...]
    scores: tuple[float | None, ...]
    ordered: bool = True

    @property
    def fitness(self) -> float:
        """Held-out fitness: the median over the trials."""
        return median(one.fitness for one in self.trials)

    @property
    def fitness_as_searched(self) -> float:
        """Held-out fitness with as many repeats as the search had: the median over :attr:`as_searched`."""
        return median(one.fitness for one in self.as_searched)

    @property
    def mean_trial(self) -> float:
        """Mean fitness of the trials; a trial that loses the ranks of the maps counts as 0, or as its penalty."""
        return fmean(values_in_order(self.trials, order_kept(self.trials, self.scores, self.ordered)))

    @property
    def success_rate(self) -> float:
        """Fraction of runs that reached the goal."""
        return fmean(one.success_rate for one in self.trials)

    @property
    def ranks_kept(self) -> tuple[bool, ...]:
        """For each trial in which all maps have a score, whether the maps have the same ranks as in the search.

        Empty if a map had no score in the search.
        """
        searched = order_of(self.scores)
        found = [order_of(one.scores) for one in self.trials] if searched is not None else []
        return tuple(order == searched for order in found if order is not None)

    @property
    def rank_agreement(self) -> float:
        """Fraction of :attr:`ranks_kept` that is true; NaN if it is empty."""
        return fmean(self.ranks_kept) if self.ranks_kept else float("nan")


def reevaluation_of(results: SetResults, reported: Mapping[str, Any], experiment: RecordedExperiment) -> Reevaluation:
    """Return the re-evaluation of a set, judged by the fitness of its search.

    Args:
        results: ``results[map][controller][seed]``.
        reported: ``best_results.json`` of the run.
        experiment: The experiment of the run.
    """
    fitness = experiment.fitness(reported["cluster_scale"])
    scores = tuple(entry["score"] for entry in reported["maps"])
    trials, as_searched = judge(results, fitness, 1), judge(results, fitness, experiment.search.repeats)
    return Reevaluation(results, trials, as_searched, scores, fitness.kind.ordered)


def judge(results: SetResults, fitness: Fitness, repeats: int) -> tuple[Judgement, ...]:
    """Judge a set once for every ``repeats`` of its runs; a shorter rest is left out, unless there is nothing else."""
    count = len(results[0][0])
    starts = range(0, max(count - repeats, 0) + 1, repeats)
    return tuple(fitness(_part(results, start, start + repeats)) for start in starts)


def _part(results: SetResults, start: int, end: int) -> SetResults:
    return tuple(tuple(runs[start:end] for runs in of_map) for of_map in results)
