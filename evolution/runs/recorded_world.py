"""The world of a recorded run as its file states it: to compare and judge by, not to drive in, so no code is run."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Self

from pydantic import ConfigDict, Field, FiniteFloat

from evolution.files import Document, check
from evolution.search import Experiment, experiment_of
from gym_mapbench.errors import ConfigError, RunError
from gym_mapbench.world.robot import RobotSpec


class _Environment(Document):
    """The option of the env that is used, among all others: simulated seconds until a run is a timeout."""

    model_config = ConfigDict(extra="allow")

    time_limit: Annotated[FiniteFloat, Field(gt=0)]


class RecordedWorld(Document):
    """World, robot and navigation of recorded runs; nothing in it is looked up by its name."""

    model_config = ConfigDict(extra="allow")

    environment: _Environment

    @classmethod
    def from_mapping(cls, values: object, where: str) -> Self:
        """Build from the section ``run`` of an experiment.

        Raises:
            ConfigError: If it has no time limit.
        """
        try:
            check(cls, values, where)
        except RunError as error:
            raise ConfigError(str(error)) from None
        return cls.model_validate(values)

    @property
    def time_limit(self) -> float:
        """Simulated seconds after which a run is a timeout."""
        return self.environment.time_limit

    @property
    def robot(self) -> RobotSpec:
        """The robot that drove; raises ``ConfigError`` if it is recorded by name only."""
        return RobotSpec.from_mapping(self.environment.model_dump().get("robot"), "robot")


def recorded_experiment(document: Mapping[str, Any], where: str) -> Experiment:
    """Build an experiment to look at from a recorded document; it cannot be driven.

    Args:
        document: As :meth:`~evolution.search.Experiment.document` returned it.
        where: Beginning of every error message.

    Raises:
        ConfigError: If a part is missing or does not fit.
    """
    return experiment_of(document, where, RecordedWorld)
