"""RecordedExperiment: the experiment of a recorded run, to compare and to judge; no name in it is looked up."""

from __future__ import annotations

from collections.abc import Mapping
from copy import deepcopy
from dataclasses import dataclass
from typing import Annotated, Any, Self

from pydantic import Field, FiniteFloat

from evolution.files import Document, check
from evolution.search import EvolveSettings, Experiment, Fitness, controllers_from


class _Environment(Document):
    """The option of the env that is used: simulated seconds until a run is a timeout."""

    time_limit: Annotated[FiniteFloat, Field(gt=0)]


class _World(Document):
    """The part of a recorded world that is used."""

    environment: _Environment


@dataclass(frozen=True)
class RecordedExperiment:
    """The experiment of a recorded run; code that it names is not run.

    Args:
        search: Options of the search.
        controllers: The compared controllers, as JSON-able values.
        world: World, robot and navigation of the runs, as JSON-able values.
    """

    search: EvolveSettings
    controllers: tuple[Mapping[str, Any], ...]
    world: Mapping[str, Any]

    @classmethod
    def of(cls, experiment: Experiment) -> Self:
        """Return an experiment as a run records it."""
        document = experiment.document()
        return cls(experiment.search, tuple(document["controllers"]), document["run"])

    @classmethod
    def read(cls, document: Mapping[str, Any], where: str) -> Self:
        """Read a recorded document.

        Args:
            document: As :meth:`~evolution.search.Experiment.document` returned it.
            where: Beginning of every error message.

        Raises:
            ConfigError: If the search or a controller cannot be used.
            RunError: If the world has no time limit.
        """
        check(_World, document["run"], f"{where}: run")
        search = EvolveSettings.from_mapping(document["search"], f"{where}: search")
        controllers = [spec.model_dump(mode="json") for spec in controllers_from(document["controllers"])]
        return cls(search, tuple(controllers), document["run"])

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the controllers, in order."""
        return tuple(spec["name"] for spec in self.controllers)

    def fitness(self, cluster_scale: float | None) -> Fitness:
        """Return the fitness of the search, with the cluster scale that it ended with."""
        return Fitness(self.search.judging, self.world["environment"]["time_limit"], cluster_scale)

    def document(self) -> dict[str, Any]:
        """Return a copy of everything as JSON-able values, under ``search``, ``controllers`` and ``run``."""
        return {
            "search": self.search.model_dump(mode="json"),
            "controllers": deepcopy(list(self.controllers)),
            "run": deepcopy(dict(self.world)),
        }
