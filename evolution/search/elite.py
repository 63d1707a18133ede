"""The elite: the best set of the archive, whose maps are driven more often, so that luck does not keep them there."""

from __future__ import annotations

from evolution.search.archive import Archive
from evolution.search.budget import Budget
from evolution.search.judging.exact import Names
from evolution.search.judging.fitness import Fitness
from evolution.search.settings import EvolveSettings

MAX_ROUNDS = 3
"""How often after a generation the best set may change because its maps were driven again."""
LEAST_GAIN = 0.1
"""By how much a set with maps that were driven less must be fitter than the best one without, to be worth driving."""


def find_elite(archive: Archive, fitness: Fitness, settings: EvolveSettings, budget: Budget) -> Names:
    """Return the best set of the archive after its maps were driven with further seeds; empty if too few are solved.

    Maps that were driven so before get one more seed.

    Args:
        archive: Every driven map.
        fitness: Judges sets.
        settings: Options of the search.
        budget: Limits the runs.
    """
    names = _promising(archive, fitness, settings)
    wanted = {name: _next_repeats(archive.repeats_of(name), settings) for name in names}
    for _ in range(MAX_ROUNDS):
        cost = budget.cost_of(wanted)
        if cost == 0 or cost > budget.runs:
            break
        archive.drive(wanted)
        names = _promising(archive, fitness, settings)
        wanted = dict.fromkeys(names, settings.elite_repeats)
    return names


def _promising(archive: Archive, fitness: Fitness, settings: EvolveSettings) -> Names:
    """Return the best set, or the best one of maps that belong to the elite already if it is hardly less fit."""
    best = archive.best(fitness, settings.maps_per_set)
    once = [name for name in archive.scenarios if archive.repeats_of(name) < settings.elite_repeats]
    known = archive.best(fitness, settings.maps_per_set, without=once)
    if not known:
        return best
    totals = [fitness(archive.results_of(archive.map_set(names))).total for names in (best, known)]
    return best if totals[0] < totals[1] - LEAST_GAIN else known


def _next_repeats(repeats: int, settings: EvolveSettings) -> int:
    """Return how often a map of the best set should be driven that was driven so often."""
    if repeats < settings.elite_repeats:
        return settings.elite_repeats
    return max(repeats, min(repeats + 1, settings.most_elite_repeats))
