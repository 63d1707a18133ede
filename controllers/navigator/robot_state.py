"""RobotState and RobotOnMap: what the servers and the tree measure of the robot."""

from __future__ import annotations

from typing import Protocol

from controllers.base import Twist
from gym_mapbench.world.scenario import Pose


class RobotState(Protocol):
    """The newest measurements."""

    @property
    def local_pose(self) -> Pose:
        """Pose of the robot in the frame of the local costmap, m and rad."""
        ...

    @property
    def odometry(self) -> Twist:
        """Measured velocity, m/s and rad/s."""
        ...

    @property
    def map_in_local(self) -> Pose:
        """Pose of the map's frame in the frame of the local costmap, m and rad."""
        ...


class RobotOnMap(Protocol):
    """The newest measurements that the nodes of a tree ask for."""

    @property
    def pose(self) -> Pose:
        """Pose of the robot on the map, m and rad."""
        ...

    @property
    def odometry(self) -> Twist:
        """Measured velocity, m/s and rad/s."""
        ...

    @property
    def acceleration(self) -> float:
        """Difference of the last two measured speeds over the time between them, m/s^2; 0 before the third one."""
        ...
