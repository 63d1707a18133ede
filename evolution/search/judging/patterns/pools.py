"""Pools: groups of maps that differ only in their readings, from which a pattern chooses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import permutations

import numpy as np
from numpy.typing import NDArray

Readings = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Pool:
    """Maps that differ only in their readings; two pools are never equal.

    Args:
        maps: Their names, in order of their readings.
        readings: ``(n,)`` their readings, ascending; None where a failure left them without one.
        spreads: ``(n,)`` by how much each reading counts as less extreme where it is the smallest or largest of a set.
        times: For each map the values of the controllers that it was read from; empty where there are no readings.
        cost: What one such map adds to the penalties of a set.
        share: What one such map adds to the success rate of a set.
    """

    maps: tuple[str, ...]
    readings: Readings | None
    spreads: Readings
    times: tuple[tuple[float, ...], ...]
    cost: float
    share: float


Found = tuple[float, list[tuple[Pool, int]]] | None
"""A pattern value, and the pool and the place in it of each map that shows it; None if there is no pattern."""


def orders_of(pools: Sequence[Pool]) -> list[tuple[Pool, ...]]:
    """Return the different orders of these pools; the first pool of an order gives the smallest reading."""
    return list(dict.fromkeys(permutations(pools)))


def readings_in(order: Sequence[Pool]) -> list[Readings]:
    """Return the readings of pools that have some, as they count at their places in a set.

    The first pool gives the smallest reading of the set and the last the largest: these count as less extreme by the
    spread of their maps.
    """
    found = []
    for place, pool in enumerate(order):
        assert pool.readings is not None
        sign = (place == 0) - (place == len(order) - 1)
        found.append(pool.readings + sign * pool.spreads)
    return found


def held_apart(readings: Sequence[float]) -> list[float]:
    """Return readings of a set whose extremes were moved towards each other, moved no further than to their neighbour.

    Two alone are moved no further than to where they meet. Beyond, doubt would count as a difference.

    Args:
        readings: At least two, in the order that they had before they were moved.
    """
    low, *between, high = readings
    if between:
        return [min(low, between[0]), *between, max(high, between[-1])]
    return [low, high] if low <= high else [(low + high) / 2] * 2
