"""The options of judging: how the results of a map set become its fitness."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, ClassVar, Literal, Self

from pydantic import AfterValidator, field_validator, model_validator

from evolution.driving import check_metric
from evolution.search.judging.failures import FAILURES, FailurePolicy
from evolution.search.judging.patterns import FITNESSES, Pattern, PatternSettings
from gym_mapbench.errors import ConfigError
from gym_mapbench.metrics import MORE_IS_BETTER
from gym_mapbench.metrics.episode import Outcome
from gym_mapbench.metrics.map_metrics import n_obstacles, occupied_share
from gym_mapbench.quantities import NonNegative, Positive
from gym_mapbench.registry import Registry
from gym_mapbench.settings import ExtendedSettings, OptionError
from gym_mapbench.world.gridmap import GridMap

MAP_MEASURES: dict[str, Callable[[GridMap], float]] = {"n_obstacles": n_obstacles, "occupied_share": occupied_share}
"""Measures of maps that a search can minimise, by name."""


def _in(registry: Registry[type]) -> AfterValidator:
    """Return a validator that refuses names a registry does not have."""

    def check(name: str) -> str:
        registry.get(name)
        return name

    return AfterValidator(check)


FitnessName = Annotated[str, _in(FITNESSES)]
FailureName = Annotated[str, _in(FAILURES)]


class JudgingSettings(PatternSettings, ExtendedSettings):
    """How the results of a map set become its fitness (thesis, sections 4.1.8 to 4.1.12).

    Args:
        fitness: ``gini`` (Alg. 1 and 2), ``cluster`` (Alg. 3 and 4), ``roles``, ``pairs``, ``regret``, or a third-party
            fitness (see :mod:`evolution.search.judging.patterns`).
        objectives: What is minimised besides the fitness: ``n_obstacles`` or ``occupied_share``, in the mean over the
            maps of a set; or a metric, by which the fitness is computed once more. Needs an algorithm for several
            objectives, such as ``nsga2``; then a set must be solved, and have a fitness of 0 or less.
        metric: Quantity compared between controllers: one of ``METRIC_NAMES``, or a third-party metric.
        aggregate: How the repeats of a controller on a map become one value.
        failures: What a failed run counts: ``exclude`` (its map has no value, as in the thesis), ``censor`` (the time
            limit), ``par2`` (twice the time limit), or a third-party failure policy
            (see :mod:`evolution.search.judging.failures`).
        timeout_outcomes: Outcomes that count as timeouts in Eq. 4.5.
        caution: Standard deviations of single runs by which the extreme scores of a set count as less extreme, where
            its maps have several runs; for fitnesses that judge by scores. Scores that meet so count as equal: with
            ``gini`` such a set has no pattern (Alg. 2), though its maps may have different scores.
        base_cost: C_b of Eq. 4.5.
        timeout_cost: C_t of Eq. 4.5.
        pattern_weight: w_p of Eq. 4.5.
        cluster_scale: Scale of Alg. 3, in units of ``metric``; if None, the median gap over the first population.
        epsilon: Smallest difference between two Gini coefficients (Alg. 2).
        unevenness_weight: lambda of Alg. 2.
    """

    newer: ClassVar[tuple[str, ...]] = ("objectives",)

    fitness: FitnessName = "gini"
    objectives: tuple[str, ...] = ()
    metric: str = "time"
    aggregate: Literal["mean", "median"] = "mean"
    failures: FailureName = "exclude"
    timeout_outcomes: tuple[Outcome, ...] = ("timeout",)
    caution: NonNegative = 0.0
    base_cost: NonNegative = 100.0
    timeout_cost: NonNegative = 10.0
    pattern_weight: NonNegative = 20.0
    cluster_scale: Positive | None = None

    @field_validator("objectives")
    @classmethod
    def _known_objectives(cls, value: tuple[str, ...]) -> tuple[str, ...]:
        for name in value:
            if name not in MAP_MEASURES:
                check_metric(name)
        if len(set(value)) < len(value):
            raise ConfigError(f"expected different names, got {', '.join(value)}")
        return value

    @property
    def metrics(self) -> tuple[str, ...]:
        """The metric, and those among the objectives."""
        return (self.metric, *(name for name in self.objectives if name not in MAP_MEASURES))

    @field_validator("metric")
    @classmethod
    def _known(cls, value: str) -> str:
        return check_metric(value)

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        policy, name = self.policy, self.failures
        for metric in self.metrics:
            if policy.metric not in (None, metric):
                raise OptionError(
                    "failures", f"expected 'exclude' with metric {metric!r} ({name} counts in {policy.metric})"
                )
        if self.metric in self.objectives:
            raise OptionError("objectives", f"expected other metrics than that of the fitness, got {self.metric}")
        pattern = self.pattern
        if pattern.needs_scale and len(self.metrics) > 1:
            raise OptionError("objectives", f"expected measures of maps with fitness {self.fitness!r}, got a metric")
        for metric in self.metrics:
            if pattern.less_is_better and metric in MORE_IS_BETTER:
                option = "metric" if metric == self.metric else "objectives"
                raise OptionError(
                    option, f"expected one of which less is better with fitness {self.fitness!r}, got {metric!r}"
                )
        if pattern.solved_only and not policy.excludes:
            raise OptionError(
                "failures", f"expected 'exclude' with fitness {self.fitness!r}, got {name!r}: it makes failures equal"
            )
        return self

    @property
    def pattern(self) -> type[Pattern]:
        """The pattern of the fitness."""
        return FITNESSES.get(self.fitness)

    @property
    def policy(self) -> FailurePolicy:
        """The failure policy."""
        with FAILURES.blamed(self.failures):
            return FAILURES.get(self.failures)()
