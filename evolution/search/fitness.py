"""What makes a good map set: Gini and cluster patterns, and their composition with penalties.

Source: thesis, sections 4.1.8 to 4.1.12. The pattern functions take plain numbers and are
maximised (Gini: up to 1; cluster: 0 to 1); :class:`Fitness` negates them and is minimised.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from statistics import fmean, median

import numpy as np

from evolution.driving import RunResult, SetResults
from evolution.search.settings import EvolveSettings
from gym_mapbench.errors import ConfigError, RunError

NO_PATTERN = -1e3
"""What Alg. 2 returns where there is nothing to compare."""

AGGREGATES: dict[str, Callable[[list[float]], float]] = {"mean": fmean, "median": median}

Times = Sequence[float]
"""One value per controller on one map."""


def gini(times: Times) -> float:
    """Gini coefficient (Alg. 1, Eq. 4.2): 0 if all are equal, ``1 - 1/n`` if one holds everything.

    Args:
        times: One value >= 0 per controller; equal for all, zeros included, gives 0.
    """
    ordered = np.sort(np.asarray(times, dtype=np.float64))
    n, total = len(ordered), float(ordered.sum())
    if total == 0.0:
        return 0.0
    weighted = float((np.arange(1, n + 1) * ordered).sum())
    return max(2.0 * weighted / (n * total) - (n + 1) / n, 0.0)  # equal times may round to just below zero


def gini_fitness(ginis: Sequence[float], epsilon: float = 1e-8, unevenness_weight: float = 1.0) -> float:
    """Pattern fitness of some Gini coefficients (Alg. 2): wide and evenly spread is best.

    Spread minus ``unevenness_weight`` times the population variance of the gaps; -1000 for fewer
    than two coefficients, or if two of them are ``epsilon`` or less apart.
    """
    deltas = np.diff(np.sort(np.asarray(ginis, dtype=np.float64)))
    if len(deltas) == 0 or (deltas <= epsilon).any():
        return NO_PATTERN
    return float(deltas.sum() - unevenness_weight * deltas.var())


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
    """Closeness of the sorted values to 1, 2, ..., n (Alg. 4, Eq. 4.4), in [0, 1]; for two values or more."""
    ordered = np.sort(np.asarray(values, dtype=np.float64))
    pattern = np.arange(1, len(ordered) + 1)
    distance, farthest = np.linalg.norm(ordered - pattern), np.linalg.norm(len(ordered) - pattern)
    return max(1.0 - float(distance / farthest), 0.0)


def partial_pattern_score(values: Sequence[float]) -> float:
    """Pattern fitness of some cluster scores (Alg. 4), in [0, 1].

    Fewer than two values give 0; two are judged by their distance (1 or more is best), because
    the maps between or beyond them may only be missing.
    """
    if len(values) < 2:
        return 0.0
    if len(values) == 2:
        return float(min(abs(values[0] - values[1]), 1.0))
    return pattern_score(values)


def calibrate_scale(times_of_maps: Sequence[Times]) -> float:
    """Scale of Alg. 3 from driven maps: the median gap between two controllers on the same map.

    The median, because single failures make long gaps (thesis, section 5.1).

    Raises:
        RunError: If there is no gap, or the median gap is zero.
    """
    gaps = [gap for times in times_of_maps for gap in pairwise_gaps(times)]
    scale = float(np.median(gaps)) if gaps else 0.0
    if scale <= 0.0:
        found = f"a median gap of 0 over {len(gaps)} pairs" if gaps else "no map that all controllers solved"
        raise RunError(f"cluster_scale: cannot be calibrated from the first population ({found}); give a value")
    return scale


@dataclass(frozen=True)
class FitnessBreakdown:
    """The fitness of one map set and what it is made of.

    Args:
        total: f of Eq. 4.5; smaller is better.
        success_rate: s: successful runs / all runs.
        timeouts: t: timed-out runs per repeat.
        pattern: What Alg. 2 or Alg. 4 returned; greater is better.
        readings: Gini coefficient or cluster score of each map, None where the map has no value.
        values: For each map the aggregated value of each controller, None where the map has no value.
    """

    total: float
    success_rate: float
    timeouts: float
    pattern: float
    readings: tuple[float | None, ...]
    values: tuple[tuple[float, ...] | None, ...]


@dataclass(frozen=True)
class Fitness:
    """Results of one map set -> fitness, minimised (Eq. 4.5): ``C_b (1 - s) + C_t t - w_p pattern s``.

    Alg. 2's -1000 enters negated like every pattern value: two equal Gini coefficients, or fewer
    than two maps with a value, cost ``w_p * 1000 * s`` (20 000 with the defaults and all runs
    successful), far more than the 100 of a set on which every run failed. As in the thesis, such
    sets are thus ranked *worse the more of their runs succeed*; they die out as soon as sets with
    two different maps exist. Alg. 4 has no such jump: without a pattern it returns 0.

    Args:
        settings: Costs, weights, and the rules for repeats and failures.
        time_limit: Simulated seconds after which a run is a timeout.
        cluster_scale: Scale of Alg. 3; None until :meth:`calibrated`.
    """

    settings: EvolveSettings
    time_limit: float
    cluster_scale: float | None = None

    @classmethod
    def of(cls, settings: EvolveSettings, time_limit: float) -> Fitness:
        """Build from the options of a search."""
        return cls(settings, time_limit, settings.cluster_scale)

    @property
    def needs_scale(self) -> bool:
        """Whether results must be seen first."""
        return self.settings.fitness == "cluster" and self.cluster_scale is None

    def calibrated(self, results: Sequence[SetResults]) -> Fitness:
        """Return a fitness whose cluster scale fits these results; itself if it needs none.

        Raises:
            RunError: If the results do not give a scale.
        """
        if not self.needs_scale:
            return self
        times = [times for one in results for times in map(self.values_of, one) if times is not None]
        return replace(self, cluster_scale=calibrate_scale(times))

    def __call__(self, results: SetResults) -> FitnessBreakdown:
        """Judge one map set."""
        options = self.settings
        runs = [run for of_map in results for of_controller in of_map for run in of_controller]
        repeats = len(results[0][0])
        success_rate = sum(run.success for run in runs) / len(runs)
        timeouts = sum(run.outcome in options.timeout_outcomes for run in runs) / repeats
        values = tuple(self.values_of(of_map) for of_map in results)
        readings = tuple(None if times is None else self.reading(times) for times in values)
        pattern = self.pattern([reading for reading in readings if reading is not None])
        total = options.base_cost * (1.0 - success_rate) + options.timeout_cost * timeouts
        total -= options.pattern_weight * pattern * success_rate
        return FitnessBreakdown(total, success_rate, timeouts, pattern, readings, values)

    def values_of(self, of_map: Sequence[Sequence[RunResult]]) -> tuple[float, ...] | None:
        """Aggregate ``of_map[controller][repeat]`` to one value per controller; None if the map is excluded."""
        if self.settings.failures == "exclude" and not all(run.success for runs in of_map for run in runs):
            return None
        aggregate = AGGREGATES[self.settings.aggregate]
        return tuple(aggregate([self._value(run) for run in runs]) for runs in of_map)

    def reading(self, times: Times) -> float:
        """Gini coefficient or cluster score of one map.

        Raises:
            ConfigError: If the cluster scale is not known yet.
        """
        if self.settings.fitness == "gini":
            return gini(times)
        if self.cluster_scale is None:
            raise ConfigError("cluster_scale: expected a value, or results to calibrate it from, got neither")
        return cluster_score(times, self.cluster_scale)

    def pattern(self, readings: Sequence[float]) -> float:
        """Pattern fitness of the maps' readings."""
        if self.settings.fitness == "gini":
            return gini_fitness(readings, self.settings.epsilon, self.settings.unevenness_weight)
        return partial_pattern_score(readings)

    def _value(self, run: RunResult) -> float:
        if run.success:
            return run.value(self.settings.metric)
        return self.time_limit * (2.0 if self.settings.failures == "par2" else 1.0)
