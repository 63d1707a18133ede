"""The task: when an episode ends, and the reward of a step."""

from __future__ import annotations

import functools
import math
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gym_mapbench.costmap import CostmapParams
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.kernels.caution import weighted_distance
from gym_mapbench.kernels.distance import geodesic_distance, squared_distance, within
from gym_mapbench.kernels.field import distance_at, fill_unreached
from gym_mapbench.kernels.task import RULES, RUNNING, TASK, judge, standing_of
from gym_mapbench.world.robot import RobotSpec
from gym_mapbench.world.scenario import Pose, Scenario
from gym_mapbench.world.state import Records, Worlds, ground_of

StepOutcome = Literal["running", "goal", "collision", "timeout"]
OUTCOMES: tuple[StepOutcome, ...] = ("running", "goal", "collision", "timeout")
"""How an episode stands, in the order of the numbers in :mod:`gym_mapbench.kernels.task`."""
TOUCHED = ("nothing", "wall", "body", "wall and body")
"""What the robot touched, in the order of the sums of :data:`~gym_mapbench.world.world.WALL` and ``BODY``."""
REWARD_TERMS = ("progress", "time", "collision", "goal")
NO_FIELD = np.zeros((0, 0))


class DistanceToGoal:
    """Geodesic distance to the goal over the cells the robot's centre can be on, continuous in the position.

    Distances run between the centres of neighbouring cells (8 neighbours) and are interpolated linearly
    between them. Cells where the robot does not fit are given the distance of the nearest ones where it does.

    Args:
        scenario: Map and task.
        robot: Its shape.

    Attributes:
        solvable: Whether start and goal are connected.
        cells: ``(rows, cols)`` distance at the cells' centres, in cells.
    """

    def __init__(self, scenario: Scenario, robot: RobotSpec) -> None:
        grid = scenario.map
        start, goal = scenario.end_cells
        distance = self._measure(scenario, robot, goal)
        self.solvable = math.isfinite(distance[start])
        fill_unreached(distance)
        self.cells: NDArray[np.float64] = distance
        self._resolution = grid.resolution
        self._origin = grid.origin

    def at(self, x: float, y: float) -> float:
        """Return the distance from a point on the map, m."""
        return float(distance_at(self.cells, self._resolution, *self._origin, x, y))

    def _measure(self, scenario: Scenario, robot: RobotSpec, goal: tuple[int, int]) -> NDArray[np.float64]:
        """Return the distances of all cells from the goal's, in cells; inf where there is no way."""
        return geodesic_distance(~open_cells(scenario, robot), *goal)  # type: ignore[no-any-return]


@functools.lru_cache(maxsize=8)
def distance_to_goal(scenario: Scenario, robot: RobotSpec) -> DistanceToGoal:
    """Return the field of a scenario; the last few are kept, as runs often repeat a scenario."""
    return DistanceToGoal(scenario, robot)


class CautiousDistance(DistanceToGoal):
    """The same, but a metre near walls counts more: progress then leads through the middle of gaps.

    Args:
        scenario: Map and task.
        robot: Its shape.
        caution: By how much more a metre along a wall counts.
        reach: Room around the robot at which it counts as in the open, m.
    """

    def __init__(self, scenario: Scenario, robot: RobotSpec, caution: float, reach: float) -> None:
        self._caution, self._reach = caution, reach
        super().__init__(scenario, robot)

    def _measure(self, scenario: Scenario, robot: RobotSpec, goal: tuple[int, int]) -> NDArray[np.float64]:
        grid = scenario.map
        room = np.sqrt(squared_distance(grid.occupancy)) * grid.resolution - inscribed_radius(robot)
        costs = 1.0 + self._caution * np.clip(1.0 - room / self._reach, 0.0, 1.0) ** 2
        costs[~open_cells(scenario, robot)] = np.inf
        return weighted_distance(costs, *goal)  # type: ignore[no-any-return]


