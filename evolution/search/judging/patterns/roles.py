"""Roles: maps with one group of controllers, two groups, ..., each of them different from all others.

Gini and cluster scores measure how far apart the controllers are as a whole. They do not tell whether the middle
controller belongs to the fast or to the slow ones. Roles use every gap between controllers that are neighbours in time.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import combinations, product

import numpy as np
import scipy
from numpy.typing import NDArray

from evolution.search.judging.patterns.base import Pattern, Times, check_maps, log_times
from evolution.search.judging.patterns.pools import Found, Pool, orders_of
from gym_mapbench.errors import ConfigError

ALIKE = math.log(1.2)
"""Gap of the logarithms of two times that count as equal: a factor of 1.2."""
APART = math.log(1.5)
"""Gap of the logarithms of two times that differ fully: a factor of 1.5."""
FEWEST = 3


def log_gaps(times: Times) -> NDArray[np.float64]:
    """Return the differences of the logarithms of neighbouring times, ``(n - 1,)``, in order of the times."""
    gaps: NDArray[np.float64] = np.diff(np.sort(log_times(times)))
    return gaps


def groups(times: Times) -> float:
    """Return the number of groups of controllers: 1 if all are equally fast, their number if all differ."""
    return 1.0 + float(np.minimum(log_gaps(times) / APART, 1.0).sum())


def role_scores(times: Times) -> NDArray[np.float64]:
    """Return how well a map fills each role, ``(n,)`` from 0 to 1.

    With three controllers, whose gaps are ``a <= b``: ``1 - (a + b) / ln 1.2`` (all equal),
    ``b / ln 1.5 (1 - a / ln 1.2)`` (two groups) and ``a / ln 1.5`` (all differ), every quotient and score cut off at 0
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

    wanted = "controllers form one group, two groups, ..."
    exact = True
    solved_only = True

    @classmethod
    def check(cls, maps_per_set: int, controllers: int) -> None:
        """Refuse fewer than three maps or controllers."""
        check_maps(maps_per_set, "roles", FEWEST)
        if controllers < FEWEST:
            raise ConfigError(f"controllers: expected {FEWEST} or more with roles, got {controllers}")

    def score(self, times: Times) -> float:
        """Return the number of groups."""
        return groups(times)

    def judge(self, scores: Sequence[float], maps: Sequence[Times]) -> float:
        """Return the mean over the roles of the best assignment of maps to roles; a role without a map counts 0."""
        if not maps:
            return 0.0
        of_roles = np.array([role_scores(times) for times in maps])
        filled = of_roles[scipy.optimize.linear_sum_assignment(of_roles, maximize=True)]
        return float(filled.sum()) / int(of_roles.shape[1])

    def bound(self, widest: float) -> float:
        """Return 1: every role is filled."""
        return 1.0

    def best_of(self, pools: Sequence[Pool]) -> Found:
        """Return one map from each pool so that they fill the roles best.

        Only the ``n`` maps of a pool that fill a role best are tried, for sets of ``n`` maps. The result is exact:
        for any other map, one of these maps is free and at least as good.
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
