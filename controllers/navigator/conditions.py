"""Leaves that ask a question and remember something from one tick to the next.

Source: nav2_behavior_tree (Humble, Jazzy and Lyrical) plugins/condition.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Generic, TypeVar

from controllers.navigator.behavior_tree import Question, Status
from controllers.navigator.decorators import between
from controllers.navigator.rate import TIME_RESOLUTION
from gym_mapbench.world.scenario import Pose

T = TypeVar("T")


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


class Passed(Question, Generic[T]):
    """Succeeds once enough lies between what is measured now and at the first tick or the last success.

    Args:
        measure: Returns what is measured.
        is_enough: Whether enough lies between an earlier and a later measurement.
    """

    def __init__(self, measure: Callable[[], T], is_enough: Callable[[T, T], bool]) -> None:
        self._measure, self._is_enough = measure, is_enough

    def tick(self) -> Status:
        """Measure, and compare."""
        now = self._measure()
        if self.status is Status.IDLE:
            self._start = now
            return Status.FAILURE
        if not self._is_enough(self._start, now):
            return Status.FAILURE
        self._start = now
        return Status.SUCCESS


def time_expired(seconds: float, clock: Callable[[], float]) -> Passed[float]:
    """Make ``TimeExpired``: some time has to pass, s."""
    return Passed(clock, lambda start, now: now - start >= seconds - TIME_RESOLUTION)


def distance_traveled(distance: float, pose: Callable[[], Pose]) -> Passed[Pose]:
    """Make ``DistanceTraveled``: the robot has to come some distance on the map, m."""
    return Passed(pose, lambda start, end: between(start, end) >= distance)


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
