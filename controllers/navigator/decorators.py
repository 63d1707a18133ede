"""Nodes with one child: what they make of its result, and when they tick it.

Source: nav2_behavior_tree (Humble, Jazzy and Lyrical) plugins/decorator; BehaviorTree.CPP 3.8 for the general ones.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable

from controllers.base import Twist
from controllers.navigator.behavior_tree import MOST_ROUNDS, Control, Node, Status
from controllers.navigator.rate import TIME_RESOLUTION, Clock
from gym_mapbench.world.scenario import Pose

SMOOTHED = 0.3
"""Time over which the navigator averages the measured speed, s."""


class Returning(Control):
    """Returns something else when its child ends: ``Inverter``, ``ForceSuccess`` and the like.

    Args:
        child: The child.
        after_success: What is returned after a success.
        after_failure: What is returned after a failure.
    """

    def __init__(self, child: Node, after_success: Status, after_failure: Status) -> None:
        super().__init__(child)
        self._after_success, self._after_failure = after_success, after_failure

    def tick(self) -> Status:
        """Tick the child."""
        (child,) = self.children
        status = child.execute_tick()
        if status is Status.RUNNING:
            return status
        child.stop()
        return self._after_success if status is Status.SUCCESS else self._after_failure


class Again(Control):
    """Ticks its child again after one result, and ends with another: ``RetryUntilSuccessful`` and ``Repeat``.

    Args:
        child: The child.
        after: The result after which the child is ticked again; it is the node's own after the last time.
        times: Number of times; -1 for no end.
        clock: What is woken when the node is RUNNING between two times, which it is since Jazzy if the child ended in
            its first tick; None for a node that ticks the child again itself.
    """

    def __init__(self, child: Node, after: Status, times: int, clock: Clock | None = None) -> None:
        super().__init__(child)
        self._after, self._times = after, times if times >= 0 else math.inf
        self._clock = clock
        self._count = 0

    def tick(self) -> Status:
        """Tick the child until it is RUNNING or the node ends."""
        (child,) = self.children
        for _ in range(MOST_ROUNDS):
            first = child.status is Status.IDLE
            status = child.execute_tick()
            if status is Status.RUNNING:
                return status
            child.stop()
            if status is not self._after:
                self._count = 0
                return status
            self._count += 1
            if self._count >= self._times:
                self._count = 0
                return status
            if self._clock is not None and first:
                self._clock.is_woken = True
                break
        return Status.RUNNING

    def halt(self) -> None:
        """Stop the child and count from 0."""
        super().halt()
        self._count = 0


class SingleTrigger(Control):
    """Ticks its child until that has ended once; then it fails, until it has been halted."""

    def __init__(self, child: Node) -> None:
        super().__init__(child)
        self._has_ended = False

    def tick(self) -> Status:
        """Tick the child, if it has not ended."""
        if self.status is Status.IDLE:
            self._has_ended = False
        if self._has_ended:
            return Status.FAILURE
        status = self.children[0].execute_tick()
        self._has_ended = status is not Status.RUNNING
        return status


class GoalUpdatedController(Control):
    """Ticks its child at first and while that is RUNNING, but not again: the goal does not change."""

    def tick(self) -> Status:
        """Tick the child if it is due."""
        (child,) = self.children
        if self.status is Status.IDLE or child.status is Status.RUNNING:
            return child.execute_tick()
        return Status.RUNNING


class DistanceController(Control):
    """Ticks its child at first, while that is RUNNING, and each time the robot has come some distance.

    Args:
        child: The child.
        distance: From where the robot was when the child last succeeded, m.
        pose: Returns the pose of the robot on the map.
    """

    def __init__(self, child: Node, distance: float, pose: Callable[[], Pose]) -> None:
        super().__init__(child)
        self._distance, self._pose = distance, pose

    def tick(self) -> Status:
        """Tick the child if it is due."""
        (child,) = self.children
        first = self.status is Status.IDLE
        if first:
            self._start = self._pose()
        if not (first or child.status is Status.RUNNING or between(self._start, self._pose()) >= self._distance):
            return Status.RUNNING
        status = child.execute_tick()
        if status is Status.SUCCESS:
            self._start = self._pose()
        return status


class SpeedController(Control):
    """Ticks its child at first, while that is RUNNING, and at a rate that grows with the speed of the robot.

    The speed is the mean of those measured in the last 0.3 s, one a tick.

    Args:
        child: The child.
        rates: Lowest and highest rate, Hz.
        speeds: The speeds that they belong to, m/s.
        clock: Returns the time, s.
        velocity: Returns the measured velocity.
    """

    def __init__(
        self,
        child: Node,
        rates: tuple[float, float],
        speeds: tuple[float, float],
        clock: Callable[[], float],
        velocity: Callable[[], Twist],
    ) -> None:
        super().__init__(child)
        self._rates, self._speeds = rates, speeds
        self._clock, self._velocity = clock, velocity
        self._seen: deque[tuple[float, float]] = deque()

    def tick(self) -> Status:
        """Tick the child if it is due."""
        (child,) = self.children
        now, first = self._clock(), self.status is Status.IDLE
        self._seen.append((now, self._velocity().v))
        if first:
            self._start, self._period = now, 1.0 / self._rates[1]
        due = now - self._start >= self._period - TIME_RESOLUTION
        if not (first or due or child.status is Status.RUNNING):
            return Status.RUNNING
        if due:
            self._start, self._period = now, 1.0 / self._rate(now)
        return child.execute_tick()

    def _rate(self, now: float) -> float:
        """Return the rate at the present speed, Hz."""
        while self._seen[0][0] < now - SMOOTHED - TIME_RESOLUTION:
            self._seen.popleft()
        speed = abs(sum(v for _, v in self._seen) / len(self._seen))
        (slowest, fastest), (low, high) = self._rates, self._speeds
        return max(min((speed - low) / (high - low) * (fastest - slowest) + slowest, fastest), slowest)


def between(start: Pose, end: Pose) -> float:
    """Return the distance of two poses, m."""
    return math.hypot(end.x - start.x, end.y - start.y)
