"""The elite: the best set of the archive, or the Pareto front. Its maps get further seeds, against selection bias."""

from __future__ import annotations

from collections.abc import Iterable

from evolution.search.algorithms import Evaluation
from evolution.search.archive import Archive
from evolution.search.budget import Budget
from evolution.search.judging import Fitness, Judgement, Names
from evolution.search.settings import EvolveSettings

MAX_ROUNDS = 3
"""Number of times that the best set may change after a generation because its maps got further runs."""
LEAST_GAIN = 0.1
"""A set with maps that are not in the elite yet gets further runs if its fitness is better by more than this."""


def find_elite(archive: Archive, fitness: Fitness, settings: EvolveSettings, budget: Budget) -> Names:
    """Return the best set of the archive after its maps got further seeds; empty if too few maps are solved.

    Maps that have the repeats of the elite already get one more seed.

    Args:
        archive: Every evaluated map.
        fitness: Judges sets.
        settings: Options of the search.
        budget: Limits the runs.
    """
    names = _best_with_few_new_maps(archive, fitness, settings)
    wanted = {name: _next_repeats(archive.repeats_of(name), settings) for name in names}
    for _ in range(MAX_ROUNDS):
        cost = budget.cost_of(wanted)
        if cost == 0 or cost > budget.runs:
            break
        archive.drive(wanted)
        names = _best_with_few_new_maps(archive, fitness, settings)
        wanted = dict.fromkeys(names, settings.elite_repeats)
    return names


def give_further_seeds(front: Iterable[Evaluation], archive: Archive, settings: EvolveSettings, budget: Budget) -> None:
    """Drive the maps of a Pareto front with further seeds: those of the elite, then one more in each generation.

    Args:
        front: Its sets; of the last ones, nothing is driven where the runs do not suffice.
        archive: Every evaluated map.
        settings: Options of the search.
        budget: Limits the runs.
    """
    wanted: dict[str, int] = {}
    for one in front:
        names = [scenario.world_digest for scenario in one.map_set]
        more = wanted | {name: _next_repeats(archive.repeats_of(name), settings) for name in names}
        if budget.cost_of(more) <= budget.runs:
            wanted = more
    archive.drive(wanted, everyone=True)


def _best_with_few_new_maps(archive: Archive, fitness: Fitness, settings: EvolveSettings) -> Names:
    """Return the best set; the best one of maps that have the repeats of the elite, if it is nearly as good."""
    best = archive.best(fitness, settings.maps_per_set)
    few = [name for name in archive.scenarios if archive.repeats_of(name) < settings.elite_repeats]
    known = archive.best(fitness, settings.maps_per_set, without=few)
    if not known:
        return best
    ours, theirs = (_judged(names, archive, fitness) for names in (best, known))
    return best if ours.fitness < theirs.fitness - LEAST_GAIN else known


def _judged(names: Names, archive: Archive, fitness: Fitness) -> Judgement:
    return fitness(archive.results_of(archive.map_set(names)))


def _next_repeats(repeats: int, settings: EvolveSettings) -> int:
    """Return the number of repeats that a map of the best set should have next."""
    if repeats < settings.elite_repeats:
        return settings.elite_repeats
    return max(repeats, min(repeats + 1, settings.most_elite_repeats))
