"""A map set driven again, with seeds that the search did not use: what became of its fitness and its order.

A search keeps the set whose runs went best, luck included, so the fitness it saw is better than that of
the same set when driven again: the winner's curse. It is stated as a number: fresh minus seen.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from statistics import fmean, median
from typing import Any

from evolution.driving import SetResults
from evolution.search import Experiment, Fitness, Judgement, order_of


@dataclass(frozen=True)
class DrivenAgain:
    """A map set on fresh seeds, judged.

    Args:
        results: ``results[map][controller][seed]``.
        singles: The fitness with each fresh seed alone, as one more drive of the set would show it.
        as_searched: The fitness from as many repeats at a time as the search used.
        scores: The score of each map in the search.
    """

    results: SetResults
    singles: tuple[Judgement, ...]
    as_searched: tuple[Judgement, ...]
    scores: tuple[float | None, ...]

    @property
    def fitness(self) -> float:
        """Median fitness over the fresh seeds, one run of each controller on each map at a time."""
        return median(one.fitness for one in self.singles)

    @property
    def fitness_as_searched(self) -> float:
        """Median fitness over the fresh seeds, from as many repeats at a time as the search used."""
        return median(one.fitness for one in self.as_searched)

    @property
    def success_rate(self) -> float:
        """Share of runs that reached the goal."""
        return fmean(one.success_rate for one in self.singles)

    @property
    def orders(self) -> tuple[bool, ...]:
        """For each fresh seed on which all maps have a score, whether their order is that of the search.

        Empty if a map had no score in the search.
        """
        seen = order_of(self.scores)
        found = [order_of(one.scores) for one in self.singles] if seen is not None else []
        return tuple(order == seen for order in found if order is not None)

    @property
    def order_kept(self) -> float:
        """Share of the seeds in :attr:`orders` on which the order is kept; NaN if there are none."""
        return fmean(self.orders) if self.orders else float("nan")


def driven_again(results: SetResults, seen: Mapping[str, Any], experiment: Experiment) -> DrivenAgain:
    """Judge a set that was driven again as its search would have.

    Args:
        results: ``results[map][controller][seed]``.
        seen: ``best_results.json`` of the run.
        experiment: What the search was run with.
    """
    fitness = fitness_of(experiment, seen["cluster_scale"])
    scores = tuple(entry["score"] for entry in seen["maps"])
    return DrivenAgain(results, judge(results, fitness, 1), judge(results, fitness, experiment.search.repeats), scores)


def fitness_of(experiment: Experiment, cluster_scale: float | None) -> Fitness:
    """Return the fitness a search used, with the scale it ended with."""
    return Fitness(experiment.search.judging, experiment.run.time_limit, cluster_scale)


def judge(results: SetResults, fitness: Fitness, repeats: int) -> tuple[Judgement, ...]:
    """Judge a set once for every ``repeats`` of its runs; a shorter rest is left out, unless there is nothing else."""
    count = len(results[0][0])
    starts = range(0, max(count - repeats, 0) + 1, repeats)
    return tuple(fitness(_part(results, start, start + repeats)) for start in starts)


def _part(results: SetResults, start: int, end: int) -> SetResults:
    return tuple(tuple(runs[start:end] for runs in of_map) for of_map in results)
