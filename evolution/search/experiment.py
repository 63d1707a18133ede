"""The experiment of a search: its options, the compared controllers, and the world they drive in."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Self

from evolution.driving import ControllerSpec, DriveSettings, JobPlan, check_controllers
from evolution.search.judging import Fitness
from evolution.search.operators import DrawMap, MapSampling, Mutator
from evolution.search.settings import EvolveSettings
from gym_mapbench.errors import ConfigError
from gym_mapbench.generator import draw_from, sample_map


@dataclass(frozen=True)
class Experiment:
    """Everything that defines one search: its options, the compared controllers, and the world they drive in.

    Raises:
        ConfigError: If there is no controller, a name occurs twice, the fitness means nothing for so few controllers,
            or the runs allowed are fewer than the least that are needed.
    """

    search: EvolveSettings
    controllers: tuple[ControllerSpec, ...]
    run: DriveSettings

    def __post_init__(self) -> None:
        object.__setattr__(self, "controllers", tuple(self.controllers))
        check_controllers(self.controllers)
        self.search.check(len(self.controllers))

    @classmethod
    def from_document(cls, document: object, where: str) -> Self:
        """Read what :meth:`document` returned.

        Args:
            document: A mapping with (at least) ``search``, ``controllers`` and ``run``.
            where: Beginning of every error message.

        Raises:
            ConfigError: If a part is missing or does not fit.
        """
        if not isinstance(document, Mapping) or not {"search", "controllers", "run"} <= set(document):
            raise ConfigError(f"{where}: expected the keys search, controllers and run")
        if not isinstance(document["controllers"], Sequence):
            raise ConfigError(f"{where}: controllers: expected a list, got {type(document['controllers']).__name__}")
        return cls(
            EvolveSettings.from_mapping(document["search"], f"{where}: search"),
            tuple(ControllerSpec.from_mapping(spec, f"{where}: controllers") for spec in document["controllers"]),
            DriveSettings.from_mapping(document["run"], f"{where}: run"),
        )

    @property
    def plan(self) -> JobPlan:
        """Which runs a scenario needs, and what is measured on them."""
        search = self.search
        return JobPlan(self.controllers, self.run, search.seed, search.repeats, search.judging.metrics)

    @property
    def fitness(self) -> Fitness:
        """The fitness that judges map sets; a cluster fitness may have to be calibrated first."""
        return Fitness.of(self.search.judging, self.run.time_limit)

    @property
    def sampling(self) -> MapSampling:
        """The operator that samples new maps, of the families of the search, or of random shapes if there are none."""
        search = self.search
        return MapSampling(search.maps_per_set, search.shapes, self._draw_map, search.people)

    @property
    def mutator(self) -> Mutator:
        """The operator that changes a map."""
        search = self.search
        return Mutator(search.shapes, search.ga.mutation, self.run.robot, search.families, search.people)

    @property
    def _draw_map(self) -> DrawMap:
        families = self.search.families
        return (lambda rng, shapes: draw_from(rng, families, shapes, self.run.robot)) if families else sample_map

    def document(self) -> dict[str, Any]:
        """Return everything as JSON-able values, under ``search``, ``controllers`` and ``run``."""
        return {
            "search": self.search.model_dump(mode="json"),
            "controllers": [spec.model_dump(mode="json") for spec in self.controllers],
            "run": self.run.model_dump(mode="json"),
        }
