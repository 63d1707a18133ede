"""Regret: maps on which the first controller is slow or fails where another one is fast.

Source of the idea: regret as the objective of environment design, Dennis et al., "Emergent Complexity and Zero-shot
Transfer via Unsupervised Environment Design" (PAIRED, 2020).
"""

from __future__ import annotations

from collections.abc import Sequence
from statistics import fmean

from evolution.search.judging.patterns.base import Parts, Pattern, Times, log_times
from gym_mapbench.errors import ConfigError


class Regret(Pattern):
    """The mean over the maps of the logarithm of the first controller's time over the shortest time of the others.

    Failures of the first controller are what it looks for; with ``failures: par2`` they count as twice the time limit.
    """

    wanted = "first controller is slower than another"
    ordered = False
    less_is_better = True

    @classmethod
    def check(cls, maps_per_set: int, controllers: int) -> None:
        """Refuse a single controller, which has no other beside it."""
        if controllers < 2:
            raise ConfigError(f"controllers: expected 2 or more with regret, got {controllers}")

    def score(self, times: Times) -> float:
        """Return log(first time / shortest time of the others); 0 where the first is not slower."""
        first, *others = log_times(times)
        return max(float(first - min(others)), 0.0)

    def judge(self, scores: Sequence[float], maps: Sequence[Times]) -> float:
        """Return the mean score."""
        return fmean(scores) if scores else 0.0

    def objectives_of(self, parts: Parts) -> tuple[float, ...]:
        """Return the negative regret: failures cost nothing but their time."""
        return (0.0 - parts.pattern,)
