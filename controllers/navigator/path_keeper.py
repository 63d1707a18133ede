"""PathValidity: whether a path is still free; and PathKeeper: whether Lyrical's tree keeps it and does not plan again.

Source: nav2_planner (Humble, Jazzy) src/planner_server.cpp, ``isPathValid``; (Lyrical)
include/nav2_planner/is_path_valid_service.hpp; nav2_behavior_tree (Lyrical) is_goal_nearby_condition, validate_path.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.navigator.costmap_wait import ServedCostmap
from controllers.navigator.robot_state import RobotOnMap
from gym_mapbench.costmap import INSCRIBED_INFLATED_OBSTACLE, LETHAL_OBSTACLE, NO_INFORMATION
from gym_mapbench.kernels.footprint import footprint_cost
from gym_mapbench.kernels.geometry import cell_index
from gym_mapbench.world.footprint import Footprint

SEARCH = 1.5
"""Length of path ahead of the last nearest pose in which the next is sought, m."""


class PathValidity:
    """Says whether the robot could drive along a path (the planner server's ``is_path_valid``).

    Args:
        robot: Where the robot is.
        costmap: The global costmap.
        footprint: The padded footprint.
    """

    def __init__(self, robot: RobotOnMap, costmap: ServedCostmap, footprint: Footprint) -> None:
        self._robot, self._costmap, self._footprint = robot, costmap, footprint
        self._corners = np.ascontiguousarray(footprint.corners)

    def is_valid(self, path: Any) -> bool:
        """Return whether a path, ``(n, 3)`` on the map, is free from the pose nearest to the robot on."""
        if not len(path):
            return False
        distances = np.hypot(*(path[:, :2] - np.array(self._robot.pose[:2])).T).astype(np.float32)
        return self.is_free(path[np.argmin(distances) :])

    def is_free(self, path: Any) -> bool:
        """Return whether all poses of a path are free."""
        return all(map(self._is_free, path))

    def _is_free(self, pose: Any) -> bool:
        """Whether the robot touches nothing at a pose: by the cost at its centre for a disc, else along its outline."""
        m, (x, y, yaw) = self._costmap.costmap, pose.tolist()
        cell = cell_index(x, y, m.origin_x, m.origin_y, m.resolution, *m.costs.shape)
        if cell < 0:
            return False
        if self._footprint.use_radius:
            return m.costs.flat[cell] not in (INSCRIBED_INFLATED_OBSTACLE, LETHAL_OBSTACLE)
        cost = footprint_cost(*m.grid, x, y, yaw, self._corners)
        return bool(cost < LETHAL_OBSTACLE or cost == NO_INFORMATION)


class NearestPose:
    """Finds the pose of a path that is nearest to the robot, not far ahead of the one found last.

    Args:
        robot: Where the robot is.
        search: Length of path ahead of the last nearest pose in which the next is sought, m; infinite for the whole
            path at every time.
        angular_weight: Metres for which a radian between the headings counts.

    Attributes:
        along: Length of the path up to each of its poses, m.
    """

    along: NDArray[np.float64]

    def __init__(self, robot: RobotOnMap, search: float, angular_weight: float = 0.0) -> None:
        self._robot, self._search, self._angular_weight = robot, search, angular_weight
        self._path: Any = ()
        self._nearest = 0

    def on(self, path: NDArray[np.float64]) -> int:
        """Return the index of the nearest pose of a path, ``(n, 3)`` on the map, which has poses."""
        if path is not self._path:
            self._path, self._nearest = path, 0
            self.along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path[:, :2], axis=0).T))])
        begin = self._nearest if np.isfinite(self._search) else 0
        end = int(np.searchsorted(self.along, self.along[begin] + self._search, side="right"))
        self._nearest = begin + int(np.argmin(self._distances(path[begin:end])))
        return self._nearest

    def _distances(self, poses: NDArray[np.float64]) -> NDArray[np.float64]:
        x, y, yaw = self._robot.pose
        distances: NDArray[np.float64] = np.hypot(*(poses[:, :2] - np.array([x, y])).T)
        if self._angular_weight:
            turns = np.abs(np.angle(np.exp(1j * (poses[:, 2] - yaw))))
            distances = np.hypot(distances, self._angular_weight * turns)
        return distances


class PathKeeper:
    """Keeps a path that is nearly driven and still free.

    Args:
        distance: Remaining length below which a path may be kept, m.
        robot: Where the robot is.
        validity: Says whether the rest is free.
    """

    def __init__(self, distance: float, robot: RobotOnMap, validity: PathValidity) -> None:
        self._distance, self._validity = distance, validity
        self._nearest = NearestPose(robot, SEARCH)

    def keeps(self, path: Any) -> bool:
        """Return whether a path, ``(n, 3)`` on the map, is shorter than the distance from here on, and free."""
        if not len(path):
            return False
        nearest = self._nearest.on(path)
        remaining = self._nearest.along[-1] - self._nearest.along[nearest]
        return bool(remaining < self._distance) and self._validity.is_free(path[nearest:])
