"""Gini: maps that range from equal controllers to one far ahead of the others (thesis, Alg. 1 and 2)."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from evolution.search.judging.patterns.base import Pattern, Times, check_maps
from evolution.search.judging.patterns.pools import Found, Pool, Scores, orders_of, scores_in

NO_PATTERN = -1e3
"""What Alg. 2 returns where there is no pattern."""


def gini(times: Times) -> float:
    """Gini coefficient (Alg. 1, Eq. 4.2): 0 if all are equal, ``1 - 1/n`` if one holds everything.

    Args:
        times: One value per controller; equal for all, zeros included, gives 0. Values below 0 count as 0.
    """
    ordered = sorted(max(time, 0.0) for time in times)
    if len(set(ordered)) < 2:  # of some equal times, the formula makes 2e-16
        return 0.0
    n, total = len(ordered), float(sum(ordered))
    weighted = float(sum(rank * time for rank, time in enumerate(ordered, start=1)))
    return max(2.0 * weighted / (n * total) - (n + 1) / n, 0.0)  # nearly equal times may round to just below zero


def gini_fitness(ginis: Sequence[float], epsilon: float = 1e-8, unevenness_weight: float = 1.0) -> float:
    """Pattern fitness of some Gini coefficients (Alg. 2): it is best if they are spread wide and evenly.

    It is the spread minus ``unevenness_weight`` times the population variance of the gaps; -1000 for
    fewer than two coefficients, or if two of them are ``epsilon`` or less apart.
    """
    deltas = [high - low for low, high in pairwise(sorted(ginis))]
    if not deltas or min(deltas) <= epsilon:
        return NO_PATTERN
    spread, count = sum(deltas), len(deltas)
    deviations = [delta - spread / count for delta in deltas]
    return float(spread - unevenness_weight * (sum(one * one for one in deviations) / count))


class Gini(Pattern):
    """Gini coefficients, spread wide and evenly; up to 1.

    The best middle value between two extremes is the one nearest to their midpoint, because the variance of the gaps
    grows with the distance from it. The exact best set is therefore found directly.
    """

    wanted = "Gini coefficients spread wide and evenly"
    nothing = NO_PATTERN
    exact = True

    @classmethod
    def check(cls, maps_per_set: int, controllers: int) -> None:
        """Refuse single maps, which have no spread."""
        check_maps(maps_per_set, "gini")

    def score(self, times: Times) -> float:
        """Return the Gini coefficient of the times."""
        return gini(times)

    def judge(self, scores: Sequence[float], maps: Sequence[Times]) -> float:
        """Return the pattern fitness of the Gini coefficients."""
        return gini_fitness(scores, self.settings.epsilon, self.settings.unevenness_weight)

    def bound(self, widest: float) -> float:
        """Return the spread, which unevenness can only reduce."""
        return widest

    def best_of(self, pools: Sequence[Pool]) -> Found:
        """Return the widest and most even spread of one score from each pool."""
        if len(pools) < 2:
            return None
        best: Found = None
        for order in orders_of(pools):
            scores = scores_in(order)
            found = self._best_pair(scores) if len(order) == 2 else self._best_triple(scores)
            if found is not None and (best is None or found[0] > best[0]):
                best = found[0], list(zip(order, found[1], strict=True))
        return best

    def _best_pair(self, scores: Sequence[Scores]) -> tuple[float, tuple[int, ...]] | None:
        """Take the smallest and the largest score."""
        low, high = scores
        first, last = int(np.argmin(low)), int(np.argmax(high))
        spread = float(high[last] - low[first])
        return (spread, (first, last)) if spread > self.settings.epsilon else None

    def _best_triple(self, scores: Sequence[Scores]) -> tuple[float, tuple[int, ...]] | None:
        """Try every pair of extremes with the middle score nearest to their midpoint."""
        low, middle, high = scores
        best, places = -np.inf, None
        highest = high.max()
        for first, lowest in enumerate(low):
            if highest - lowest <= best:  # the spread bounds the pattern
                continue
            nearest = _nearest(middle, (lowest + high) / 2)
            gaps = middle[nearest] - lowest, high - middle[nearest]
            patterns = high - lowest - self.settings.unevenness_weight * ((gaps[0] - gaps[1]) / 2) ** 2
            patterns[np.minimum(*gaps) <= self.settings.epsilon] = -np.inf
            last = int(np.argmax(patterns))
            if patterns[last] > best:
                best, places = float(patterns[last]), (first, int(nearest[last]), last)
        return None if places is None else (best, places)


def _nearest(values: Scores, wanted: Scores) -> NDArray[np.intp]:
    """Index of the value nearest to each wanted one; ``values`` are ascending."""
    right = np.searchsorted(values, wanted).clip(1, max(len(values) - 1, 1))
    left = right - 1
    right = np.minimum(right, len(values) - 1)
    return np.where(wanted - values[left] <= values[right] - wanted, left, right)