@functools.lru_cache(maxsize=8)
def progress_field(scenario: Scenario, robot: RobotSpec, caution: float, reach: float) -> DistanceToGoal:
    """Return the distances to the goal that progress is measured with."""
    return CautiousDistance(scenario, robot, caution, reach) if caution else distance_to_goal(scenario, robot)


def open_cells(scenario: Scenario, robot: RobotSpec) -> NDArray[np.bool_]:
    """Return the cells ``(rows, cols)`` where Nav2's costmap sees no collision, and those around start and goal."""
    grid = scenario.map
    radius = inscribed_radius(robot) / grid.resolution
    free: NDArray[np.bool_] = ~within(grid.occupancy, radius)
    for row, col in scenario.end_cells:
        around = slice(max(0, row - 1), row + 2), slice(max(0, col - 1), col + 2)
        free[around] |= ~grid.occupancy[around]
    return free


@functools.lru_cache(maxsize=8)
def inscribed_radius(robot: RobotSpec) -> float:
    """Return the inscribed radius of the robot's footprint as Nav2 pads it, m."""
    return CostmapParams().make_footprint(robot).inscribed_radius


def rules_of(config: EnvConfig) -> Records:
    """Return the ``(1,)`` RULES of a configuration."""
    weights = config.reward
    rules = (
        *(config.xy_goal_tolerance, config.yaw_goal_tolerance, 1.0 / config.control_hz, config.max_steps),
        *(config.collision_ends_episode, config.goal_ends_episode),
        *(weights.progress, weights.time, weights.collision, weights.goal),
    )
    return np.array([rules], RULES)


class Standing(NamedTuple):
    """How an episode stands: outcome, simulated seconds, the last reward and its terms."""

    outcome: StepOutcome
    time: float
    reward: float
    terms: dict[str, float]


class Task:
    """Follows one episode: its clock, its outcome, and the reward of every step.

    Args:
        config: Limits, tolerances and weights.
        scenario: Map, start and goal.
        start: Where the robot really starts.
        worlds: Holds the state of robot and episode, as its only world; None for a state of its own.

    Attributes:
        field: ``(rows, cols)`` distances to the goal, cells; empty where progress has no weight.
    """

    def __init__(self, config: EnvConfig, scenario: Scenario, start: Pose, worlds: Worlds | None = None) -> None:
        self._worlds = Worlds() if worlds is None else worlds
        self._outcomes = self._worlds.tasks["outcome"]
        self._control_hz = config.control_hz
        self._rules = rules_of(config)
        self.field, distance = NO_FIELD, 0.0
        if config.reward.progress:
            to_goal = progress_field(scenario, config.robot, config.reward.caution, config.reward.caution_reach)
            self.field, distance = to_goal.cells, to_goal.at(start.x, start.y)
        self._worlds.grounds[0] = ground_of(scenario.map)
        self._worlds.tasks[0] = np.zeros((), TASK)
        for name, value in zip(("goal_x", "goal_y", "goal_yaw", "distance"), (*scenario.goal, distance), strict=True):
            self._worlds.tasks[name] = value

    def standing(self) -> Standing:
        """Return how the episode stands."""
        return self._standing(standing_of(self._worlds.tasks, 0))

    @property
    def over(self) -> bool:
        """Whether the episode has ended."""
        return bool(self._outcomes.item(0) != RUNNING)

    def step(self, touched: int) -> Standing:
        """Judge one control step; return how the episode stands then.

        Args:
            touched: What the robot touched during the step, 0 for nothing.
        """
        worlds = self._worlds
        return self._standing(judge(worlds.tasks, 0, self._rules, worlds.robots, touched, worlds.grounds, self.field))

    def _standing(self, judged: tuple[Any, ...]) -> Standing:
        outcome, steps, reward, *terms = judged
        named = dict(zip(REWARD_TERMS, terms, strict=True))
        return Standing(OUTCOMES[outcome], steps / self._control_hz, reward, named)
