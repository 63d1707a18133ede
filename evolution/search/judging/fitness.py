"""What makes a good map set: the pattern in its readings, minus the cost of failures.

Source: thesis, sections 4.1.8 to 4.1.12. Patterns (:mod:`evolution.search.judging.patterns`) are maximised;
:class:`Fitness` negates them and is minimised.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from statistics import fmean, median

import numpy as np

from evolution.driving import RunResult, SetResults
from evolution.search.judging.patterns import FITNESSES, Pattern, Times, held_apart, pairwise_gaps
from evolution.search.settings import EvolveSettings
from gym_mapbench.errors import PluginError, RunError

MapResults = tuple[tuple[RunResult, ...], ...]
"""Results of one map: ``results[controller][repeat]``."""

AGGREGATES: dict[str, Callable[[list[float]], float]] = {"mean": fmean, "median": median}


def calibrate_scale(times_of_maps: Sequence[Times]) -> float:
    """Return the scale of Alg. 3: the median gap between two controllers on the same map, over driven maps.

    It is the median because single failures make long gaps (thesis, section 5.1).

    Raises:
        RunError: If there is no gap, or the median gap is zero.
    """
    gaps = [gap for times in times_of_maps for gap in pairwise_gaps(times)]
    scale = float(np.median(gaps)) if gaps else 0.0
    if scale <= 0.0:
        found = f"a median gap of 0 over {len(gaps)} pairs" if gaps else "no map that all controllers solved"
        raise RunError(f"cluster_scale: cannot be calibrated from the first population ({found}); give a value")
    return scale


def repeats_of(of_map: Sequence[Sequence[RunResult]]) -> int:
    """Return how often a map was driven: by the controller that drove it most."""
    return max(map(len, of_map))


def is_solved(of_map: Sequence[Sequence[RunResult]]) -> bool:
    """Whether all controllers reached the goal whenever the map was driven, and none was left out."""
    repeats = repeats_of(of_map)
    return all(len(runs) == repeats and all(run.success for run in runs) for runs in of_map)


def order_of(readings: Sequence[float | None]) -> tuple[int, ...] | None:
    """Return the places of the maps in order of their readings, the smallest first; None if a map has no reading."""
    known = [reading for reading in readings if reading is not None]
    return tuple(int(place) for place in np.argsort(known, kind="stable")) if len(known) == len(readings) else None


def _cautious(readings: Sequence[float | None], spreads: Sequence[float]) -> list[float]:
    """Return the readings there are; the smallest is raised, and the largest lowered, by the spread of its map."""
    read = [(reading, spread) for reading, spread in zip(readings, spreads, strict=True) if reading is not None]
    counted = [reading for reading, _ in read]
    if len(read) < 2:
        return counted
    order = sorted(range(len(read)), key=counted.__getitem__)
    counted[order[0]] += read[order[0]][1]
    counted[order[-1]] -= read[order[-1]][1]
    for place, reading in zip(order, held_apart([counted[place] for place in order]), strict=True):
        counted[place] = reading
    return counted


@dataclass(frozen=True)
class FitnessBreakdown:
    """The fitness of one map set and its parts.

    Args:
        total: f of Eq. 4.5; smaller is better.
        success_rate: s: successful runs / all runs.
        timeouts: t: timed-out runs per repeat.
        pattern: How good the readings are together; greater is better.
        readings: The reading of each map, e.g. its Gini coefficient; None where the map has no value.
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
    """Turns the results of one map set into a fitness to minimise (Eq. 4.5): ``C_b (1 - s) + C_t t - w_p pattern s``.

    The -1000 of Alg. 2 enters negated, as every pattern value does: two equal Gini coefficients, or fewer
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

    @cached_property
    def kind(self) -> Pattern:
        """The pattern, which reads maps and judges their readings."""
        return FITNESSES.get(self.settings.fitness)(self.settings, self.cluster_scale)

    @property
    def needs_scale(self) -> bool:
        """Whether it must be calibrated with results first."""
        return self.kind.needs_scale and self.cluster_scale is None

    def calibrated(self, results: Sequence[SetResults]) -> Fitness:
        """Return a fitness with a cluster scale calibrated from these results; itself if it needs none.

        Raises:
            RunError: If the results do not give a scale.
        """
        if not self.needs_scale:
            return self
        times = [times for one in results for times in map(self.values_of, one) if times is not None]
        return replace(self, cluster_scale=calibrate_scale(times))

    def __call__(self, results: SetResults) -> FitnessBreakdown:
        """Judge one map set.

        Args:
            results: ``results[map][controller][repeat]``. Maps may have been driven differently often; a controller
                with fewer runs on a map than another has failed the missing ones.

        Raises:
            ConfigError: If the scale is not known yet.
            PluginError: If a third-party fitness fails, or returns anything but finite numbers.
        """
        options = self.settings
        planned = sum(len(of_map) * repeats_of(of_map) for of_map in results)
        runs = [run for of_map in results for of_controller in of_map for run in of_controller]
        success_rate = sum(run.success for run in runs) / planned
        timeouts = sum(self._timeouts(of_map) / repeats_of(of_map) for of_map in results)
        values = tuple(self.values_of(of_map) for of_map in results)
        readings, pattern = self.pattern_of(values, [self.spread_of(of_map) for of_map in results])
        total = options.base_cost * (1.0 - success_rate) + options.timeout_cost * timeouts
        total -= options.pattern_weight * pattern * success_rate
        return FitnessBreakdown(total, success_rate, timeouts, pattern, readings, values)

    def values_of(self, of_map: Sequence[Sequence[RunResult]]) -> tuple[float, ...] | None:
        """Aggregate ``of_map[controller][repeat]`` to one value per controller; None if the map is excluded."""
        if self.settings.failures == "exclude" and not is_solved(of_map):
            return None
        aggregate = AGGREGATES[self.settings.aggregate]
        return tuple(aggregate([self._value(run) for run in runs]) for runs in of_map)

    def spread_of(self, of_map: Sequence[Sequence[RunResult]]) -> float:
        """Return by how much an extreme reading of a map counts as less extreme.

        That is ``caution`` times the standard deviation of the readings of its repeats, 0 for a single one or a map
        that was not always solved.
        """
        repeats = repeats_of(of_map)
        if not self.settings.caution or repeats == 1 or not is_solved(of_map):
            return 0.0
        singles = [[self._value(runs[repeat]) for runs in of_map] for repeat in range(repeats)]
        return self.settings.caution * float(np.std([self.kind.read(times) for times in singles], ddof=1))

    def pattern_of(
        self, values: Sequence[Times | None], spreads: Sequence[float]
    ) -> tuple[tuple[float | None, ...], float]:
        """Read the maps that have values, and judge their readings.

        Args:
            values: For each map the aggregated value of each controller; None where the map has no value.
            spreads: By how much the reading of each map counts as less extreme.

        Returns:
            The reading of each map, and their pattern.

        Raises:
            PluginError: If a third-party fitness fails, or returns anything but finite numbers.
        """
        with FITNESSES.blamed(self.settings.fitness):
            readings = tuple(None if times is None else float(self.kind.read(times)) for times in values)
            read = _cautious(readings, spreads)
            pattern = float(self.kind.judge(read, [times for times in values if times is not None]))
        if not np.isfinite([*read, pattern]).all():
            raise PluginError(f"fitness {self.settings.fitness!r}: expected finite numbers, got {read} and {pattern}")
        return readings, pattern

    def _timeouts(self, of_map: Sequence[Sequence[RunResult]]) -> int:
        return sum(run.outcome in self.settings.timeout_outcomes for runs in of_map for run in runs)

    def _value(self, run: RunResult) -> float:
        if run.success:
            return run.value(self.settings.metric)
        return self.time_limit * (2.0 if self.settings.failures == "par2" else 1.0)


def readings_of(of_map: MapResults, fitness: Fitness) -> list[float]:
    """Return the reading of each repeat of a map; repeats without one are left out."""
    singles = [fitness((one,)).readings[0] for one in singles_of(of_map)]
    return [reading for reading in singles if reading is not None]


def singles_of(of_map: MapResults) -> list[MapResults]:
    """Return each repeat of a map alone."""
    return [tuple(runs[number : number + 1] for runs in of_map) for number in range(repeats_of(of_map))]
