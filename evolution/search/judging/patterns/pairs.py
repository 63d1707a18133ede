"""Pairs: every controller beats every other on some map of the set."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import permutations, product

import numpy as np
from numpy.typing import NDArray

from evolution.search.judging.patterns.base import Pattern, Times, check_maps, log_times
from evolution.search.judging.patterns.pools import Found, Pool

CLEARLY = math.log(1.2)
"""Lead in the logarithm of the time that counts in full: a factor of 1.2."""


def pair_scores(times: Times) -> NDArray[np.float64]:
    """Return how clearly each controller beats each other on a map, ``(n (n - 1),)`` from 0 to 1 (1.2 times faster).

    Args:
        times: One value per controller; less is better.
    """
    logs = log_times(times)
    leads = [(logs[slower] - logs[faster]) / CLEARLY for faster, slower in permutations(range(len(logs)), 2)]
    return np.clip(np.array(leads, dtype=np.float64), 0.0, 1.0)


class Pairs(Pattern):
    """For every ordered pair of controllers a map on which the first beats the second; from 0 to 1, the mean."""

    wanted = "fastest controllers differ: each beats each other somewhere"
    exact = True
    ordered = False
    less_is_better = True

    @classmethod
    def check(cls, maps_per_set: int, controllers: int) -> None:
        """Refuse single maps: on one map, one of two controllers is faster."""
        check_maps(maps_per_set, "pairs")

    def score(self, times: Times) -> float:
        """Return how many times as long as the fastest controller the slowest takes, as a logarithm."""
        return float(np.ptp(log_times(times)))

    def judge(self, scores: Sequence[float], maps: Sequence[Times]) -> float:
        """Return the mean over the ordered pairs of the clearest lead on any of the maps."""
        if not maps or len(maps[0]) < 2:
            return 0.0
        return float(np.max([pair_scores(times) for times in maps], axis=0).mean())

    def bound(self, widest: float) -> float:
        """Return 1: every controller beats every other."""
        return 1.0

    def best_of(self, pools: Sequence[Pool]) -> Found:
        """Return one map from each pool so that the most pairs are decided.

        Only maps that no other map of their pool surpasses in all pairs are tried, and a few more to fill the set.
        This is exact: a map that is surpassed can be replaced by the one that surpasses it; if that one is in the set
        already, any map is as good.
        """
        if not pools:
            return None
        scores = [np.array([pair_scores(times) for times in pool.times]) for pool in pools]
        *others, last = [_candidates(of_pool, len(pools)) for of_pool in scores]
        best: Found = None
        for places in product(*others):
            found = list(zip(pools[:-1], places, strict=True))
            if len(set(found)) < len(found):
                continue
            chosen = [of_pool[place] for of_pool, place in zip(scores[:-1], places, strict=True)]
            decided = np.max([np.zeros(scores[-1].shape[1]), *chosen], axis=0)
            patterns = np.maximum(scores[-1][last], decided).mean(axis=1)
            patterns[[(pools[-1], place) in found for place in last]] = -np.inf
            most = int(np.argmax(patterns))
            if best is None or patterns[most] > best[0]:
                best = float(patterns[most]), [*found, (pools[-1], last[most])]
        return best


def _candidates(scores: NDArray[np.float64], size: int) -> list[int]:
    """Return the places of the rows that no other row reaches in every column, then of ``size`` others."""
    first: list[int] = []
    others: list[int] = []
    for place, row in enumerate(scores):
        reached = (scores >= row).all(axis=1)
        better = reached & ((scores > row).any(axis=1) | (np.arange(len(scores)) < place))
        (others if better.any() else first).append(place)
    return first + others[:size]
