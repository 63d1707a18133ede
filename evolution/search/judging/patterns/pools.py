"""Pools: groups of maps that differ only in their scores, from which a pattern chooses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import permutations

import numpy as np
from numpy.typing import NDArray

Scores = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Pool:
    """Maps that differ only in their scores; two pools are never equal.

    Args:
        maps: Their names, in order of their scores.
        scores: ``(n,)`` scores, ascending; None where a failure left the maps without one.
        spreads: ``(n,)`` by how much each score counts as less extreme where it is the smallest or largest of a set.
        times: For each map the values of the controllers; empty where there are no scores.
        successes: Successful runs of one such map.
        runs: All runs of one such map.
        timeouts: Its timed-out runs per repeat.
    """

    maps: tuple[str, ...]
    scores: Scores | None
    spreads: Scores
    times: tuple[tuple[float, ...], ...]
    successes: float
    runs: float
    timeouts: float


Found = tuple[float, list[tuple[Pool, int]]] | None
"""A pattern value, and the pool and place of each map that shows it; None if there is no pattern."""


def orders_of(pools: Sequence[Pool]) -> list[tuple[Pool, ...]]:
    """Return the different orders of these pools; the first pool of an order gives the smallest score."""
    return list(dict.fromkeys(permutations(pools)))


def scores_in(order: Sequence[Pool]) -> list[Scores]:
    """Return the scores of pools that have scores, as they count at their places in a set.

    The first pool gives the smallest score of the set and the last the largest: these two count as less extreme by the
    spread of their maps.
    """
    found = []
    for place, pool in enumerate(order):
        assert pool.scores is not None
        sign = (place == 0) - (place == len(order) - 1)
        found.append(pool.scores + sign * pool.spreads)
    return found


def held_apart(scores: Sequence[float]) -> list[float]:
    """Return scores of a set whose extremes were moved towards each other, limited to the scores next to them.

    Two scores meet at most. Without the limit, uncertainty would count as a difference.

    Args:
        scores: At least two, in the order that they had before they were moved.
    """
    low, *between, high = scores
    if between:
        return [min(low, between[0]), *between, max(high, between[-1])]
    return [low, high] if low <= high else [(low + high) / 2] * 2
