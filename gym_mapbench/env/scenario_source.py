"""The scenario of an episode: from the options of the reset, one of the env's scenarios, or a random one."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from gym_mapbench.env.config import EnvConfig
from gym_mapbench.env.observation import has_path
from gym_mapbench.env.task import distance_to_goal
from gym_mapbench.errors import ConfigError, unknown_name
from gym_mapbench.generator import ShapeSettings, draw_map
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.scenario import Pose, Scenario

RESET_OPTIONS = ("scenario", "map", "start", "goal")
MAX_DRAWS = 1000


class ScenarioSource:
    """Chooses the scenario of every episode.

    Args:
        config: Says where maps come from, and how random ones look.
        scenarios: Use these instead of the configured maps.

    Raises:
        ConfigError: If ``scenarios`` is empty or a configured task is impossible.
        MapFormatError: If a configured file is not a map.
    """

    def __init__(self, config: EnvConfig, scenarios: Iterable[Scenario] | None = None) -> None:
        self._config = config
        self._scenarios = config.load_scenarios() if scenarios is None else tuple(scenarios)
        if self._scenarios == ():
            raise ConfigError("scenarios: expected at least one, got none")

    def choose(self, options: Mapping[str, Any], rng: np.random.Generator) -> Scenario:
        """Return the scenario of ``options``; what they leave open is sampled.

        Args:
            options: ``scenario`` (an index or a Scenario) or ``map`` (a GridMap), ``start``, ``goal``.
            rng: The env's generator.

        Raises:
            ConfigError: On an unknown option, a bad value, or a start or goal off the map or occupied.
        """
        for name in options:
            if name not in RESET_OPTIONS:
                raise unknown_name("reset option", name, RESET_OPTIONS)
        if "map" in options and "scenario" in options:
            raise ConfigError("reset options: expected either a map or a scenario, got both")
        scenario = self._on_map(options) if "map" in options else self._chosen(options.get("scenario"), rng)
        start, goal = options.get("start"), options.get("goal")
        if start is None and goal is None:
            return scenario
        return replace(
            scenario,
            start=scenario.start if start is None else as_pose("start", start),
            goal=scenario.goal if goal is None else as_pose("goal", goal),
        )

    def _chosen(self, choice: object, rng: np.random.Generator) -> Scenario:
        """Return a given scenario, the scenario of an index, or a random one."""
        if isinstance(choice, Scenario):
            return choice
        if choice is None:
            if self._scenarios is None:
                return draw_scenario(self._config, rng)
            return self._scenarios[int(rng.integers(len(self._scenarios)))]
        count = len(self._scenarios or ())
        if isinstance(choice, bool) or not isinstance(choice, int | np.integer) or not 0 <= choice < count:
            raise ConfigError(f"scenario: expected a Scenario or an index below {count}, got {choice!r:.80}")
        return (self._scenarios or ())[int(choice)]

    def _on_map(self, options: Mapping[str, Any]) -> Scenario:
        """Put a task on a given map."""
        grid, start, goal = options["map"], options.get("start"), options.get("goal")
        if not isinstance(grid, GridMap):
            raise ConfigError(f"map: expected a GridMap, got {type(grid).__name__}")
        if start is not None and goal is not None:
            return Scenario(grid, as_pose("start", start), as_pose("goal", goal))
        task = {"start": start, "goal": goal}
        given = {what: tuple(as_pose(what, pose)) for what, pose in task.items() if pose is not None}
        return self._config.replace(**given).make_scenario(grid)


def draw_scenario(config: EnvConfig, rng: np.random.Generator) -> Scenario:
    """Sample a map of the configured families, or else of the thesis, on which the robot can drive from start to goal.

    Where ``path`` is observed, the planner must find a path, too.

    Raises:
        ConfigError: If none of 1000 maps can be solved, or a family has none for this robot.
    """
    shapes = config.shapes if config.resolution is None else config.shapes.replace(resolution=config.resolution)
    for _ in range(MAX_DRAWS):
        scenario = config.make_scenario(_draw_grid(config, shapes, rng), "random")
        if distance_to_goal(scenario, config.robot).solvable and is_planned(config, scenario):
            return scenario
    raise ConfigError(f"shapes: expected maps that {config.robot.name} can solve, got none in {MAX_DRAWS} samples")


def is_planned(config: EnvConfig, scenario: Scenario) -> bool:
    """Whether the planner finds a path, where ``path`` is observed."""
    return "path" not in config.observation or has_path(config, scenario)


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
