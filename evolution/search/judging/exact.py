"""The exact best set of all maps that a search evaluated: a baseline that every search must beat.

The fitness of a set depends on its maps' results alone, so no new run is needed. Maps fall into few *pools* of equal
runs, successes and timeouts, within which only the scores count. For every choice of pools the penalty of Eq. 4.5 is
constant, and the pattern finds the best scores directly (:meth:`~evolution.search.judging.patterns.Pattern.best_of`).
Choices whose bound is not better than the best set so far are skipped.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations_with_replacement
from typing import NamedTuple

import numpy as np

from evolution.files import counted
from evolution.search.judging.equation import gain, penalty
from evolution.search.judging.fitness import Fitness
from evolution.search.judging.judgement import JudgedMap
from evolution.search.judging.map_results import MapResults
from evolution.search.judging.patterns import Pool
from gym_mapbench.errors import ConfigError

MAX_MAPS = 3
Names = tuple[str, ...]


def best_set(maps: Mapping[str, MapResults], fitness: Fitness, size: int) -> Names:
    """Find the ``size`` different maps whose set has the smallest fitness; of equals, the first found.

    Args:
        maps: Results of every map, by name.
        fitness: Judges sets; a cluster fitness needs its scale.
        size: Maps in a set, 1 to 3.

    Raises:
        ConfigError: If ``size`` is not 1 to 3, there are fewer maps, or the fitness cannot find its exact best set.
    """
    return best_of_judged({name: fitness.judge_map(results) for name, results in maps.items()}, fitness, size)


def check_sizes(count: int, size: int) -> None:
    """Raise ``ConfigError`` if there is no exact best set of ``size`` among ``count`` maps."""
    if not 1 <= size <= MAX_MAPS:
        raise ConfigError(f"best set: expected 1 to {MAX_MAPS} maps per set, got {size}")
    if count < size:
        raise ConfigError(f"best set: expected at least {counted(size, 'map')}, got {count}")


def best_of_judged(maps: Mapping[str, JudgedMap], fitness: Fitness, size: int) -> Names:
    """Do the same as :func:`best_set` with maps that this fitness has judged.

    Args:
        maps: Every map, by name.
        fitness: Judges sets; a cluster fitness needs its scale.
        size: Maps in a set, 1 to 3.

    Raises:
        ConfigError: If ``size`` is not 1 to 3, there are fewer maps, or the fitness cannot find its exact best set.
    """
    check_sizes(len(maps), size)
    if not fitness.exact:
        raise ConfigError(f"fitness {fitness.settings.fitness!r}: how to find its exact best set is not known")
    pools = pools_of(maps)
    scores = [pool.scores for pool in pools if pool.scores is not None]
    widest = max(map(np.max, scores)) - min(map(np.min, scores)) if scores else 0.0
    most = fitness.kind.bound(float(widest))
    best, least = None, np.inf
    for chosen in sorted(_choices(pools, size), key=lambda some: _total(some, most, fitness)):
        if _total(chosen, most, fitness) >= least:
            break
        names, pattern = _best_of(chosen, fitness)
        if (total := _total(chosen, pattern, fitness)) < least:
            best, least = names, total
    assert best is not None  # there are enough maps for one choice
    return best


def pools_of(maps: Mapping[str, JudgedMap]) -> list[Pool]:
    """Sort maps into pools.

    The number of runs of a map is its weight in the success rate of a set. It does not count where all rates are equal.
    """
    alike = len({one.success_rate for one in maps.values()}) == 1
    members: dict[_Key, list[_Member]] = {}
    for name, one in maps.items():
        counts = (one.success_rate, 1.0) if alike else (one.successes, float(one.runs))
        key = _Key(*counts, one.timeouts, one.score is None)
        members.setdefault(key, []).append(_Member(one.score or 0.0, name, one.values or (), one.spread))
    return [_pool(sorted(some), key) for key, some in members.items()]


class _Key(NamedTuple):
    """What the maps of a pool have in common."""

    successes: float
    runs: float
    timeouts: float
    without_score: bool


class _Member(NamedTuple):
    """A map of a pool; sorted by its score."""

    score: float
    name: str
    values: tuple[float, ...]
    spread: float


def _pool(some: Sequence[_Member], key: _Key) -> Pool:
    """Make the pool of some maps in their order."""
    return Pool(
        maps=tuple(one.name for one in some),
        scores=None if key.without_score else np.array([one.score for one in some]),
        spreads=np.array([one.spread for one in some]),
        times=() if key.without_score else tuple(one.values for one in some),
        successes=key.successes,
        runs=key.runs,
        timeouts=key.timeouts,
    )


def _choices(pools: Sequence[Pool], size: int) -> Iterator[tuple[Pool, ...]]:
    """Yield every choice of pools that the maps of a set may come from."""
    for chosen in combinations_with_replacement(pools, size):
        if all(chosen.count(pool) <= len(pool.maps) for pool in chosen):
            yield chosen


def _total(chosen: Sequence[Pool], pattern: float, fitness: Fitness) -> float:
    """Return the fitness (Eq. 4.5) of a set from these pools with this pattern value."""
    success_rate = sum(pool.successes for pool in chosen) / sum(pool.runs for pool in chosen)
    timeouts = sum(pool.timeouts for pool in chosen)
    return penalty(fitness.settings, success_rate, timeouts) - gain(fitness.settings, pattern, success_rate)


def _best_of(chosen: tuple[Pool, ...], fitness: Fitness) -> tuple[Names, float]:
    """Return the best maps of one choice of pools, one map from each, and their pattern."""
    scored = [pool for pool in chosen if pool.scores is not None]
    pattern, places = fitness.kind.best_of(scored) or (fitness.kind.nothing, [])
    names: list[str] = [pool.maps[place] for pool, place in places]
    for pool in _without(chosen, [pool for pool, _ in places]):
        names.append(next(name for name in pool.maps if name not in names))
    return tuple(names), pattern


def _without(pools: Sequence[Pool], used: Sequence[Pool]) -> list[Pool]:
    """Return the pools that are left after some of them have given a map."""
    left = list(pools)
    for pool in used:
        left.remove(pool)
    return left
