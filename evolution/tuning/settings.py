"""TuneSettings: all options of a tuning that its result depends on, besides maps, world and search space."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field, model_validator

from evolution.files import counted
from evolution.tuning.objectives import OBJECTIVES, read_requirement
from gym_mapbench.errors import ConfigError, refuse_unknown
from gym_mapbench.generator import FamilySpecs
from gym_mapbench.quantities import Count, Few, Fraction, Natural
from gym_mapbench.settings import ExtendedSettings, Settings


class AgainstSettings(Settings):
    """Options of a tuning against evolved maps.

    Args:
        rounds: Rounds of searching for values; after each but the last, maps are evolved against the best values.
        maps: Most maps that join the training maps after a round, for good.
        evaluations: Maps evaluated in an evolution, each with the tuned and with another controller.
        pop_size: Maps in its population.
        families: Families that new maps are sampled from; if empty, those without a route.
    """

    rounds: Annotated[int, Field(ge=2, le=100)] = 3
    maps: Count = 4
    evaluations: Annotated[int, Field(ge=2, le=100_000)] = 40
    pop_size: Annotated[int, Field(ge=2, le=10_000)] = 10
    families: FamilySpecs = ()


class TuneSettings(ExtendedSettings):
    """Options of a tuning.

    Args:
        trials: Number of trials, the user's own values included.
        runs: The search begins no further batch after so many runs, shared equally by its rounds; None for no limit.
        objectives: What is minimised, by name; several give a Pareto front.
        requirements: Conditions such as ``clearance>=0.1``, over the runs of a trial.
        sampler: How values are sampled: ``tpe`` (tree-structured Parzen estimator) or ``random``.
        seed: Root of all randomness.
        batch: Trials that are sampled at the same time; the result does not depend on the number of workers.
        step: Maps that a trial runs on between two decisions to stop it.
        stop_p: A trial stops where the Wilcoxon test against the best trial gives a smaller p-value; 0 for never.
        finalists: Number of the best trials that are re-run on all training maps with held-out seeds.
        validation_repeats: Runs of each of them on each training map.
        test_repeats: Runs on each test map.
        against: Options of the rounds with evolved maps; None for none.
    """

    newer: ClassVar[tuple[str, ...]] = ("against",)

    trials: Few = 100
    runs: Count | None = None
    objectives: Annotated[tuple[str, ...], Field(min_length=1)] = ("time",)
    requirements: tuple[str, ...] = ()
    sampler: Literal["tpe", "random"] = "tpe"
    seed: Natural = 0
    batch: Count = 4
    step: Count = 4
    stop_p: Fraction = 0.1
    finalists: Count = 5
    validation_repeats: Count = 2
    test_repeats: Count = 2
    against: AgainstSettings | None = None

    @model_validator(mode="after")
    def _known(self) -> Self:
        for name in self.objectives:
            refuse_unknown("objective", name, OBJECTIVES)
        if len(set(self.objectives)) < len(self.objectives):
            raise ConfigError("objectives: expected different names, got one twice")
        if self.against and self.trials < self.against.rounds:
            raise ConfigError(
                f"trials: expected one or more for each of {counted(self.against.rounds, 'round')}, got {self.trials}"
            )
        for text in self.requirements:
            read_requirement(text)
        return self
