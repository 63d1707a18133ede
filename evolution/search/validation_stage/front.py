"""The Pareto front of a search with several objectives, re-evaluated on held-out seeds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median

import numpy as np
from numpy.typing import NDArray
from pymoo.util.nds.non_dominated_sorting import NonDominatedSorting

from evolution.search.algorithms import Evaluation
from evolution.search.archive import Archive
from evolution.search.budget import Budget, runs_in
from evolution.search.judging import Objectives
from evolution.search.validation_stage.held_out import ValidationResult, held_out, last_repeats
from evolution.search.validation_stage.trials import trials_of

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class FrontPoint:
    """A set of the Pareto front.

    Args:
        evaluation: The set as the search judged it.
        held_out: Its held-out fitness; None if it was not re-evaluated.
        values: Its objectives on the held-out seeds, medians over the trials; None likewise.
        remains: Whether it is still on the front of the re-evaluated sets, with a fitness of 0 or less; None likewise.
    """

    evaluation: Evaluation
    held_out: ValidationResult | None = None
    values: tuple[float, ...] | None = None
    remains: bool | None = None


def front_of(population: Sequence[Evaluation]) -> list[Evaluation]:
    """Return the sets that no other one dominates, by fitness; the best one alone if all violate constraints."""
    ranked = sorted({one.map_set.digest: one for one in population}.values(), key=lambda one: one.judgement.rank_key)
    feasible = [one for one in ranked if one.judgement.rank_key[0] == 0.0]
    if not feasible:
        return ranked[:1]
    return [feasible[place] for place in sorted(_front(np.array([one.judgement.objectives for one in feasible])))]


def reevaluate(front: Sequence[Evaluation], objectives: Objectives, seeds: int, budget: Budget) -> list[FrontPoint]:
    """Return the points of a front, as many as the runs suffice for re-evaluated on held-out seeds.

    The set with the best fitness comes first, then always the one that is farthest from those before.

    Args:
        front: From :func:`front_of`.
        objectives: Judge sets.
        seeds: Further runs of each controller on each map.
        budget: Limits the runs.
    """
    archive = budget.archive
    further: dict[str, tuple[int, ...]] = {}
    driven: set[str] = set()
    for one in spread(front):
        maps = [scenario.world_digest for scenario in one.map_set]
        more = further | archive.missing({name: archive.repeats_of(name) + seeds for name in maps})
        if runs_in(more) <= budget.all_runs:
            further = more
            driven.add(one.map_set.digest)
    archive.drive_more(further)
    return _remaining(
        [
            _reevaluated(one, archive, objectives, seeds) if one.map_set.digest in driven else FrontPoint(one)
            for one in front
        ]
    )


def spread(front: Sequence[Evaluation]) -> list[Evaluation]:
    """Return the sets of a front, the first one first, then always the one farthest from those before."""
    values = np.array([one.judgement.objectives for one in front])
    values = (values - values.min(axis=0)) / np.maximum(np.ptp(values, axis=0), np.finfo(float).tiny)
    order, distances = [0], np.linalg.norm(values - values[0], axis=1)
    while len(order) < len(front):
        distances[order] = -1.0
        order.append(int(distances.argmax()))
        distances = np.minimum(distances, np.linalg.norm(values - values[order[-1]], axis=1))
    return [front[place] for place in order]


def _reevaluated(one: Evaluation, archive: Archive, objectives: Objectives, seeds: int) -> FrontPoint:
    results = archive.results_of(one.map_set)
    found = held_out(results, one.judgement, objectives.fitness, seeds, candidates=1)
    trials = trials_of(tuple(last_repeats(of_map, seeds) for of_map in results))
    values = zip(*(objectives(one.map_set, trial).objectives for trial in trials), strict=True)
    return FrontPoint(one, found, tuple(median(of_objective) for of_objective in values))


def _remaining(points: Sequence[FrontPoint]) -> list[FrontPoint]:
    """Say of each re-evaluated point whether it remains on the front."""
    good = [place for place, one in enumerate(points) if one.values is not None and one.values[0] <= 0.0]
    front = _front(np.array([points[place].values for place in good])) if good else []
    remaining = {good[place] for place in front}
    return [
        one if one.values is None else FrontPoint(one.evaluation, one.held_out, one.values, place in remaining)
        for place, one in enumerate(points)
    ]


def _front(values: Floats) -> list[int]:
    """Return the rows that no other row dominates."""
    found: list[int] = NonDominatedSorting().do(values, only_non_dominated_front=True).tolist()
    return found
