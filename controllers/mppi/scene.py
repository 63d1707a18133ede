"""What one call of MPPI is about: robot, local path, costmap."""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from controllers.base import FollowerSetup, Twist
from controllers.mppi.kernels.path import find_valid
from gym_mapbench.costmap import Costmap
from gym_mapbench.scenario import Pose


class Scene:
    """What one call sees.

    Args:
        pose: Robot.
        velocity: Measured speeds.
        path: ``(m, 3)`` local path, x, y in m and yaw in rad.
        costmap: Local costmap.
        setup: Footprint, goal tolerance and inflation layer.

    Attributes:
        state: ``(x, y, yaw, v, w)`` of the robot.
        path: ``(3, m)`` float32.
        failed: Whether a critic found that all trajectories collide; later critics are skipped then.
        furthest: Index of the furthest path point a trajectory reaches, -1 until somebody asks.
    """

    def __init__(
        self, pose: Pose, velocity: Twist, path: NDArray[np.float64], costmap: Costmap, setup: FollowerSetup
    ) -> None:
        self.pose, self.costmap, self.setup = pose, costmap, setup
        self.state = (float(pose.x), float(pose.y), float(pose.yaw), float(velocity.v), float(velocity.w))
        self.path = np.ascontiguousarray(path.T, dtype=np.float32)
        self.failed = False
        self.furthest = -1

    @property
    def points(self) -> int:
        """Number of points of the local path."""
        return self.path.shape[1]

    @cached_property
    def end(self) -> tuple[float, float, float]:
        """Last pose of the local path: what MPPI calls the goal."""
        x, y, yaw = self.path[:, -1].tolist()
        return x, y, yaw

    @cached_property
    def place(self) -> tuple[float, float, float]:
        """``(resolution, origin_x, origin_y)`` of the costmap, m."""
        return float(self.costmap.resolution), float(self.costmap.origin_x), float(self.costmap.origin_y)

    @cached_property
    def valid(self) -> NDArray[np.bool_]:
        """``(m,)`` whether each path point lies on the costmap and off obstacles; the last is not looked at."""
        valid = np.empty(self.points, dtype=np.bool_)
        costmap = self.costmap
        find_valid(self.path[0], self.path[1], costmap.costs, self.place, costmap.track_unknown_space, valid)
        return valid

    def near(self, distance: float) -> bool:
        """Whether the robot is nearer than ``distance`` (m) to the end of the local path."""
        return self._squared_distance < distance * distance

    @cached_property
    def _squared_distance(self) -> float:
        return (self.pose.x - self.end[0]) ** 2 + (self.pose.y - self.end[1]) ** 2

    def from_start(self, x: float, y: float) -> tuple[float, float]:
        """A point relative to the robot's position, m."""
        return x - self.pose.x, y - self.pose.y

    def circumscribed_cost(self) -> float:
        """Cost at which the footprint can begin to touch something (``findCircumscribedCost``)."""
        setup, footprint = self.setup, self.setup.footprint
        if footprint.circumscribed_radius <= footprint.inscribed_radius:
            return 253.0
        beyond = footprint.circumscribed_radius - footprint.inscribed_radius
        return float(int(252.0 * math.exp(-setup.cost_scaling_factor * beyond)))
