"""What the critics are told about one cycle, and the map grids that they share."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from controllers.base import Twist
from controllers.dwb.kernels.plan import distance_fields
from gym_mapbench.costmap import Costmap
from gym_mapbench.scenario import Pose

PATH, GOAL, GOAL_AHEAD = 0, 1, 2


class Fields(NamedTuple):
    """Manhattan distances in cells near the robot.

    Args:
        distances: ``(3, cells)`` int32: distances from the plan, from its last cell on the map, and from the same cell
            after the plan's end was moved ahead. They cover some whole rows of the map, and are filled where needed.
        skipped: Number of cells of the map before these rows.
        reached: Whether any of the plan is on the map; if not, all distances are ``cells of the map + 1``.
    """

    distances: NDArray[np.int32]
    skipped: int
    reached: bool


@dataclass
class Scene:
    """The scene of one cycle.

    Args:
        pose: Pose of the robot.
        velocity: Its velocity.
        goal: Last pose of the global plan.
        plan: ``(n, 3)`` the part of the global plan near the robot.
        costmap: The local costmap.
        corners: ``(k, 2)`` padded footprint, m.
        now: Seconds since the start of the run.
        box: Lowest and highest x, lowest and highest y of all points whose distances are needed, m.
        ahead: How far towards the goal GoalAlign moves the end of the plan, m.
    """

    pose: Pose
    velocity: Twist
    goal: Pose
    plan: NDArray[np.float64]
    costmap: Costmap
    corners: NDArray[np.float64]
    now: float
    box: tuple[float, float, float, float]
    ahead: float

    def goal_distance_sq(self) -> float:
        """Distance from the robot to the goal, squared, m^2."""
        dx, dy = self.pose.x - self.goal.x, self.pose.y - self.goal.y
        return dx * dx + dy * dy

    @cached_property
    def fields(self) -> Fields:
        """The map grids, made when the first critic asks."""
        m = self.costmap
        bearing = math.atan2(self.goal.y - self.pose.y, self.goal.x - self.pose.x)
        ahead_x, ahead_y = self.ahead * math.cos(bearing), self.ahead * math.sin(bearing)
        return Fields(
            *distance_fields(self.plan, ahead_x, ahead_y, m.costs, m.origin_x, m.origin_y, m.resolution, self.box)
        )
