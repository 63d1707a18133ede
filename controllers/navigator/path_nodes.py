"""Nodes that look at a path, or at where the robot is on it.

Source: nav2_behavior_tree (Humble and Lyrical) truncate_path_local_action.cpp, truncate_path_action.cpp,
is_goal_nearby_condition.cpp, path_longer_on_approach.cpp; nav2_util geometry_utils.hpp.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.navigator.behavior_tree import Control, Node, Question, Status
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
        write: Takes the part at each tick; it is the same object as long as it is the same part of the same path.
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
        self._part: Any = None

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
            self._cut, self._part = (path, begin, end), path[begin:end]
        self._write(self._part)
        return Status.SUCCESS


class TruncatePath(Question):
    """Writes a path without its end; the last pose that is left looks at the end.

    Args:
        path: Returns the path.
        write: Takes the path without its end at each tick; it is the same object as long as the path is.
        distance: Straight distance from the end up to which poses are left out, m; two poses always remain.
    """

    def __init__(self, path: Callable[[], Any], write: Callable[[Any], None], distance: float) -> None:
        self._path, self._write, self._distance = path, write, distance
        self._source: Any = None
        self._rest: Any = None

    def tick(self) -> Status:
        """Cut the path."""
        path = self._path()
        if path is not self._source:
            self._source, self._rest = path, self._cut(path) if len(path) else path
        self._write(self._rest)
        return Status.SUCCESS

    def _cut(self, path: NDArray[np.float64]) -> NDArray[np.float64]:
        to_end = path[-1, :2] - path[:, :2]
        is_far = np.hypot(*to_end.T) >= self._distance
        count = max(2, int(np.flatnonzero(is_far)[-1]) + 1 if is_far.any() else 0)
        cut = path[:count].copy()
        cut[-1, 2] = np.arctan2(*to_end[len(cut) - 1, ::-1])
        return cut


class PathLongerOnApproach(Control):
    """Ticks its child when a new path to the same goal is much longer than the path before, which was short.

    Until the child ends, the path before it remains the one that newer paths are compared with. Otherwise the node
    succeeds. Its memory survives halts.

    Args:
        child: The child.
        path: Returns the newest path.
        proximity: Length below which a path is short, m.
        factor: Ratio of the lengths above which the new path is much longer.
    """

    def __init__(self, child: Node, path: Callable[[], Any], proximity: float, factor: float) -> None:
        super().__init__(child)
        self._path, self._proximity, self._factor = path, proximity, factor
        self._old: Any = ()
        self._is_first = True

    def tick(self) -> Status:
        """Compare the paths, and tick the child if that is due."""
        (child,), new = self.children, self._path()
        self._is_first = self._is_first or not (len(self._old) and len(new) and (self._old[-1] == new[-1]).all())
        status = child.execute_tick() if not self._is_first and self._is_longer(new) else None
        if status is Status.RUNNING:
            return status
        self._old = new
        if status is None:
            self._is_first = False
            return Status.SUCCESS
        child.stop()
        return status

    def _is_longer(self, new: NDArray[np.float64]) -> bool:
        """Whether a path has another number of poses than the one before, and is much longer than that short one."""
        old = length_of(self._old)
        return len(new) != len(self._old) and old < self._proximity and length_of(new) > self._factor * old


def length_of(path: NDArray[np.float64]) -> float:
    """Return the length of a path with poses, m."""
    return float(np.hypot(*np.diff(path[:, :2], axis=0).T).sum())


def count_within(lengths: NDArray[np.float64], most: float) -> int:
    """Return how many of the ascending lengths come before the first that is longer than ``most``."""
    return int(np.searchsorted(lengths, most, side="right"))
