"""Staging: which controllers run next on a map, given its results so far.

A map on which one controller fails has no value if failures are excluded, whatever the others do. Controllers therefore
run in stages, the one with the lowest declared cost first, and a map's first failure is its last stage. The missing
runs matter only for the success rate of its set. A set gets them only if it may survive with them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from controllers.registry import relative_cost
from evolution.driving import JobPlan, RunResult, SetResults
from evolution.search.judging import Fitness, missing_runs

Stage = tuple[int, ...]
"""Places of the controllers, in the plan's order, that run at the same time."""
Stages = tuple[Stage, ...]


def single_stage(plan: JobPlan) -> Stages:
    """Return the one stage in which all controllers run."""
    return (tuple(range(len(plan.controllers))),)


def stages_of(plan: JobPlan) -> Stages:
    """Return one stage for each controller, the lowest declared cost first; equal costs stay in the plan's order."""
    if len(plan.controllers) == 1:
        return single_stage(plan)
    navigation = plan.settings.navigation
    costs = [relative_cost(spec.registered_name, navigation) for spec in plan.controllers]
    return tuple((place,) for place in sorted(range(len(costs)), key=costs.__getitem__))


def next_stage(of_map: Sequence[Sequence[RunResult]], stages: Stages, repeats: int, since: int = 0) -> Stage:
    """Return the controllers that run next on a map; none after a stage with a failed run, or if no run is missing.

    The order of the stages may have changed since the map's first runs.

    Args:
        of_map: Results of the map, ``[controller][repeat]``.
        stages: The stages, in their order.
        repeats: Runs that each controller shall have.
        since: First repeat whose failures count.
    """
    missing = [stage for stage in stages if any(len(of_map[place]) < repeats for place in stage)]
    driven = [place for stage in stages if stage not in missing for place in stage]
    failed = any(not run.success for place in driven for run in of_map[place][since:])
    return missing[0] if missing and not failed else ()


def contenders(results: Sequence[SetResults], fitness: Fitness, rivals: Sequence[float], survivors: int) -> list[int]:
    """Return the places of the sets that miss runs and may survive with them.

    A set cannot survive if at least ``survivors`` others have a better fitness than the set can have with its missing
    runs.

    Args:
        results: Results of new sets; all their maps with missing runs have a failed run.
        fitness: Judges sets; a cluster fitness needs its scale.
        rivals: Fitness of the other sets that may survive.
        survivors: Number of sets that survive.
    """
    partial = {place for place, one in enumerate(results) if missing_runs(one)}
    known = [fitness(one).fitness for place, one in enumerate(results) if place not in partial]
    ranked = sorted([*rivals, *known])
    bar = ranked[survivors - 1] if len(ranked) >= survivors else np.inf
    return [place for place in sorted(partial) if fitness.bound(results[place]) <= bar]
