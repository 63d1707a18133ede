"""Prospects: what sets of the archive's maps can be expected to be worth in a single drive.

Most maps were driven once or a few times, so what is known of a map's spread is mixed with that of the maps that read
alike. A set whose maps change places in every other drive tells the controllers apart in every other drive only. Which
map stands in the middle hardly changes the fitness, but much of how often the order holds. And what makes a controller
slow on a map makes it run out of time on it now and then: eight drives that all ended shortly before the time limit are
no proof that the ninth will.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from statistics import NormalDist, median
from typing import NamedTuple

import numpy as np
from scipy.stats import t as student

from evolution.search.archive import Archive, best_by_exchange
from evolution.search.judging.exact import Names
from evolution.search.judging.fitness import Fitness, MapResults, readings_of, singles_of

ALIKE = 5
"""Maps most alike, whose spread is what a map's own is expected to be."""
PRIOR = 4
"""Drives that this expectation is worth."""
SINGLE = NormalDist()

Readings = Mapping[str, Sequence[float]]
"""One value for each drive of each map, in the order in which they were driven; the maps by name."""


class Prospect(NamedTuple):
    """What is known of a solved map.

    Args:
        values: The aggregated value of each controller.
        reading: What the map reads by these.
        deviation: Expected standard deviation of the reading of a single drive.
        in_time: Chance that every controller ends a single drive within the time limit.
    """

    values: tuple[float, ...]
    reading: float
    deviation: float
    in_time: float


def prospects_of(archive: Archive, fitness: Fitness, without: frozenset[str] = frozenset()) -> dict[str, Prospect]:
    """Return what is known of every map that was always solved, except for some."""
    maps = archive.solved(without)
    judged = {name: archive.judged(name, fitness) for name in maps}
    readings = {name: readings_of(of_map, fitness) for name, of_map in maps.items()}
    deviations, in_time = deviations_of(readings, readings), chances_in_time(maps, readings, fitness.time_limit)
    return {
        name: Prospect(one.values or (), one.reading or 0.0, deviations[name], in_time[name])
        for name, one in judged.items()
    }


def deviations_of(drives: Readings, readings: Readings) -> dict[str, float]:
    """Return the expected standard deviation of what single drives of each map give.

    It is that of its own drives, mixed with the median one of those maps most alike that were driven more than once; 0
    where nothing was. Alike are maps that read the same at first, and in the median. By the median alone, those that
    were driven again because they read high once would stand for all maps that read low.

    Args:
        drives: What each drive gave, for each map by name.
        readings: What the maps read in each drive.
    """
    places = {name: np.array([readings[name][0], median(readings[name])]) for name in drives}
    known = [name for name, some in drives.items() if len(some) > 1]
    variances = np.array([np.var(drives[name], ddof=1) for name in known])
    others = np.array([places[name] for name in known]).reshape(-1, 2)
    found = {}
    for name, some in drives.items():
        alike = np.argsort(np.abs(others - places[name]).sum(axis=1), kind="stable")[:ALIKE]
        expected = float(np.median(variances[alike])) if known else 0.0
        own = float(np.var(some)) * len(some)
        found[name] = float(np.sqrt((own + PRIOR * expected) / (PRIOR + len(some) - 1)))
    return found


def chances_in_time(maps: Mapping[str, MapResults], readings: Readings, time_limit: float) -> dict[str, float]:
    """Return the chance that the slowest controller ends a further drive of each map within the time limit.

    Logarithms of its times are taken as normally distributed, with the deviation of :func:`deviations_of`.

    Args:
        maps: Results of maps that were always solved, by name.
        readings: What the maps read in each drive.
        time_limit: Simulated seconds.
    """
    slowest = {
        name: [float(np.log(max(run.time_s for (run,) in drive))) for drive in singles_of(of_map)]
        for name, of_map in maps.items()
    }
    deviations = deviations_of(slowest, readings)
    return {
        name: _predicted(np.log(time_limit) - float(np.mean(some)), deviations[name], len(some))
        for name, some in slowest.items()
    }


def _predicted(margin: float, deviation: float, drives: int) -> float:
    """Return how likely a further drive lies less than ``margin`` above the mean of some drives."""
    if deviation == 0.0:
        return float(margin >= 0.0)
    return float(student.cdf(margin / (deviation * np.sqrt(1.0 + 1.0 / drives)), PRIOR + drives - 1))


def expected_value(names: Names, prospects: Mapping[str, Prospect], fitness: Fitness) -> float:
    """Return what a single drive of a set is expected to be worth: less is better.

    That is its fitness, with as much caution for maps that were hardly driven as for others, times the chance that the
    maps keep the order of their readings, if these are normally distributed, and that nobody runs out of time. What is
    worth nothing is worth no more for being out of order.

    Args:
        names: The set.
        prospects: What is known of its maps.
        fitness: Judges sets.
    """
    ordered = sorted((prospects[name] for name in names), key=lambda one: one.reading)
    options = fitness.settings
    spreads = [options.caution * one.deviation for one in ordered]
    value = -options.pattern_weight * fitness.pattern_of([one.values for one in ordered], spreads)[1]
    chances = [*(_chance(*pair) for pair in pairwise(ordered)), *(one.in_time for one in ordered)]
    return value * float(np.prod(chances)) if value < 0.0 else value


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


def least_dispensable(archive: Archive, fitness: Fitness, names: Names, without: frozenset[str] = frozenset()) -> str:
    """Return the map of a set without which the best set would be expected to be worth least.

    Args:
        archive: Every driven map.
        fitness: Judges sets.
        names: The set, by digest.
        without: Maps to leave out in any case.
    """
    prospects = prospects_of(archive, fitness)

    def worth(name: str) -> float:
        others = best_prospect(archive, fitness, len(names), without | {name})
        if not others:
            return float("inf")
        if fitness.kind.ordered:
            return expected_value(others, prospects, fitness)
        return fitness(archive.results_of(archive.map_set(others))).total

    return max(names, key=worth)
