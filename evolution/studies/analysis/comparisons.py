"""Which configurations of a study differ, and by how much.

Only configurations with the same fitness are compared (see :mod:`evolution.studies.analysis.judges`).
Smaller fitness is better.
Two quantities are compared: ``fitness``, which the search reports (thesis, Table 5.2), and ``held_out_fitness``, the
fitness of the same sets on held-out seeds, which has no selection bias.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from evolution.statistics import (
    Summary,
    TestResult,
    critical_difference,
    friedman,
    kruskal_wallis,
    pairwise_mann_whitney,
    summarize,
)
from evolution.studies.analysis.judges import Groups, Judge, judges_of
from evolution.studies.analysis.results import StudyResults, StudyRun, reevaluated

Quantity = Literal["fitness", "held_out_fitness"]
QUANTITIES: dict[Quantity, str] = {"fitness": "reported", "held_out_fitness": "held out"}


@dataclass(frozen=True)
class Ranking:
    """Configurations ranked on every seed.

    Args:
        names: The configurations.
        seeds: Seeds that all of them were run with.
        ranks: ``(configurations,)`` mean rank, 1 the smallest fitness.
        critical_difference: Mean ranks at least this far apart differ (Nemenyi, 0.05).
        test: Friedman's test; None for two configurations.
    """

    names: tuple[str, ...]
    seeds: tuple[int, ...]
    ranks: NDArray[np.float64]
    critical_difference: float
    test: TestResult | None


@dataclass(frozen=True)
class Comparison:
    """Configurations with the same fitness, compared in one quantity.

    Args:
        judge: The fitness in words.
        quantity: The compared quantity.
        values: By configuration, one value per run; the best median first.
        summaries: By configuration, in the same order.
        populations: Kruskal-Wallis over each group of configurations that differ only in population size.
        pairs: Every pair of configurations, the better median first; p-values corrected by Holm over all pairs.
        by_construction: Pairs that are not tested: the first cannot be worse in any run, because it selects
            among all maps of the second afterwards.
        ranking: Ranks over seeds of all configurations but the first ones of ``by_construction``; None where these are
            fewer than two, or have fewer than two seeds in common.
    """

    judge: str
    quantity: Quantity
    values: Mapping[str, Sequence[float]]
    summaries: Mapping[str, Summary]
    populations: Sequence[TestResult]
    pairs: Sequence[TestResult]
    by_construction: Sequence[tuple[str, str]]
    ranking: Ranking | None

    @property
    def title(self) -> str:
        """Judge and quantity in words."""
        return f"{self.judge}, {QUANTITIES[self.quantity]}"

    @property
    def order(self) -> list[str]:
        """Configurations by median, the best first."""
        return list(self.summaries)


@dataclass(frozen=True)
class StudyAnalysis:
    """Everything that is computed about a study, once.

    Args:
        results: The study.
        judges: Groups of configurations with the same fitness.
        comparisons: For every judge, the reported fitness, then the held-out fitness if there is any.
    """

    results: StudyResults
    judges: tuple[Judge, ...]
    comparisons: tuple[Comparison, ...]

    def of(self, judge: Judge) -> list[Comparison]:
        """The comparisons of one judge."""
        return [one for one in self.comparisons if one.judge == judge.name]


def analyse(results: StudyResults) -> StudyAnalysis:
    """Return the comparisons of all configurations with the same fitness, in both quantities."""
    judges = tuple(judges_of(results))
    return StudyAnalysis(results, judges, tuple(one for judge in judges for one in _comparisons(judge)))


def value_of(run: StudyRun, quantity: Quantity) -> float:
    """One run's value of a quantity; ``held_out_fitness`` is that of a re-evaluated run."""
    return run.fitness if quantity == "fitness" else run.held_out.fitness


def _comparisons(judge: Judge) -> list[Comparison]:
    found = []
    for quantity in QUANTITIES:
        measured = {name: runs if quantity == "fitness" else reevaluated(runs) for name, runs in judge.groups.items()}
        measured = {name: runs for name, runs in measured.items() if runs}
        if measured:
            found.append(_comparison(judge, quantity, measured))
    return found


def _comparison(judge: Judge, quantity: Quantity, groups: Groups) -> Comparison:
    """Summarise all configurations, and test them where all values are on one scale."""
    unordered = {name: [value_of(run, quantity) for run in runs] for name, runs in groups.items()}
    values = dict(sorted(unordered.items(), key=lambda item: float(np.median(item[1]))))
    nested = _nested(groups) if judge.comparable and quantity == "fitness" else []
    pairs = [
        pair for pair in itertools.combinations(values, 2) if judge.comparable and set(pair) not in map(set, nested)
    ]
    populations = _populations(groups) if judge.comparable else []
    return Comparison(
        judge=judge.name,
        quantity=quantity,
        values=values,
        summaries={name: summarize(one) for name, one in values.items()},
        populations=[kruskal_wallis({name: values[name] for name in names}) for names in populations],
        pairs=pairwise_mann_whitney(values, pairs) if pairs else [],
        by_construction=nested,
        ranking=_ranking(_without(groups, nested), quantity) if judge.comparable else None,
    )


def _nested(groups: Groups) -> list[tuple[str, str]]:
    """Return the pairs of a configuration that chooses the exact best set, and the one whose maps it chooses from.

    A validated set is none of them: its fitness is the held-out fitness, which can be better by chance.
    """
    chosen = [runs[0].configuration for runs in groups.values() if runs[0].configuration.method == "best_triple"]
    return [
        (one.name, one.of)
        for one in chosen
        if one.of in groups and groups[one.of][0].experiment.search.validation is None
    ]


def _without(groups: Groups, nested: Sequence[tuple[str, str]]) -> Groups:
    """Return the configurations that can be worse than each other one."""
    left_out = {first for first, _ in nested}
    return {name: runs for name, runs in groups.items() if name not in left_out}


def _populations(groups: Groups) -> list[list[str]]:
    """Return the groups of configurations that differ in their population size and in nothing else."""
    alike: dict[str, dict[int, str]] = {}
    for name, runs in groups.items():
        experiment, configuration = runs[0].experiment, runs[0].configuration
        document = experiment.document()
        del document["search"]["ga"]["pop_size"], document["search"]["seed"]
        key = (configuration.method, configuration.of, configuration.cellular, document)
        alike.setdefault(repr(key), {}).setdefault(experiment.search.ga.pop_size, name)
    return [list(names.values()) for names in alike.values() if len(names) > 1]


def _ranking(groups: Groups, quantity: Quantity) -> Ranking | None:
    by_seed = [{run.seed: value_of(run, quantity) for run in runs} for runs in groups.values()]
    seeds = tuple(sorted(set.intersection(*[set(values) for values in by_seed])))
    if len(groups) < 2 or len(seeds) < 2:
        return None
    table = np.array([[values[seed] for values in by_seed] for seed in seeds])
    ranks, difference = critical_difference(table)
    names = tuple(groups)
    return Ranking(names, seeds, ranks, difference, friedman(table, names) if len(names) > 2 else None)
