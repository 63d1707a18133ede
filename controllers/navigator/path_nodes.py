"""Nodes that look at where the robot is on its path.

Source: nav2_behavior_tree (Humble and Lyrical) truncate_path_local_action.cpp, is_goal_nearby_condition.cpp; nav2_util
geometry_utils.hpp.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.navigator.behavior_tree import Status
from controllers.navigator.conditions import Question
from controllers.navigator.path_keeper import NearestPose


class IsGoalNearby(Question):
    """Succeeds where the path from the pose nearest to the robot on is shorter than some length.

    Args:
        path: Returns the path.
        threshold: The length, m.
        nearest: Finds the nearest pose.
    """

    def __init__(self, path: Callable[[], Any], threshold: float, nearest: NearestPose) -> None:
        self._path, self._threshold, self._nearest = path, threshold, nearest

    def tick(self) -> Status:
        """Measure the rest of the path."""
        path = self._path()
        if not len(path):
            return Status.FAILURE
        index = self._nearest.on(path)
        rest = self._nearest.along[-1] - self._nearest.along[index]
        return Status.SUCCESS if rest < self._threshold else Status.FAILURE


class TruncatePathLocal(Question):
    """Writes the part of a path around the pose nearest to the robot.

    Args:
        path: Returns the path.
        write: Takes the part; it is the same object as long as it is the same part of the same path.
        forward: Length of path after the nearest pose, m.
        backward: Length of path before the nearest pose, m.
        nearest: Finds the nearest pose.
    """

    def __init__(
        self,
        path: Callable[[], Any],
        write: Callable[[Any], None],
        forward: float,
        backward: float,
        nearest: NearestPose,
    ) -> None:
        self._path, self._write, self._nearest = path, write, nearest
        self._forward, self._backward = forward, backward
        self._cut: tuple[Any, int, int] = (None, 0, 0)

    def tick(self) -> Status:
        """Cut the path."""
        path = self._path()
        if not len(path):
            self._write(path)
            return Status.SUCCESS
        index = self._nearest.on(path)
        ahead = self._nearest.along[index:] - self._nearest.along[index]
        behind = self._nearest.along[index] - self._nearest.along[index::-1]
        begin, end = index + 1 - count_within(behind, self._backward), index + count_within(ahead, self._forward)
        source, *bounds = self._cut
        if source is not path or bounds != [begin, end]:
            self._cut = path, begin, end
            self._write(path[begin:end])
        return Status.SUCCESS


def count_within(lengths: NDArray[np.float64], most: float) -> int:
    """Return how many of the ascending lengths come before the first that is longer than ``most``."""
    return int(np.searchsorted(lengths, most, side="right"))
