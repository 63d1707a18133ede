"""Prospects: what sets of the archive's maps can be expected to be worth in a single drive.

Most maps were driven once or a few times, so what is known of a map's spread is mixed with that of the maps that read
alike. A set whose maps change places in every other drive tells the controllers apart in every other drive only. Which
map stands in the middle hardly changes the fitness, but much of how often the order holds.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from statistics import NormalDist
from typing import NamedTuple

import numpy as np

from evolution.search.archive import Archive, best_by_exchange
from evolution.search.exact import Names
from evolution.search.fitness import Fitness, MapResults, readings_of

ALIKE = 5
"""Maps nearest in their readings whose spread is what a map's own is expected to be."""
PRIOR = 4
"""Drives that this expectation is worth."""
SINGLE = NormalDist()


class Prospect(NamedTuple):
    """What is known of a solved map.

    Args:
        values: The aggregated value of each controller.
        reading: What the map reads by these.
        deviation: Expected standard deviation of the reading of a single drive.
    """

    values: tuple[float, ...]
    reading: float
    deviation: float


def prospects_of(archive: Archive, fitness: Fitness, without: frozenset[str] = frozenset()) -> dict[str, Prospect]:
    """Return what is known of every map that was always solved, except for some."""
    maps = archive.solved(without)
    judged = {name: archive.judged(name, fitness) for name in maps}
    deviations = deviations_of(maps, {name: one.reading or 0.0 for name, one in judged.items()}, fitness)
    return {name: Prospect(one.values or (), one.reading or 0.0, deviations[name]) for name, one in judged.items()}


def deviations_of(maps: Mapping[str, MapResults], readings: Mapping[str, float], fitness: Fitness) -> dict[str, float]:
    """Return the expected standard deviation of single readings of each map.

    It is that of its own drives, mixed with the median one of those maps nearest in their readings that were driven
    more than once; 0 where nothing was.

    Args:
        maps: Results by name.
        readings: The readings of these maps.
        fitness: Reads maps.
    """
    singles = {name: readings_of(of_map, fitness) for name, of_map in maps.items()}
    known = [name for name, some in singles.items() if len(some) > 1]
    places = np.array([readings[name] for name in known])
    variances = np.array([np.var(singles[name], ddof=1) for name in known])
    found = {}
    for name, some in singles.items():
        nearest = np.argsort(np.abs(places - readings[name]), kind="stable")[:ALIKE]
        expected = float(np.median(variances[nearest])) if known else 0.0
        own = float(np.var(some)) * len(some)
        found[name] = float(np.sqrt((own + PRIOR * expected) / (PRIOR + len(some) - 1)))
    return found


def expected_value(names: Names, prospects: Mapping[str, Prospect], fitness: Fitness) -> float:
    """Return what a single drive of a set is expected to be worth: less is better.

    That is its fitness, with as much caution for maps that were hardly driven as for others, times the chance that the
    maps keep the order of their readings, if these are normally distributed. What is worth nothing is worth no more
    for being out of order.

    Args:
        names: The set.
        prospects: What is known of its maps.
        fitness: Judges sets.
    """
    ordered = sorted((prospects[name] for name in names), key=lambda one: one.reading)
    options = fitness.settings
    spreads = [options.caution * one.deviation for one in ordered]
    value = -options.pattern_weight * fitness.pattern_of([one.values for one in ordered], spreads)[1]
    return value * float(np.prod([_chance(*pair) for pair in pairwise(ordered)])) if value < 0.0 else value


def _chance(less: Prospect, more: Prospect) -> float:
    """Return how likely a single drive of one map reads less than one of another."""
    deviation = float(np.hypot(less.deviation, more.deviation))
    return SINGLE.cdf((more.reading - less.reading) / deviation) if deviation > 0.0 else 1.0


def best_prospect(archive: Archive, fitness: Fitness, size: int, without: frozenset[str] = frozenset()) -> Names:
    """Return the set of which a single drive is expected to be worth most; empty if there are too few solved maps.

    No exchange of a single map improves it, begun with the fittest set. Where the order of maps does not count, it is
    the fittest set.

    Args:
        archive: Every driven map.
        fitness: Judges sets.
        size: Maps in a set.
        without: Maps to leave out, by digest.
    """
    names = archive.best(fitness, size, without)
    if not names or not fitness.kind.ordered:
        return names
    prospects = prospects_of(archive, fitness, without)
    return best_by_exchange(names, prospects, lambda some: expected_value(some, prospects, fitness))
