"""Random tasks: start and goal anywhere on a map."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gym_mapbench.env.task import inscribed_radius
from gym_mapbench.kernels.distance import geodesic_distance, squared_distance
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.robot import RobotSpec
from gym_mapbench.world.scenario import Pose, Scenario

SPARE = 0.05
"""Room that is left around the robot at start and goal, m."""
NEAREST = 1.0
"""Shortest distance between start and goal, m."""
MAX_GOALS = 20


def draw_task(grid: GridMap, robot: RobotSpec, rng: np.random.Generator) -> Scenario | None:
    """Sample start and goal on a map, connected for the robot, with uniform distances and headings.

    Args:
        grid: The map.
        robot: Its shape.
        rng: Source of all randomness.

    Returns:
        The map with its task; None if the robot has no room for one.
    """
    squared = squared_distance(grid.occupancy)
    room = np.argwhere(squared > ((robot.circumscribed_radius + SPARE) / grid.resolution) ** 2)
    blocked = squared <= (inscribed_radius(robot) / grid.resolution) ** 2
    farthest = math.hypot(*grid.shape) * grid.resolution
    for _ in range(MAX_GOALS if len(room) else 0):
        goal = room[rng.integers(len(room))]
        reached = room[np.isfinite(geodesic_distance(blocked, int(goal[0]), int(goal[1]))[room[:, 0], room[:, 1]])]
        away = np.hypot(*(reached - goal).T) * grid.resolution
        wanted = rng.uniform(NEAREST, farthest)
        number = int(np.argmin(np.abs(away - wanted)))
        if away[number] >= NEAREST:
            return Scenario(grid, _pose(grid, reached[number], rng), _pose(grid, goal, rng), "random")
    return None


def _pose(grid: GridMap, cell: NDArray[np.int64], rng: np.random.Generator) -> Pose:
    """Return a pose in the middle of a cell, with any heading."""
    x, y = grid.cell_to_world(int(cell[0]), int(cell[1]))
    return Pose(x, y, float(rng.uniform(-math.pi, math.pi)))
