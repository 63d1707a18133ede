"""The task: when an episode ends, and what a step is worth."""

from __future__ import annotations

import functools
import math
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from gym_mapbench.config import EnvConfig
from gym_mapbench.costmap import CostmapParams
from gym_mapbench.groups import RewardSettings
from gym_mapbench.kernels.distance import geodesic_distance, squared_distance
from gym_mapbench.kernels.field import fill_unreached, interpolate
from gym_mapbench.robot import RobotSpec
from gym_mapbench.scenario import Pose, Scenario, wrap_angle

StepOutcome = Literal["running", "goal", "collision", "timeout"]
REWARD_TERMS = ("progress", "time", "collision", "goal")


def reward_terms(
    weights: RewardSettings, progress: float, seconds: float, touched: bool, arrived: bool
) -> dict[str, float]:
    """Return every term of the reward of one step; the reward is their sum.

    Args:
        weights: Weight of every term.
        progress: By how much the geodesic distance to the goal shrank, m.
        seconds: Simulated length of the step, s.
        touched: Whether a contact began.
        arrived: Whether the goal was reached for the first time.
    """
    return {
        "progress": weights.progress * progress,
        "time": -weights.time * seconds,
        "collision": -weights.collision if touched else 0.0,
        "goal": weights.goal if arrived else 0.0,
    }


def decide_outcome(collision: bool, goal: bool, out_of_time: bool) -> StepOutcome:
    """Return how the episode stands; touching a wall on the way into the goal is a collision."""
    if collision:
        return "collision"
    if goal:
        return "goal"
    return "timeout" if out_of_time else "running"


class GoalCheck:
    """Whether the goal is reached, as Nav2's stateful SimpleGoalChecker decides it.

    Args:
        goal: Where to go.
        xy_tolerance: Distance at which the position counts as reached, from then on, m.
        yaw_tolerance: Error of the heading at which the goal is reached, rad.
    """

    def __init__(self, goal: Pose, xy_tolerance: float, yaw_tolerance: float) -> None:
        self._goal = goal
        self._xy_tolerance = xy_tolerance
        self._yaw_tolerance = yaw_tolerance
        self._position_reached = False

    def reached(self, pose: Pose) -> bool:
        """Return whether the robot is at the goal."""
        if not self._position_reached:
            dx, dy = self._goal.x - pose.x, self._goal.y - pose.y
            self._position_reached = dx * dx + dy * dy <= self._xy_tolerance * self._xy_tolerance
        return self._position_reached and abs(wrap_angle(self._goal.yaw - pose.yaw)) <= self._yaw_tolerance


class DistanceToGoal:
    """Geodesic distance to the goal over the cells the robot's centre can be on, continuous in the position.

    Distances run between the centres of neighbouring cells (8 neighbours) and are interpolated linearly
    between them. Cells where the robot does not fit are given the distance of the nearest ones where it does.

    Args:
        scenario: Map and task.
        robot: Its shape.
    """

    def __init__(self, scenario: Scenario, robot: RobotSpec) -> None:
        grid = scenario.map
        cell = grid.world_to_cell(scenario.goal.x, scenario.goal.y)
        distance = geodesic_distance(~open_cells(scenario, robot), *(cell or (0, 0)))
        self.solvable = math.isfinite(distance[grid.world_to_cell(scenario.start.x, scenario.start.y) or (0, 0)])
        fill_unreached(distance)
        self._cells = distance
        self._resolution = grid.resolution
        self._origin = grid.origin

    def at(self, x: float, y: float) -> float:
        """Return the distance from a point on the map, m."""
        column = (x - self._origin[0]) / self._resolution - 0.5
        line = (y - self._origin[1]) / self._resolution - 0.5
        return float(interpolate(self._cells, line, column)) * self._resolution


@functools.lru_cache(maxsize=8)
def distance_to_goal(scenario: Scenario, robot: RobotSpec) -> DistanceToGoal:
    """Return the field of a scenario; the last few are kept, as runs often repeat a scenario."""
    return DistanceToGoal(scenario, robot)


def open_cells(scenario: Scenario, robot: RobotSpec) -> NDArray[np.bool_]:
    """Return the cells ``(rows, cols)`` where Nav2's costmap sees no collision, and those around start and goal."""
    grid = scenario.map
    radius = inscribed_radius(robot) / grid.resolution
    free: NDArray[np.bool_] = squared_distance(grid.occupancy) > radius * radius
    for pose in (scenario.start, scenario.goal):
        row, col = grid.world_to_cell(pose.x, pose.y) or (0, 0)
        around = slice(max(0, row - 1), row + 2), slice(max(0, col - 1), col + 2)
        free[around] |= ~grid.occupancy[around]
    return free


@functools.lru_cache(maxsize=8)
def inscribed_radius(robot: RobotSpec) -> float:
    """Return the inscribed radius of the robot's footprint as Nav2 pads it, m."""
    return CostmapParams().make_footprint(robot).inscribed_radius


class Task:
    """Follows one episode: its clock, its outcome, and the reward of every step.

    Args:
        config: Limits, tolerances and weights.
        scenario: Map, start and goal.
        start: Where the robot really starts.
    """

    def __init__(self, config: EnvConfig, scenario: Scenario, start: Pose) -> None:
        self.outcome: StepOutcome = "running"
        self._config = config
        self._steps = 0
        self._max_steps = config.max_steps
        self._goal = GoalCheck(scenario.goal, config.xy_goal_tolerance, config.yaw_goal_tolerance)
        self._field = distance_to_goal(scenario, config.robot) if config.reward.progress else None
        self._distance = self._measure(start)
        self._touching = self._arrived = False

    @property
    def over(self) -> bool:
        """Whether the episode has ended."""
        return self.outcome != "running"

    @property
    def time(self) -> float:
        """Simulated seconds since the start."""
        return self._steps / self._config.control_hz

    def step(self, pose: Pose, contact: bool) -> dict[str, float]:
        """Judge one control step; return the terms of its reward.

        Args:
            pose: True pose after the step.
            contact: Whether a wall was touched during the step.
        """
        config = self._config
        self._steps += 1
        at_goal = self._goal.reached(pose)
        self.outcome = decide_outcome(
            contact and config.collision_ends_episode,
            at_goal and config.goal_ends_episode,
            self._steps >= self._max_steps,
        )
        distance = self._measure(pose)
        terms = reward_terms(
            config.reward,
            progress=self._distance - distance,
            seconds=1.0 / config.control_hz,
            touched=contact and not self._touching,
            arrived=at_goal and not self._arrived,
        )
        self._distance, self._touching, self._arrived = distance, contact, at_goal or self._arrived
        return terms

    def _measure(self, pose: Pose) -> float:
        """Geodesic distance to the goal, m; 0 everywhere where progress has no weight."""
        return 0.0 if self._field is None else self._field.at(pose.x, pose.y)
