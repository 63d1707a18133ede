"""Settings of a sweep: maps, controllers, and worlds that differ in a few options, read from YAML."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from pydantic import Field, field_validator

from evolution.driving import ControllerSpec, DriveSettings, JobPlan
from evolution.search import DEFAULT_CONTROLLERS, controllers_from
from evolution.studies.settings import Document, Name
from gym_mapbench.env.scenario_source import draw_scenarios
from gym_mapbench.errors import ConfigError
from gym_mapbench.quantities import Few, Natural
from gym_mapbench.ros_params import overlay
from gym_mapbench.settings import Settings
from gym_mapbench.world.scenario import Scenario


class SweepSettings(Settings):
    """All options of a sweep.

    Args:
        name: Name of the sweep.
        maps: Number of random maps; they are sampled for the robot of the first world.
        seed: Root of all randomness, of the maps and of every run.
        repeats: Runs of each controller on each map in each world, each with a seed of its own.
        controllers: The controllers: names, or mappings with ``name``, ``kind`` and ``params``.
        run: The world and the navigation of all runs, like the section ``run`` of an experiment.
        worlds: By name, what each world changes in ``run``; the others are compared with the first.
    """

    name: Name
    maps: Annotated[int, Field(ge=1, le=100_000)] = 200
    seed: Natural = 0
    repeats: Few = 1
    controllers: tuple[str | Document, ...] = DEFAULT_CONTROLLERS
    run: Document = Field(default_factory=dict)
    worlds: dict[Name, Document]

    @field_validator("worlds")
    @classmethod
    def _several(cls, value: dict[str, Document]) -> dict[str, Document]:
        if len(value) < 2:
            raise ConfigError(f"expected two worlds or more to compare, got {len(value)}")
        return value

    @property
    def specs(self) -> tuple[ControllerSpec, ...]:
        """The controllers."""
        return controllers_from(list(self.controllers))

    def world(self, name: str) -> DriveSettings:
        """Return one of the worlds.

        Raises:
            ConfigError: If an option of it cannot be used, naming the world.
        """
        document: dict[str, Any] = overlay({"navigation": "thesis", **self.run}, self.worlds[name])
        return DriveSettings.from_mapping(document, f"{self.name}: {name}")

    def plan(self, name: str) -> JobPlan:
        """Return which runs a scenario needs in one of the worlds; the seeds are the same in all worlds."""
        return JobPlan(self.specs, self.world(name), self.seed, self.repeats)

    def scenarios(self) -> list[Scenario]:
        """Return the sampled maps; fewer maps are the first of the same sequence."""
        environment = self.world(next(iter(self.worlds))).environment
        return draw_scenarios(environment, np.random.default_rng(self.seed), self.maps)
