"""Which configurations of a study differ, and by how much.

Only what was judged by the same fitness is compared: a Gini value says nothing beside a cluster
value. Smaller fitness is better. Two quantities are compared: ``fitness``, as the search saw it
(thesis, Table 5.2), and ``fresh_fitness``, of the same sets on fresh seeds, which luck cannot help.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from evolution.settings import EvolveSettings
from evolution.statistics import (
    Summary,
    TestResult,
    critical_difference,
    friedman,
    kruskal_wallis,
    pairwise_mann_whitney,
    summarize,
)
from evolution.study.results import StudyResults, StudyRun
from evolution.study.settings import JUDGES

Quantity = Literal["fitness", "fresh_fitness"]
QUANTITIES: dict[Quantity, str] = {"fitness": "as the search saw it", "fresh_fitness": "on fresh seeds"}
BOOTSTRAP_SEED = 0
Groups = dict[str, list[StudyRun]]


@dataclass(frozen=True)
class Ranking:
    """Configurations ranked by every seed.

    Args:
        names: The configurations.
        seeds: Seeds that all of them were run with.
        ranks: ``(configurations,)`` mean rank, 1 the smallest fitness.
        critical_difference: Mean ranks at least so far apart differ (Nemenyi, 0.05).
        test: Friedman's; None for two configurations.
    """

    names: tuple[str, ...]
    seeds: tuple[int, ...]
    ranks: NDArray[np.float64]
    critical_difference: float
    test: TestResult | None


@dataclass(frozen=True)
class Comparison:
    """Configurations judged by one fitness, compared in one quantity.

    Args:
        judge: The fitness in words.
        quantity: What is compared.
        values: By configuration, one value a run.
        summaries: By configuration.
        populations: Kruskal-Wallis over each group that differs in its population only.
        pairs: Every two configurations; p-values corrected by Holm over all of them.
        ranking: None where fewer than two seeds are common to all.
    """

    judge: str
    quantity: Quantity
    values: Mapping[str, Sequence[float]]
    summaries: Mapping[str, Summary]
    populations: Sequence[TestResult]
    pairs: Sequence[TestResult]
    ranking: Ranking | None

    @property
    def title(self) -> str:
        """What is compared, in words."""
        return f"{self.judge}, {QUANTITIES[self.quantity]}"

    @property
    def order(self) -> list[str]:
        """Configurations by median, the best first."""
        return sorted(self.summaries, key=lambda name: self.summaries[name].median)


def compare(results: StudyResults) -> list[Comparison]:
    """Compare all configurations of a study that were judged by the same fitness, in both quantities."""
    found = []
    for judge, groups in by_judge(results).items():
        for quantity in QUANTITIES:
            measured = {
                name: [run for run in runs if quantity == "fitness" or run.fresh is not None]
                for name, runs in groups.items()
            }
            measured = {name: runs for name, runs in measured.items() if runs}
            if measured:
                found.append(_comparison(judge, quantity, measured))
    return found


def by_judge(results: StudyResults) -> dict[str, Groups]:
    """Sort the configurations that have runs by the fitness that judged them."""
    found: dict[str, Groups] = {}
    for name, runs in results.by_configuration.items():
        found.setdefault(judge_of(runs[0].experiment.search), {})[name] = runs
    return found


def judge_of(search: EvolveSettings) -> str:
    """Say in words what decides about a fitness value; options at their defaults are left out."""
    usual = EvolveSettings()
    options = [name for name in JUDGES[1:] if getattr(search, name) != getattr(usual, name)]
    words = [f"{name} {_short(getattr(search, name))}" for name in options]
    return f"{search.fitness} fitness" + (f" ({', '.join(words)})" if words else "")


def value_of(run: StudyRun, quantity: Quantity) -> float:
    """One run's value of a quantity.

    Raises:
        ValueError: If it was not re-evaluated.
    """
    if quantity == "fitness":
        return run.fitness
    if run.fresh is None:
        raise ValueError(f"{run.path}: not re-evaluated")
    return run.fresh.fitness


def _comparison(judge: str, quantity: Quantity, groups: Groups) -> Comparison:
    values = {name: [value_of(run, quantity) for run in runs] for name, runs in groups.items()}
    rng = np.random.default_rng(BOOTSTRAP_SEED)
    several = len(values) > 1
    return Comparison(
        judge=judge,
        quantity=quantity,
        values=values,
        summaries={name: summarize(one, rng) for name, one in values.items()},
        populations=[kruskal_wallis({name: values[name] for name in names}) for names in _populations(groups)],
        pairs=pairwise_mann_whitney(values) if several else [],
        ranking=_ranking(groups, quantity) if several else None,
    )


def _populations(groups: Groups) -> list[list[str]]:
    """Configurations that differ in nothing but their population."""
    alike: dict[str, list[str]] = {}
    for name, runs in groups.items():
        experiment, method = runs[0].experiment, runs[0].configuration.method
        document = experiment.document()
        search = {key: value for key, value in document["search"].items() if key not in ("pop_size", "seed")}
        alike.setdefault(repr((method, search, document["controllers"], document["run"])), []).append(name)
    return [names for names in alike.values() if len(names) > 1]


def _ranking(groups: Groups, quantity: Quantity) -> Ranking | None:
    by_seed = [{run.seed: value_of(run, quantity) for run in runs} for runs in groups.values()]
    seeds = tuple(sorted(set.intersection(*[set(values) for values in by_seed])))
    if len(seeds) < 2:
        return None
    table = np.array([[values[seed] for values in by_seed] for seed in seeds])
    ranks, difference = critical_difference(table)
    names = tuple(groups)
    return Ranking(names, seeds, ranks, difference, friedman(table, names) if len(names) > 2 else None)


def _short(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)
