"""Leaves that ask a question and remember something from one tick to the next.

Source: nav2_behavior_tree (Humble, Jazzy and Lyrical) plugins/condition.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from controllers.navigator.behavior_tree import Node, Status
from controllers.navigator.decorators import between
from controllers.navigator.rate import TIME_RESOLUTION
from gym_mapbench.world.scenario import Pose


class Question(Node):
    """A leaf that is never RUNNING."""

    def halt(self) -> None:
        """Do nothing: there is nothing to stop."""


class GlobalUpdatedGoal(Question):
    """Succeeds at its first tick, when the goal is new, and fails then: the goal does not change."""

    def __init__(self) -> None:
        self._has_goal = False

    def tick(self) -> Status:
        """Say whether the goal is new."""
        if self._has_goal:
            return Status.FAILURE
        self._has_goal = True
        return Status.SUCCESS


class TimeExpired(Question):
    """Succeeds once some time has passed since its first tick or its last success.

    Args:
        seconds: The time, s.
        clock: Returns the time, s.
    """

    def __init__(self, seconds: float, clock: Callable[[], float]) -> None:
        self._seconds, self._clock = seconds, clock

    def tick(self) -> Status:
        """Say whether the time has passed."""
        now = self._clock()
        if self.status is Status.IDLE:
            self._start = now
            return Status.FAILURE
        if now - self._start < self._seconds - TIME_RESOLUTION:
            return Status.FAILURE
        self._start = now
        return Status.SUCCESS


class DistanceTraveled(Question):
    """Succeeds once the robot is some distance from where it was at the first tick or the last success.

    Args:
        distance: The distance, m.
        pose: Returns the pose of the robot on the map.
    """

    def __init__(self, distance: float, pose: Callable[[], Pose]) -> None:
        self._distance, self._pose = distance, pose

    def tick(self) -> Status:
        """Say whether the robot has come that far."""
        pose = self._pose()
        if self.status is Status.IDLE:
            self._start = pose
            return Status.FAILURE
        if between(self._start, pose) < self._distance:
            return Status.FAILURE
        self._start = pose
        return Status.SUCCESS


class PathExpiringTimer(Question):
    """Succeeds once a path is some time old; halts do not change that.

    Args:
        seconds: The time, s.
        path: Returns the path.
        clock: Returns the time, s.
    """

    def __init__(self, seconds: float, path: Callable[[], Any], clock: Callable[[], float]) -> None:
        self._seconds, self._path, self._clock = seconds, path, clock
        self._seen: Any = None

    def tick(self) -> Status:
        """Say whether the path is that old."""
        now, path = self._clock(), self._path()
        first = self._seen is None
        if path is not self._seen:
            self._seen, self._start = path, now
        if first or now - self._start < self._seconds - TIME_RESOLUTION:
            return Status.FAILURE
        self._start = now
        return Status.SUCCESS
