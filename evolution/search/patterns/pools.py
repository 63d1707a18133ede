"""Pools: maps that differ in their readings only, which a pattern chooses from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import permutations

import numpy as np
from numpy.typing import NDArray

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

    maps: tuple[str, ...]
    readings: Readings | None
    cost: float
    share: float


Found = tuple[float, list[tuple[Pool, int]]] | None
"""A pattern, and from which place of which pool its maps come; None if there is no pattern."""


def orders_of(pools: Sequence[Pool]) -> list[tuple[Pool, ...]]:
    """Return the different orders of these pools, the first the pool of the smallest reading."""
    return list(dict.fromkeys(permutations(pools)))


def readings_of(pool: Pool) -> Readings:
    """Return the readings of a pool that has some."""
    assert pool.readings is not None
    return pool.readings
