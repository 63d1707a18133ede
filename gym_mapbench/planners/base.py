"""The interface of a global planner, and functions that Nav2's planners share."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from gym_mapbench.costmap import LETHAL_OBSTACLE, Costmap
from gym_mapbench.errors import EndpointError, NoPathError, PluginError
from gym_mapbench.ros_params import RosPlugin
from gym_mapbench.settings import Settings
from gym_mapbench.world.scenario import Pose

Path = NDArray[np.float64]


class GlobalPlanner(Protocol):
    """A planner plugin in Nav2's sense (``nav2_core::GlobalPlanner``)."""

    def plan(self, costmap: Costmap, start: Pose, goal: Pose) -> Path:
        """Return a path from start to goal, ``(n, 3)`` x, y in m and yaw in rad; ``costmap`` stays as it is.

        Raises:
            NoPathError: If there is none.
        """
        ...


class PlannerEntry(NamedTuple):
    """A kind of planner, as the registry holds it.

    Args:
        params: The class of its options.
        make: Makes the planner from its options.
        nav2: How parameter files of Nav2 name and hold the planner; None if Nav2 has no such planner.
    """

    params: type[Settings]
    make: Callable[[Any], GlobalPlanner]
    nav2: RosPlugin | None = None


def checked_path(path: object, made_by: str) -> Path:
    """Return the path of a third party's plugin in an array of its own, ``(n, 3)``.

    Raises:
        PluginError: If it is something else, or has a number that is not finite.
    """
    try:
        poses = np.array(path, dtype=np.float64)
    except (TypeError, ValueError):
        poses = np.empty(0)
    if poses.ndim != 2 or poses.shape[1] != 3 or not np.isfinite(poses).all():
        raise PluginError(f"{made_by}: expected a path of (n, 3) finite numbers, got {path!r:.80}")
    return poses


def no_path(start: Pose, goal: Pose, reason: str, kind: type[NoPathError] = NoPathError) -> NoPathError:
    """Return the error of a planner that found no path."""
    return kind(f"no path from ({start.x:.3f}, {start.y:.3f}) to ({goal.x:.3f}, {goal.y:.3f}): {reason}")


def refuse_obstacle(costmap: Costmap, cell: tuple[int, int], start: Pose, goal: Pose) -> None:
    """Refuse a plan whose start and goal are one cell if that cell is lethal.

    Raises:
        EndpointError: If it is lethal.
    """
    if costmap.costs[cell] == LETHAL_OBSTACLE:
        raise no_path(start, goal, "the robot stands on an obstacle", EndpointError)


def stay(start: Pose, goal: Pose, use_final_approach_orientation: bool) -> Path:
    """Return the single pose of a plan whose start is its goal, at the goal's yaw unless the approach decides."""
    return np.array([[start.x, start.y, start.yaw if use_final_approach_orientation else goal.yaw]])


def set_last_yaw(path: Path, start: Pose, goal: Pose, use_final_approach_orientation: bool) -> None:
    """Give the last pose the goal's yaw, or the direction in which the path arrives there."""
    if not use_final_approach_orientation:
        path[-1, 2] = goal.yaw
    elif len(path) == 1:
        path[-1, 2] = start.yaw
    else:
        doubled = len(path) > 2 and bool((np.abs(path[-1, :2] - path[-2, :2]) < 1e-4).all())
        dx, dy = path[-1, :2] - path[-3 if doubled else -2, :2]
        path[-1, 2] = math.atan2(dy, dx)


def cells_of(costmap: Costmap, start: Pose, goal: Pose) -> tuple[tuple[int, int], tuple[int, int]]:
    """Return ``(row, col)`` of start and goal as the costmap maps them.

    Raises:
        EndpointError: If one of them is off the map.
    """
    start_cell, goal_cell = costmap.world_to_map(start.x, start.y), costmap.world_to_map(goal.x, goal.y)
    if start_cell is None or goal_cell is None:
        raise no_path(start, goal, f"the {'start' if start_cell is None else 'goal'} is off the map", EndpointError)
    return start_cell, goal_cell


def to_centres(cells: NDArray[np.int64], costmap: Costmap) -> NDArray[np.float64]:
    """Centres ``(n, 2)`` x, y in m of cells ``(n, 2)`` row, col."""
    origin = np.array([costmap.origin_x, costmap.origin_y])
    return np.asarray((cells[:, ::-1] + 0.5) * costmap.resolution + origin, np.float64)
