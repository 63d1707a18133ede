"""The scenario of an episode: from the options of the reset, one of the env's scenarios, or a random one."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from gym_mapbench.env.config import EnvConfig
from gym_mapbench.env.observation import has_path
from gym_mapbench.env.task import distance_to_goal
from gym_mapbench.errors import ConfigError, refuse_unknown
from gym_mapbench.generator import ShapeSettings, draw_map
from gym_mapbench.world.clearance import check_clearance, has_room
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.scenario import Pose, Scenario, as_scenarios, must_be_map

RESET_OPTIONS = ("scenario", "map", "start", "goal")
MAX_DRAWS = 1000


class ScenarioSource:
    """Chooses the scenario of every episode.

    Args:
        config: Says where maps come from, and how random ones look.
        scenarios: Use these instead of the configured maps.

    Raises:
        ConfigError: If ``scenarios`` is empty or no scenarios, or a configured task is impossible.
        MapFormatError: If a configured file is not a map.
    """

    def __init__(self, config: EnvConfig, scenarios: Iterable[Scenario] | None = None) -> None:
        self._config = config
        self._scenarios = config.load_scenarios() if scenarios is None else as_scenarios("scenarios", scenarios)

    def choose(self, options: Mapping[str, Any] | None, rng: np.random.Generator) -> Scenario:
        """Return the scenario of ``options``; what they leave open is sampled.

        Args:
            options: ``scenario`` (an index or a Scenario) or ``map`` (a GridMap), ``start``, ``goal``.
            rng: The env's generator.

        Raises:
            ConfigError: On an unknown option, a bad value, or a start or goal off the map or occupied.
        """
        options = read_options(options)
        for name in options:
            refuse_unknown("reset option", name, RESET_OPTIONS)
        if "map" in options and "scenario" in options:
            raise ConfigError("reset options: expected either a map or a scenario, got both")
        task: dict[str, Any] = {
            what: as_pose(what, options[what]) for what in ("start", "goal") if options.get(what) is not None
        }
        if "map" in options:
            return self._on_map(options["map"], task)
        if self._scenarios is None and options.get("scenario") is None:
            return draw_scenario(self._with_task(task), rng)
        scenario = self._chosen(options.get("scenario"), rng)
        return replace(scenario, **task) if task else scenario

    def _chosen(self, choice: object, rng: np.random.Generator) -> Scenario:
        """Return a given scenario, the scenario of an index, or any of the env's."""
        if isinstance(choice, Scenario):
            return choice
        if choice is None and self._scenarios is not None:
            return self._scenarios[int(rng.integers(len(self._scenarios)))]
        count = len(self._scenarios or ())
        if isinstance(choice, bool) or not isinstance(choice, int | np.integer) or not 0 <= choice < count:
            raise ConfigError(f"scenario: expected a Scenario or an index below {count}, got {choice!r:.80}")
        return (self._scenarios or ())[int(choice)]

    def _on_map(self, grid: GridMap, task: Mapping[str, Any]) -> Scenario:
        """Put a task on a given map."""
        must_be_map(grid)
        if len(task) == 2:
            return Scenario(grid, task["start"], task["goal"])
        return self._with_task(task).make_scenario(grid)

    def _with_task(self, task: Mapping[str, Pose]) -> EnvConfig:
        """Return the configuration with the given of start and goal in place of its own."""
        return self._config.replace(**{what: tuple(pose) for what, pose in task.items()}) if task else self._config


def read_options(options: object) -> Mapping[str, Any]:
    """Return the options of a reset; none for None.

    Raises:
        ConfigError: If they are not a mapping.
    """
    if options is None or isinstance(options, Mapping):
        return options or {}
    raise ConfigError(f"reset options: expected a mapping, got {type(options).__name__}")


def draw_scenario(config: EnvConfig, rng: np.random.Generator) -> Scenario:
    """Sample a map of the configured families, or else of the thesis, on which the robot can drive from start to goal.

    Where ``path`` is observed, the planner must find a path, too.

    Raises:
        ConfigError: If none of 1000 maps can be solved, start or goal is off the map, or a family has no map for this
            robot.
    """
    shapes = config.shapes if config.resolution is None else config.shapes.replace(resolution=config.resolution)
    for _ in range(MAX_DRAWS):
        grid = _draw_grid(config, shapes, rng)
        scenario = _with_room(config, grid)
        if scenario and distance_to_goal(scenario, config.robot).solvable and is_planned(config, scenario):
            return scenario
    check_clearance(config.make_scenario(grid), config.robot)  # Names a start or goal that walls cover.
    raise ConfigError(f"shapes: expected maps that {config.robot.name} can solve, got none in {MAX_DRAWS} samples")


def draw_scenarios(config: EnvConfig, rng: np.random.Generator, count: int) -> list[Scenario]:
    """Sample scenarios, called ``random_000``, ``random_001``...; arguments and errors as :func:`draw_scenario`."""
    return [replace(draw_scenario(config, rng), name=f"random_{number:03d}") for number in range(count)]


def is_planned(config: EnvConfig, scenario: Scenario) -> bool:
    """Whether the planner finds a path, where ``path`` is observed."""
    return "path" not in config.observation or has_path(config, scenario)


def _with_room(config: EnvConfig, grid: GridMap) -> Scenario | None:
    """Return the task on a sampled map; None if the robot would touch a wall at the start or the goal."""
    for pose in (config.start, config.goal):
        cell = None if pose is None else grid.world_to_cell(*pose[:2])
        if cell is not None and grid.occupancy[cell]:
            return None
    scenario = config.make_scenario(grid, "random")
    return scenario if all(has_room(grid, config.robot, pose) for pose in (scenario.start, scenario.goal)) else None


def _draw_grid(config: EnvConfig, shapes: ShapeSettings, rng: np.random.Generator) -> GridMap:
    return GridMap(draw_map(rng, shapes, config.family, config.robot), shapes.resolution)


def as_pose(what: str, pose: Sequence[float]) -> Pose:
    """Make a pose of ``(x, y)`` or ``(x, y, yaw)``.

    Raises:
        ConfigError: If it is not two or three numbers.
    """
    try:
        numbers = [float(value) for value in pose]
    except (TypeError, ValueError):
        numbers = []
    if len(numbers) not in (2, 3):
        raise ConfigError(f"{what}: expected (x, y) or (x, y, yaw) in m and rad, got {pose!r:.80}")
    return Pose(*numbers)
