"""Cluster: maps on which the controllers form one group, two groups, three... (thesis, Alg. 3 and 4)."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations, pairwise, product
from statistics import fmean

import numpy as np

from evolution.search.judging.patterns.base import Pattern, Times, check_maps
from evolution.search.judging.patterns.pools import Found, Pool, Scores, held_apart, orders_of, scores_in
from gym_mapbench.errors import ConfigError


def pairwise_gaps(times: Times) -> list[float]:
    """Absolute differences of all pairs."""
    return [abs(a - b) for a, b in combinations(times, 2)]


def cluster_score(times: Times, scale: float) -> float:
    """Estimated number of groups among the times (Alg. 3, Eq. 4.3), in [1, number of times].

    Args:
        times: One value per controller.
        scale: Mean pairwise gap that stands for one more group, in the unit of ``times``.
    """
    gaps = pairwise_gaps(times)
    mean_gap = fmean(gaps) if gaps else 0.0
    return min(max(1.0 + mean_gap / scale, 1.0), float(len(times)))


def pattern_score(values: Sequence[float]) -> float:
    """Closeness of the sorted values to 1, 2, ..., n (Alg. 4, Eq. 4.4), in [0, 1]; needs at least two values."""
    ordered = np.sort(np.asarray(values, dtype=np.float64))
    pattern = np.arange(1, len(ordered) + 1)
    distance, farthest = np.linalg.norm(ordered - pattern), np.linalg.norm(len(ordered) - pattern)
    return max(1.0 - float(distance / farthest), 0.0)


def partial_pattern_score(values: Sequence[float]) -> float:
    """Pattern fitness of some cluster scores (Alg. 4), in [0, 1].

    Fewer than two values give 0. Two are judged by their distance (1 or more is best), because
    the maps between or beyond them may merely be missing.
    """
    if len(values) < 2:
        return 0.0
    if len(values) == 2:
        return float(min(abs(values[0] - values[1]), 1.0))
    return pattern_score(values)


class Cluster(Pattern):
    """Cluster scores near 1, 2, ..., n; from 0 to 1."""

    wanted = "cluster scores are near 1, 2, ..."
    needs_scale = True
    exact = True

    @classmethod
    def check(cls, maps_per_set: int, controllers: int) -> None:
        """Refuse single maps, which show no pattern."""
        check_maps(maps_per_set, "cluster")

    def score(self, times: Times) -> float:
        """Return the cluster score of the times.

        Raises:
            ConfigError: If the scale is not known yet.
        """
        if self.scale is None:
            raise ConfigError("judging.cluster_scale: expected a value, or results to calibrate it from, got neither")
        return cluster_score(times, self.scale)

    def judge(self, scores: Sequence[float], maps: Sequence[Times]) -> float:
        """Return the pattern fitness of the cluster scores."""
        return partial_pattern_score(scores)

    def bound(self, widest: float) -> float:
        """Return 1, the best pattern fitness there can be."""
        return 1.0

    def best_of(self, pools: Sequence[Pool]) -> Found:
        """Return one score from each pool so that they are closest to 1, 2, ..., n; two are as far apart as possible.

        Only the ``n`` scores of a pool nearest to its number are tried. Without ``caution`` this is exact: if another
        one were chosen, one of these ``n`` would be free and at least as good. With it, a better set may be missed, in
        which an extreme score is moved no further than to its neighbour.
        """
        if len(pools) < 2:
            return None
        best: Found = None
        for order in orders_of(pools):
            scores = scores_in(order)
            for places in product(*_candidates(scores)):
                found = list(zip(order, places, strict=True))
                if len(set(found)) < len(found) or not _ascends(found):
                    continue
                chosen = [float(one[place]) for one, place in zip(scores, places, strict=True)]
                pattern = partial_pattern_score(held_apart(chosen))
                if best is None or pattern > best[0]:
                    best = pattern, found
        return best


def _ascends(found: Sequence[tuple[Pool, int]]) -> bool:
    """Whether the scores of these maps ascend, as the order in which they are tried says."""
    scores = [float(pool.scores[place]) for pool, place in found if pool.scores is not None]
    return all(one <= other for one, other in pairwise(scores))


def _candidates(order: Sequence[Scores]) -> list[list[int]]:
    """Return for each number 1, 2, ... the places of the scores to try."""
    if len(order) == 2:
        return [[int(np.argmin(order[0]))], [int(np.argmax(order[1]))]]
    return [
        [int(place) for place in np.argsort(np.abs(scores - number), kind="stable")[: len(order)]]
        for number, scores in enumerate(order, start=1)
    ]
