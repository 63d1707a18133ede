"""Roles: one map on which all controllers are alike, one on which one stands apart, one on which all differ.

Gini and cluster scores see how far apart the controllers are on the whole; neither sees whether the middle one drives
with the fast or with the slow ones. Roles look at every gap between controllers that follow each other in time.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import combinations, product

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from evolution.search.judging.patterns.base import Pattern, PatternOptions, Times, log_times
from evolution.search.judging.patterns.pools import Found, Pool, orders_of
from gym_mapbench.errors import ConfigError

ALIKE = math.log(1.2)
"""Gap of the logarithms of two times that a person still calls equal: a factor of 1.2."""
APART = math.log(1.5)
"""Gap at which two controllers stand wholly apart: a factor of 1.5."""
FEWEST = 3


def log_gaps(times: Times) -> NDArray[np.float64]:
    """Return the differences of the logarithms of neighbouring times, ``(n - 1,)``, in order of the times."""
    gaps: NDArray[np.float64] = np.diff(np.sort(log_times(times)))
    return gaps


def groups(times: Times) -> float:
    """Return in how many groups the controllers drive: 1 if all are alike, their number if all stand apart."""
    return 1.0 + float(np.minimum(log_gaps(times) / APART, 1.0).sum())


def role_scores(times: Times) -> NDArray[np.float64]:
    """Return how well a map fills each role, ``(n,)`` from 0 to 1.

    With three controllers, whose gaps are ``a <= b``: ``1 - (a + b) / ln 1.2`` (all alike),
    ``b / ln 1.5 (1 - a / ln 1.2)`` (two groups) and ``a / ln 1.5`` (all apart), every quotient and score cut off at 0
    and 1. With more, role ``i`` is filled by ``i`` groups.

    Args:
        times: One value per controller.
    """
    if len(times) != FEWEST:
        return _cut_off(1.0 - np.abs(groups(times) - np.arange(1, len(times) + 1)))
    less, more = np.sort(log_gaps(times))
    alike = 1.0 - (less + more) / ALIKE
    mixed = min(more / APART, 1.0) * (1.0 - min(less / ALIKE, 1.0))
    return _cut_off(np.array([alike, mixed, less / APART]))


def _cut_off(scores: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.minimum(np.maximum(scores, 0.0), 1.0)


class Roles(Pattern):
    """Maps that fill the roles of 1, 2, ..., n groups of controllers; from 0 to 1, the mean over the roles."""

    reading_name = "groups"
    wanted = "controllers form one group, two groups, ..."
    exact = True
    solved_only = True

    @classmethod
    def check(cls, settings: PatternOptions, controllers: int) -> None:
        """Refuse fewer than three maps or controllers, and failures that count as times: three would look alike."""
        if settings.maps_per_set < FEWEST:
            raise ConfigError(f"maps_per_set: expected {FEWEST} or more with roles, got {settings.maps_per_set}")
        if controllers < FEWEST:
            raise ConfigError(f"controllers: expected {FEWEST} or more with roles, got {controllers}")
        if settings.failures != "exclude":
            raise ConfigError(
                f"failures: expected 'exclude' with roles, got {settings.failures!r}, by which three failures are equal"
            )

    def read(self, times: Times) -> float:
        """Return the number of groups."""
        return groups(times)

    def judge(self, readings: Sequence[float], maps: Sequence[Times]) -> float:
        """Return the mean over the roles of the best assignment of maps to roles; a role without a map counts 0."""
        if not maps:
            return 0.0
        scores = np.array([role_scores(times) for times in maps])
        filled = scores[linear_sum_assignment(scores, maximize=True)]
        return float(filled.sum()) / int(scores.shape[1])

    def bound(self, widest: float) -> float:
        """Return 1: every role is filled."""
        return 1.0

    def best_of(self, pools: Sequence[Pool]) -> Found:
        """Return one map from each pool so that they fill the roles best.

        Only the ``n`` maps of a pool that fill a role best are tried, for sets of ``n`` maps. This is exact: if another
        one were chosen, one of these would be free and at least as good.
        """
        if not pools:
            return None
        best: Found = None
        for order in orders_of(pools):
            scores = [np.array([role_scores(times) for times in pool.times]) for pool in order]
            for roles in combinations(range(scores[0].shape[1]), min(len(order), scores[0].shape[1])):
                found = _best_in(order, scores, roles)
                if found is not None and (best is None or found[0] > best[0]):
                    best = found
        return best


def _best_in(order: Sequence[Pool], scores: Sequence[NDArray[np.float64]], roles: Sequence[int]) -> Found:
    """Return the best maps if each pool fills the role at its place."""
    best: Found = None
    candidates = [
        [int(place) for place in np.argsort(-of_pool[:, role], kind="stable")[: len(order)]]
        for of_pool, role in zip(scores, roles, strict=False)
    ]
    for places in product(*candidates):
        found = list(zip(order, places, strict=False))
        if len(set(found)) < len(found):
            continue
        filled = sum(float(of_pool[place, role]) for of_pool, place, role in zip(scores, places, roles, strict=False))
        pattern = filled / scores[0].shape[1]
        if best is None or pattern > best[0]:
            best = pattern, found
    return best
