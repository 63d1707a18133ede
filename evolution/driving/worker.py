"""From a job to its result: the function that worker processes call."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from typing import Any, Self

from pydantic import Field, field_validator, model_validator

from controllers.base import Controller
from controllers.nav2_params import (
    PRESETS,
    Nav2Params,
    NavigationParams,
    load_preset,
    read_nav2_params,
    robot_of,
)
from controllers.navigator.navigator import Navigator
from controllers.registry import CONTROLLERS, make_controller
from controllers.releases import Release
from evolution.driving.jobs import ControllerSpec, Job, RunResult
from evolution.driving.one_run import environment_for, run_episode
from evolution.driving.unknown_map import check_sensors, without_map
from gym_mapbench.costmap import LAYERS
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.errors import ConfigError
from gym_mapbench.metrics import measure
from gym_mapbench.metrics.episode import Episode
from gym_mapbench.planners import PLANNERS
from gym_mapbench.settings import Settings
from gym_mapbench.world.clearance import check_clearance
from gym_mapbench.world.robot import RobotSpec
from gym_mapbench.world.scenario import Scenario


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

    def load(self) -> NavigationParams:
        """Read the file.

        Raises:
            ConfigError: If the file cannot be used.
        """
        return read_nav2_params(self.params, release=self.nav2, defines=self.define, only=self.only).navigation


class DriveSettings(Settings):
    """World, robot and navigation of every run.

    Args:
        environment: The env: robot, rates, time limit, noise, what a collision does.
        navigation: Nav2's parameters; also the name of a preset or of a ``nav2_params.yaml``, or the options of a
            :class:`ParameterFile`.
        own_goal_check: Whether Nav2's own goal checker decides when the goal is reached; if False, the env does.
        unknown_map: Whether Nav2's costmaps know only what the sensors have shown of the map so far.
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
        """The robot that drives."""
        return self.environment.robot


def with_parameters(settings: DriveSettings, read: Nav2Params) -> DriveSettings:
    """Overlay settings with a parameter file: its navigation, its robot, and its control frequency at least."""
    world = settings.environment
    control = max(world.control_hz, read.navigation.controller_server.controller_frequency)
    physics = control * math.ceil(world.physics_hz / control - 1e-9)
    world = world.replace(robot=robot_of(read, world.robot), control_hz=control, physics_hz=physics)
    return settings.replace(navigation=read.navigation, environment=world)


def load_navigation(name: str) -> NavigationParams:
    """Load a preset by name, or a user's ``nav2_params.yaml``."""
    return load_preset(name) if name in PRESETS else ParameterFile(params=name).load()


def build_controller(spec: ControllerSpec, settings: DriveSettings) -> Controller:
    """Make the controller that ``spec`` names, with the navigation of ``settings``.

    Raises:
        ConfigError: If there is no such controller, parameter or model file.
    """
    params: dict[str, Any] = dict(spec.params)
    return make_controller(spec.registered_name, navigation=settings.navigation, label=spec.name, **params)


def try_controllers(specs: Iterable[ControllerSpec], settings: DriveSettings) -> None:
    """Make every controller once, so that one that cannot drive is reported before anything is driven.

    Raises:
        ConfigError: Naming the first that cannot be made, that workers cannot find, or that does not fit the control
            frequency or the sensors of the world.
    """
    PLANNERS.for_workers(settings.navigation.planner.name)
    for costmap in (settings.navigation.local_costmap, settings.navigation.global_costmap):
        for layer in costmap.plugins:
            LAYERS.for_workers(layer)
    for spec in specs:
        CONTROLLERS.for_workers(spec.registered_name)
        controller = build_controller(spec, settings)
        environment_for(settings.environment, controller)
        if isinstance(controller, Navigator):
            controller.check_frequency(1.0 / settings.environment.control_hz)


def check_room(scenarios: Iterable[Scenario], settings: DriveSettings) -> None:
    """Refuse maps if the robot can stand at start and goal on none of them.

    If it can on some of them, runs on the others end in ``error`` with the reason.

    Raises:
        ConfigError: Naming the first of the maps.
    """
    problems = []
    for scenario in scenarios:
        try:
            check_clearance(scenario, settings.environment.robot)
        except ConfigError as error:
            problems.append(f"{scenario.name}: {error}")
        else:
            return
    if problems:
        raise ConfigError(problems[0])


def drive(job: Job, watch: Callable[[Controller], object] | None = None) -> Episode:
    """Drive a job and return the whole recorded run.

    Args:
        job: The run.
        watch: Called with the controller after every command that is driven.
    """
    if not isinstance(job.settings, DriveSettings):
        raise TypeError(f"expected DriveSettings, got {type(job.settings).__name__}")
    settings = job.settings
    if settings.unknown_map:
        settings = settings.replace(navigation=without_map(settings.navigation, job.scenario.map))
    controller = build_controller(job.controller, settings)
    env = environment_for(settings.environment, controller, own_goal_check=settings.own_goal_check)
    return run_episode(
        env, controller, job.scenario, name=job.controller.name, seed=job.seed, noise_seed=job.noise_seed, watch=watch
    )


def run_job(job: Job) -> RunResult:
    """Drive a job and return its measures; wall-clock values are kept apart from what a seed reproduces."""
    return result_of(drive(job), job.metrics)


def result_of(episode: Episode, also: Iterable[str] = ()) -> RunResult:
    """Measure a recorded run, with further metrics besides the project's own."""
    metrics = measure(episode, also)
    steps = max(1, len(episode.commands))
    return RunResult(
        outcome=episode.outcome,
        time_s=episode.time,
        path_length_m=metrics.pop("path_length"),
        reason=episode.reason,
        metrics=metrics,
        timings={"controller_ms": 1000 * episode.controller_seconds / steps},
        seed=episode.seed,
    )
