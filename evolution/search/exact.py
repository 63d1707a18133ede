"""The exact best set of all maps that a search ever drove: a baseline every search must beat.

The fitness of a set depends on its maps' results alone, so no new run is needed. Maps fall into few
*pools* of equal successes and timeouts, within which only the readings count. For every choice of
pools the penalties of Eq. 4.5 are constant and the best readings are found directly: for Gini the
best middle value between two extremes is the nearest to their midpoint (the variance of the gaps
grows with the distance from it), for the cluster pattern each of 1, 2, ..., n wants its nearest map.
Choices whose bound is not better than what was found already are skipped.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations_with_replacement, permutations, product

import numpy as np
from numpy.typing import NDArray

from evolution.driving import RunResult
from evolution.search.fitness import Fitness
from gym_mapbench.errors import ConfigError

MAX_MAPS = 3
MapResults = tuple[tuple[RunResult, ...], ...]
"""Results of one map: ``results[controller][repeat]``."""
Names = tuple[str, ...]
Readings = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Pool:
    """Maps that differ in their readings only; equal to itself alone.

    Args:
        maps: Their names, by reading.
        readings: ``(n,)`` their readings, ascending; None where a failure left them without one.
        cost: What one such map adds to the penalties of a set.
        share: What one such map adds to the success rate of a set.
    """

    maps: Names
    readings: Readings | None
    cost: float
    share: float


def best_set(maps: Mapping[str, MapResults], fitness: Fitness, size: int) -> Names:
    """Find the ``size`` different maps whose set has the smallest fitness; the first found of equals.

    Args:
        maps: Results of every driven map, by name.
        fitness: Judges sets; a cluster fitness with its scale.
        size: Maps in a set, 1 to 3.

    Raises:
        ConfigError: If ``size`` is larger than 3, or there are fewer maps.
    """
    if not 1 <= size <= MAX_MAPS:
        raise ConfigError(f"best set: expected 1 to {MAX_MAPS} maps per set, got {size}")
    if len(maps) < size:
        raise ConfigError(f"best set: expected at least {size} driven maps, got {len(maps)}")
    pools = pools_of(maps, fitness, size)
    readings = [pool.readings for pool in pools if pool.readings is not None]
    widest = max(map(np.max, readings)) - min(map(np.min, readings)) if readings else 0.0
    most = 1.0 if fitness.settings.fitness == "cluster" else float(widest)
    best, least = None, np.inf
    for chosen in sorted(_choices(pools, size), key=lambda some: _total(some, most, fitness)):
        if _total(chosen, most, fitness) >= least:
            break
        names, pattern = _best_of(chosen, fitness)
        if (total := _total(chosen, pattern, fitness)) < least:
            best, least = names, total
    assert best is not None  # there are enough maps for one choice
    return best


def pools_of(maps: Mapping[str, MapResults], fitness: Fitness, size: int) -> list[Pool]:
    """Sort maps into pools, as seen by a set of ``size`` maps."""
    members: dict[tuple[float, float, bool], list[tuple[float, str]]] = {}
    for name, results in maps.items():
        one = fitness((results,))
        reading = one.readings[0]
        key = one.success_rate, one.timeouts, reading is None
        members.setdefault(key, []).append((0.0 if reading is None else reading, name))
    options = fitness.settings
    return [
        Pool(
            maps=tuple(name for _, name in sorted(some)),
            readings=None if unread else np.array(sorted(reading for reading, _ in some)),
            cost=options.base_cost * (1.0 - success_rate) / size + options.timeout_cost * timeouts,
            share=success_rate / size,
        )
        for (success_rate, timeouts, unread), some in members.items()
    ]


def _choices(pools: Sequence[Pool], size: int) -> Iterator[tuple[Pool, ...]]:
    """Which pools the maps of a set may come from."""
    for chosen in combinations_with_replacement(pools, size):
        if all(chosen.count(pool) <= len(pool.maps) for pool in chosen):
            yield chosen


def _total(chosen: Sequence[Pool], pattern: float, fitness: Fitness) -> float:
    """Fitness (Eq. 4.5) of a set from these pools that shows this pattern."""
    share = sum(pool.share for pool in chosen)
    return sum(pool.cost for pool in chosen) - fitness.settings.pattern_weight * pattern * share


def _best_of(chosen: tuple[Pool, ...], fitness: Fitness) -> tuple[Names, float]:
    """Return the best maps of one choice of pools, one map from each, and their pattern."""
    read = [pool for pool in chosen if pool.readings is not None]
    found = _best_gini(read, fitness) if fitness.settings.fitness == "gini" else _best_cluster(read, fitness)
    pattern, places = found or (fitness.pattern([]), [])
    names: list[str] = [pool.maps[place] for pool, place in places]
    for pool in _without(chosen, [pool for pool, _ in places]):
        names.append(next(name for name in pool.maps if name not in names))
    return tuple(names), pattern


def _without(pools: Sequence[Pool], used: Sequence[Pool]) -> list[Pool]:
    """The pools that are left after some of them gave a map."""
    left = list(pools)
    for pool in used:
        left.remove(pool)
    return left


Found = tuple[float, list[tuple[Pool, int]]] | None
"""A pattern, and from which place of which pool its maps come; None if there is no pattern."""


def _best_gini(pools: Sequence[Pool], fitness: Fitness) -> Found:
    """Widest and most even spread of one reading from each pool (Alg. 2)."""
    if len(pools) < 2:
        return None
    best: Found = None
    for order in _orders(pools):
        readings = [_readings(pool) for pool in order]
        found = _best_pair(readings, fitness) if len(order) == 2 else _best_triple(readings, fitness)
        if found is not None and (best is None or found[0] > best[0]):
            best = found[0], list(zip(order, found[1], strict=True))
    return best


def _best_pair(readings: Sequence[Readings], fitness: Fitness) -> tuple[float, tuple[int, ...]] | None:
    """The smallest and the largest reading."""
    low, high = readings
    spread = float(high[-1] - low[0])
    return (spread, (0, len(high) - 1)) if spread > fitness.settings.epsilon else None


def _best_triple(readings: Sequence[Readings], fitness: Fitness) -> tuple[float, tuple[int, ...]] | None:
    """Try every pair of extremes with the middle reading nearest to their midpoint."""
    low, middle, high = readings
    best, places = -np.inf, None
    for first, lowest in enumerate(low):
        if high[-1] - lowest <= best:  # the spread bounds the pattern, and only shrinks from here on
            break
        nearest = _nearest(middle, (lowest + high) / 2)
        gaps = middle[nearest] - lowest, high - middle[nearest]
        patterns = high - lowest - fitness.settings.unevenness_weight * ((gaps[0] - gaps[1]) / 2) ** 2
        patterns[np.minimum(*gaps) <= fitness.settings.epsilon] = -np.inf
        last = int(np.argmax(patterns))
        if patterns[last] > best:
            best, places = float(patterns[last]), (first, int(nearest[last]), last)
    return None if places is None else (best, places)


def _nearest(values: Readings, wanted: Readings) -> NDArray[np.intp]:
    """Index of the value nearest to each wanted one; ``values`` are ascending."""
    right = np.searchsorted(values, wanted).clip(1, max(len(values) - 1, 1))
    left = right - 1
    right = np.minimum(right, len(values) - 1)
    return np.where(wanted - values[left] <= values[right] - wanted, left, right)


def _best_cluster(pools: Sequence[Pool], fitness: Fitness) -> Found:
    """Closest to 1, 2, ..., n (Alg. 4), or for two readings farthest apart, with one reading from each pool.

    Exact: were a reading not among the ``n`` nearest of its pool to its number, one of those would be
    free to replace it.
    """
    if len(pools) < 2:
        return None
    best: Found = None
    for order in _orders(pools):
        for places in product(*_candidates(order)):
            found = list(zip(order, places, strict=True))
            if len(set(found)) < len(found):
                continue
            pattern = fitness.pattern([float(_readings(pool)[place]) for pool, place in found])
            if best is None or pattern > best[0]:
                best = pattern, found
    return best


def _candidates(order: Sequence[Pool]) -> list[list[int]]:
    """For each number 1, 2, ... the places worth trying in its pool."""
    if len(order) == 2:
        return [[0], [len(order[1].maps) - 1]]
    return [
        [int(place) for place in np.argsort(np.abs(_readings(pool) - number), kind="stable")[: len(order)]]
        for number, pool in enumerate(order, start=1)
    ]


def _orders(pools: Sequence[Pool]) -> list[tuple[Pool, ...]]:
    """The different orders of these pools, the first the pool of the smallest reading."""
    return list(dict.fromkeys(permutations(pools)))


def _readings(pool: Pool) -> Readings:
    assert pool.readings is not None
    return pool.readings
