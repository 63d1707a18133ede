"""The elite: the best set of the archive, whose maps are driven more often, so that luck does not keep them there."""

from __future__ import annotations

from evolution.search.archive import Archive
from evolution.search.budget import Budget
from evolution.search.exact import Names
from evolution.search.fitness import Fitness
from evolution.search.settings import EvolveSettings

MAX_ROUNDS = 3
"""How often after a generation the best set may change because its maps were driven again."""


def find_elite(archive: Archive, fitness: Fitness, settings: EvolveSettings, budget: Budget) -> Names:
    """Return the best set of the archive after its maps were driven with further seeds; empty if too few are solved.

    Maps that were driven so before get one more seed.

    Args:
        archive: Every driven map.
        fitness: Judges sets.
        settings: Options of the search.
        budget: Limits the runs.
    """
    names = archive.best(fitness, settings.maps_per_set)
    wanted = {name: _next_repeats(archive.repeats_of(name), settings) for name in names}
    for _ in range(MAX_ROUNDS):
        cost = budget.cost_of(wanted)
        if cost == 0 or cost > budget.runs:
            break
        archive.drive(wanted)
        names = archive.best(fitness, settings.maps_per_set)
        wanted = dict.fromkeys(names, settings.elite_repeats)
    return names


def _next_repeats(repeats: int, settings: EvolveSettings) -> int:
    """Return how often a map of the best set should be driven that was driven so often."""
    if repeats < settings.elite_repeats:
        return settings.elite_repeats
    return max(repeats, min(repeats + 1, settings.most_elite_repeats))
