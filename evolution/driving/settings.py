"""DriveSettings: world, robot and navigation of a run, with the parameter file of a user laid over it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Self

from pydantic import Field, field_validator, model_validator

from controllers.nav2_params import PRESETS, Nav2Params, NavigationParams, load_preset, read_nav2_params, robot_of
from evolution.driving.unknown_map import check_sensors
from gym_mapbench.env.config import EnvConfig, lowest_physics_hz
from gym_mapbench.errors import ConfigError
from gym_mapbench.releases import Release
from gym_mapbench.ros_params import overlay
from gym_mapbench.settings import Settings
from gym_mapbench.world.robot import RobotSpec, make_robot

UNUSED = ("maps", "start", "goal", "resolution", "family", "shapes", "observation", "action", "reward")
"""Options of the env that its other users need: controllers have other maps, and sensors and commands of their own."""


class ParameterFile(Settings):
    """A user's ``nav2_params.yaml``, and how it is read; in a config the mapping ``navigation: {params: FILE, ...}``.

    Args:
        params: The file.
        nav2: The ROS distribution; None to recognise it by the file's keys.
        define: Values of the file's placeholders, by name.
        only: The controller of the file that drives, where the one it would use is not available here.
    """

    params: str
    nav2: Release | None = None
    define: dict[str, str] = Field(default_factory=dict)
    only: str | None = None

    def load(self, folder: Path | None = None) -> NavigationParams:
        """Read the file.

        Args:
            folder: To which the names of other files in it are relative; None for its own.

        Raises:
            ConfigError: If the file cannot be used.
        """
        return read_nav2_params(
            self.params, release=self.nav2, defines=self.define, only=self.only, folder=folder
        ).navigation


class DriveSettings(Settings):
    """World, robot and navigation of every run.

    Args:
        environment: The env: robot, rates, time limit, noise, effect of a collision.
        navigation: Nav2's parameters; also the name of a preset or of a ``nav2_params.yaml``, the options of a
            :class:`ParameterFile`, or the changes to a preset (see :func:`changed_preset`).
        own_goal_check: Whether Nav2's own goal checker decides when the goal is reached; if False, the env does.
        unknown_map: Whether Nav2's costmaps hold only the cells that the sensors have observed. A controller that
            observes ``path`` or ``costmap``, which the env makes of the map, is refused then.
    """

    environment: EnvConfig = EnvConfig()
    navigation: NavigationParams
    own_goal_check: bool = True
    unknown_map: bool = False

    @field_validator("navigation", mode="before")
    @classmethod
    def _load(cls, value: Any) -> Any:
        if isinstance(value, str):
            return load_navigation(value)
        if isinstance(value, Mapping) and "params" in value:
            return ParameterFile.from_mapping(value, "navigation").load()
        if isinstance(value, Mapping) and "controllers" not in value:
            return changed_preset(value)
        return value

    @model_validator(mode="after")
    def _sees(self) -> Self:
        if self.unknown_map:
            check_sensors(self.navigation)
        return self

    @property
    def time_limit(self) -> float:
        """Simulated seconds after which a run is a timeout."""
        return self.environment.time_limit

    @property
    def robot(self) -> RobotSpec:
        """The robot."""
        return self.environment.robot

    @property
    def unused(self) -> tuple[str, ...]:
        """Names of those of :data:`UNUSED` that differ from their defaults."""
        usual = EnvConfig()
        return tuple(name for name in UNUSED if getattr(self.environment, name) != getattr(usual, name))


def with_parameters(settings: DriveSettings, read: Nav2Params) -> DriveSettings:
    """Overlay settings with a parameter file: its navigation, its robot, and at least the rates that both need."""
    world = settings.environment
    robot = robot_of(read, world.robot)
    control = max(world.control_hz, read.navigation.controller_server.controller_frequency)
    physics = _physics_hz(max(world.physics_hz, lowest_physics_hz(robot)), control)
    world = world.replace(robot=robot, control_hz=control, physics_hz=physics)
    return settings.replace(navigation=read.navigation, environment=world)


def chosen_robot(own: RobotSpec, name: str | None, radius: float | None, options: str) -> RobotSpec:
    """Return the robot of a name, or the own one: as a disc of a radius, m, if there is one.

    Raises:
        ConfigError: If name and radius are given, by ``options``; or there is no such robot.
    """
    if name is not None and radius is not None:
        raise ConfigError(f"{options}: expected one of them, got both")
    if name is not None:
        return make_robot(name)
    return own if radius is None else own.replace(name="custom", radius=radius, footprint=None)


def with_robot(world: EnvConfig, robot: RobotSpec) -> EnvConfig:
    """Return a world with another robot, and with more physics steps per second if the robot needs them."""
    lowest = lowest_physics_hz(robot)
    if lowest <= world.physics_hz:
        return world.replace(robot=robot)
    return world.replace(robot=robot, physics_hz=_physics_hz(lowest, world.control_hz))


def _physics_hz(lowest: float, control_hz: float) -> float:
    """Return the lowest multiple of a rate of control that is not below ``lowest``."""
    return control_hz * math.ceil(lowest / control_hz - 1e-9)


def take_shape_of_robot(navigation: NavigationParams, radius: float | None = None) -> NavigationParams:
    """Return Nav2's parameters with costmaps for the shape of the robot, or for a disc of a radius (m)."""
    shape = {"robot_radius": radius, "footprint": None}
    return navigation.replace(
        local_costmap=navigation.local_costmap.replace(**shape),
        global_costmap=navigation.global_costmap.replace(**shape),
    )


def load_navigation(name: str) -> NavigationParams:
    """Load a preset by name, or a user's ``nav2_params.yaml``."""
    return load_preset(name) if name in PRESETS else ParameterFile(params=name).load()


def changed_preset(changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return the parameters of a preset with some changed: ``{preset: fair, planner: {name: smac_2d}}``.

    Args:
        changes: The name of the ``preset``, and the changed groups. A planner of another name replaces the preset's.

    Raises:
        ConfigError: If no preset is named, or none of this name exists.
    """
    changes = dict(changes)
    name = changes.pop("preset", None)
    if not isinstance(name, str):
        raise ConfigError(f"expected one of the keys preset, params or controllers, got {', '.join(changes) or 'none'}")
    base = load_preset(name).model_dump()
    planner = changes.get("planner")
    if isinstance(planner, Mapping) and planner.get("name", base["planner"]["name"]) != base["planner"]["name"]:
        base["planner"] = {}
    return overlay(base, changes)
