"""The fitness of a map set: the pattern in the scores of its maps, minus the cost of failures.

Source: thesis, sections 4.1.8 to 4.1.12. Patterns (:mod:`evolution.search.judging.patterns`) are maximised. The
objectives that :class:`Fitness` returns are minimised.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from numbers import Real
from statistics import fmean, median

import numpy as np

from evolution.driving import RunResult, SetResults
from evolution.files import counted
from evolution.search.judging.equation import gain, penalty
from evolution.search.judging.failures import FAILURES, FailurePolicy
from evolution.search.judging.judgement import JudgedMap, Judgement
from evolution.search.judging.map_results import (
    MapResults,
    is_solved,
    missing_runs,
    repeats_of,
    singles_of,
    solved_trials,
    successes_of,
    sum_over_trials,
)
from evolution.search.judging.patterns import FITNESSES, Parts, Pattern, Times, held_apart, pairwise_gaps
from evolution.search.judging.settings import JudgingSettings
from gym_mapbench.errors import ConfigError, PluginError, RunError

AGGREGATES: dict[str, Callable[[list[float]], float]] = {"mean": fmean, "median": median}


@dataclass(frozen=True)
class Fitness:
    """Judges map sets: a function from the results of a set to its :class:`Judgement`.

    Args:
        settings: Costs, weights, and the rules for repeats and failures.
        time_limit: Simulated seconds after which a run is a timeout.
        cluster_scale: Scale of Alg. 3; None until :meth:`calibrated`.
    """

    settings: JudgingSettings
    time_limit: float
    cluster_scale: float | None = None

    @classmethod
    def of(cls, settings: JudgingSettings, time_limit: float) -> Fitness:
        """Build from the options of judging."""
        return cls(settings, time_limit, settings.cluster_scale)

    @cached_property
    def kind(self) -> Pattern:
        """The pattern, which scores maps and judges their scores."""
        with FITNESSES.blamed(self.settings.fitness):
            return self.settings.pattern(self.settings, self.cluster_scale)

    @cached_property
    def policy(self) -> FailurePolicy:
        """The failure policy."""
        return self.settings.policy

    @property
    def objectives(self) -> tuple[str, ...]:
        """Names of the objectives."""
        return self.kind.objectives

    @property
    def constraints(self) -> tuple[str, ...]:
        """Names of the constraints."""
        return self.kind.constraints

    @property
    def exact(self) -> bool:
        """Whether the exact best set can be found: for one objective, the fitness of Eq. 4.5."""
        return self.kind.exact and self.objectives == Pattern.objectives and not self.constraints

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

    def with_failures(self, name: str) -> Fitness | None:
        """Return the same fitness with another failure policy; None where they do not go together."""
        try:
            return replace(self, settings=self.settings.replace(failures=name))
        except ConfigError:
            return None

    def __call__(self, results: SetResults) -> Judgement:
        """Judge one map set.

        Args:
            results: ``results[map][controller][repeat]``. Maps may have different numbers of repeats, by which they
                count in the success rate. Controllers may have different numbers of runs on a map; they count alike. A
                controller without a run on a map has failed there.

        Raises:
            ConfigError: If the scale is not known yet.
            PluginError: If a third-party fitness or failure policy fails, or returns anything but finite numbers.
        """
        return self.judge([self.judge_map(of_map) for of_map in results])

    def judge_map(self, of_map: MapResults) -> JudgedMap:
        """Judge one map: what it contributes to any set.

        Args:
            of_map: ``results[controller][repeat]`` of the map.

        Raises:
            ConfigError: If the scale is not known yet.
            PluginError: As for a set.
        """
        values, repeats = self.values_of(of_map), repeats_of(of_map)
        return JudgedMap(
            score=None if values is None else self.score_of(values),
            values=values,
            successes=successes_of(of_map),
            runs=len(of_map) * repeats,
            timeouts=self._timeouts(of_map) / repeats,
            spread=self.spread_of(of_map),
        )

    def judge(self, maps: Sequence[JudgedMap]) -> Judgement:
        """Judge one map set by what its maps contribute.

        Raises:
            PluginError: If a third-party fitness fails, or returns anything but finite numbers.
        """
        success_rate = sum(one.successes for one in maps) / sum(one.runs for one in maps)
        timeouts = sum(one.timeouts for one in maps)
        scores, values = tuple(one.score for one in maps), tuple(one.values for one in maps)
        pattern = self.pattern_of(scores, values, [one.spread for one in maps])
        parts = Parts(
            penalty(self.settings, success_rate, timeouts),
            gain(self.settings, pattern, success_rate),
            success_rate,
            timeouts,
            pattern,
        )
        return self._judgement(parts, scores, values)

    @property
    def reads_failures(self) -> bool:
        """Whether the runs of a map with a failed run count for more than the success rate and the timeouts of Eq. 4.5.

        Then no run may be left out, because :meth:`bound` is unknown.
        """
        of_equation = type(self.kind).objectives_of is Pattern.objectives_of and not self.constraints
        return not (self.policy.excludes and of_equation)

    def bound(self, results: SetResults) -> float:
        """Return the smallest fitness that a set can have with its missing runs.

        Eq. 4.5 is linear in the success rate and rises with the timeouts. The smallest value is therefore at one of the
        ends: all missing runs fail, or all reach the goal.

        Args:
            results: Results of a set; all its maps with missing runs have a failed run.
        """
        maps = [self.judge_map(of_map) for of_map in results]
        judged = self.judge(maps)
        most = (sum(one.successes for one in maps) + missing_runs(results)) / sum(one.runs for one in maps)
        best = penalty(self.settings, most, judged.timeouts) - gain(self.settings, judged.pattern, most)
        return min(judged.fitness, best)

    def _judgement(
        self, parts: Parts, scores: tuple[float | None, ...], values: tuple[tuple[float, ...] | None, ...]
    ) -> Judgement:
        """Let the pattern say what the objectives and constraints are."""
        with FITNESSES.blamed(self.settings.fitness):
            objectives = tuple(float(one) for one in self.kind.objectives_of(parts))
            constraints = tuple(float(one) for one in self.kind.constraints_of(parts))
        wanted, found = (len(self.objectives), len(self.constraints)), (len(objectives), len(constraints))
        if wanted != found or not all(map(math.isfinite, (*objectives, *constraints))):
            raise PluginError(
                f"fitness {self.settings.fitness!r}: expected {wanted[0]} objectives and {wanted[1]} constraints, all "
                f"finite, got {objectives} and {constraints}"
            )
        return Judgement(objectives, parts.success_rate, parts.timeouts, parts.pattern, scores, values, constraints)

    def counted(self, of_map: MapResults) -> MapResults:
        """Return the results that a map which may fail is valued by: its solved trials, or all if failed runs count."""
        return solved_trials(of_map) if self.policy.excludes else of_map

    def values_of(self, of_map: Sequence[Sequence[RunResult]]) -> tuple[float, ...] | None:
        """Aggregate ``of_map[controller][repeat]`` to one value per controller; None if the map has no value."""
        if self.policy.excludes and not is_solved(of_map):
            return None
        return tuple(map(self.value_of, of_map))

    def value_of(self, runs: Sequence[RunResult]) -> float:
        """Aggregate the runs of one controller on one map to one value."""
        return AGGREGATES[self.settings.aggregate]([self._value(run) for run in runs])

    def spread_of(self, of_map: Sequence[Sequence[RunResult]]) -> float:
        """Return by how much an extreme score of a map counts as less extreme.

        That is ``caution`` times the standard deviation of the scores of its repeats, 0 for a single repeat or a map
        with a failed run.
        """
        if not self.settings.caution or repeats_of(of_map) == 1 or not is_solved(of_map):
            return 0.0
        singles = [[self._value(run) for (run,) in single] for single in singles_of(of_map)]
        return self.settings.caution * float(np.std([self.score_of(times) for times in singles], ddof=1))

    def score_of(self, times: Times) -> float:
        """Return the score of a map with one value for each controller.

        Raises:
            PluginError: If a third-party fitness fails, or returns anything but a finite number.
        """
        with FITNESSES.blamed(self.settings.fitness):
            return self._finite("score", self.kind.score(times))

    def pattern_of(
        self, scores: Sequence[float | None], values: Sequence[Times | None], spreads: Sequence[float]
    ) -> float:
        """Return the pattern of the scores of some maps.

        Args:
            scores: The score of each map; None where the map has no value.
            values: For each map the aggregated value of each controller; None where the map has no value.
            spreads: By how much the score of each map counts as less extreme.

        Raises:
            PluginError: If a third-party fitness fails, or returns anything but a finite number.
        """
        with FITNESSES.blamed(self.settings.fitness):
            known = [times for times in values if times is not None]
            return self._finite("pattern", self.kind.judge(_cautious(scores, spreads), known))

    def _finite(self, what: str, value: object) -> float:
        if not isinstance(value, Real) or not math.isfinite(value):
            raise PluginError(f"fitness {self.settings.fitness!r}: expected a finite {what}, got {value!r:.80}")
        return float(value)

    def _timeouts(self, of_map: Sequence[Sequence[RunResult]]) -> float:
        return sum_over_trials(of_map, lambda run: run.outcome in self.settings.timeout_outcomes)

    def _value(self, run: RunResult) -> float:
        if run.success:
            return run.value(self.settings.metric)
        with FAILURES.blamed(self.settings.failures):
            value: object = self.policy.value(run, self.time_limit)
        if not isinstance(value, Real) or not math.isfinite(value):
            raise PluginError(f"failure policy {self.settings.failures!r}: expected a finite number, got {value!r:.80}")
        return float(value)


def calibrate_scale(times_of_maps: Sequence[Times]) -> float:
    """Return the scale of Alg. 3: the median gap between two controllers on the same map.

    It is the median because single failures make long gaps (thesis, section 5.1).

    Args:
        times_of_maps: For each map the values of its controllers.

    Raises:
        RunError: If there is no gap, or the median gap is zero.
    """
    gaps = [gap for times in times_of_maps for gap in pairwise_gaps(times)]
    scale = float(np.median(gaps)) if gaps else 0.0
    if scale <= 0.0:
        found = f"a median gap of 0 over {counted(len(gaps), 'pair')}" if gaps else "no map that all controllers solved"
        raise RunError(f"judging.cluster_scale: cannot be calibrated from the first population ({found}); give a value")
    return scale


def _cautious(scores: Sequence[float | None], spreads: Sequence[float]) -> list[float]:
    """Return the known scores; the smallest is raised, and the largest lowered, by the spread of its map."""
    known = [(score, spread) for score, spread in zip(scores, spreads, strict=True) if score is not None]
    counted = [score for score, _ in known]
    if len(known) < 2:
        return counted
    order = sorted(range(len(known)), key=counted.__getitem__)
    counted[order[0]] += known[order[0]][1]
    counted[order[-1]] -= known[order[-1]][1]
    for place, score in zip(order, held_apart([counted[place] for place in order]), strict=True):
        counted[place] = score
    return counted


def scores_of(of_map: MapResults, fitness: Fitness) -> list[float]:
    """Return the score of each repeat of a map; repeats without a score are left out."""
    singles = map(fitness.values_of, singles_of(of_map))
    return [fitness.score_of(values) for values in singles if values is not None]
