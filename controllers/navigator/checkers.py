"""Checkers: whether the goal is reached, and whether the robot makes progress.

Source: nav2_controller (Humble and Jazzy) plugins/simple_goal_checker.cpp, stopped_goal_checker.cpp,
position_goal_checker.cpp (Jazzy), simple_progress_checker.cpp, pose_progress_checker.cpp.
"""

from __future__ import annotations

import math
from typing import Protocol

from controllers.base import Twist
from controllers.checkers import GoalChecker as GoalCheckerParams
from controllers.checkers import ProgressChecker as ProgressCheckerParams
from controllers.navigator.rate import TIME_RESOLUTION
from gym_mapbench.world.scenario import Pose, wrap_angle


class GoalChecker(Protocol):
    """Says whether a goal pose is reached."""

    def reset(self) -> None:
        """Forget what was reached."""
        ...

    def is_goal_reached(self, pose: Pose, goal: Pose, velocity: Twist) -> bool:
        """Return whether the robot at ``pose``, moving with ``velocity``, is at ``goal``."""
        ...


class ProgressChecker(Protocol):
    """Says whether the robot makes progress."""

    def reset(self) -> None:
        """Begin anew with the next pose."""
        ...

    def check(self, pose: Pose, now: float) -> bool:
        """Return False when there was no progress for too long; ``now`` in s."""
        ...


class SimpleGoalChecker:
    """Wants the position within one tolerance, then the heading within another.

    Args:
        params: The tolerances, and ``stateful``: whether a position once reached counts until the next path.
    """

    def __init__(self, params: GoalCheckerParams) -> None:
        self._params = params
        self._position_reached = False

    def reset(self) -> None:
        """Forget that the position was reached."""
        self._position_reached = False

    def is_goal_reached(self, pose: Pose, goal: Pose, velocity: Twist) -> bool:
        """Return whether the robot at ``pose`` is at ``goal``, whatever its velocity."""
        if not self._is_position_reached(pose, goal):
            return False
        params = self._params
        error = abs(wrap_angle(goal.yaw - pose.yaw))
        if params.symmetric_yaw_tolerance:
            error = min(error, abs(wrap_angle(goal.yaw + math.pi - pose.yaw)))
        return error <= params.yaw_goal_tolerance

    def _is_position_reached(self, pose: Pose, goal: Pose) -> bool:
        """Whether the robot is within the tolerance, or was before and that still counts."""
        if self._position_reached:
            return True
        dx, dy = pose.x - goal.x, pose.y - goal.y
        if dx * dx + dy * dy > self._params.xy_goal_tolerance * self._params.xy_goal_tolerance:
            return False
        self._position_reached = self._params.stateful
        return True


class StoppedGoalChecker(SimpleGoalChecker):
    """A :class:`SimpleGoalChecker` that also wants the robot to stand still."""

    def is_goal_reached(self, pose: Pose, goal: Pose, velocity: Twist) -> bool:
        """Return whether the robot stands at ``goal``."""
        return (
            super().is_goal_reached(pose, goal, velocity)
            and abs(velocity.w) <= self._params.rot_stopped_velocity
            and abs(velocity.v) <= self._params.trans_stopped_velocity
        )


class PositionGoalChecker(SimpleGoalChecker):
    """Wants the position alone (Jazzy)."""

    def is_goal_reached(self, pose: Pose, goal: Pose, velocity: Twist) -> bool:
        """Return whether the robot at ``pose`` is at ``goal``, whatever its heading."""
        return self._is_position_reached(pose, goal)


class SimpleProgressChecker:
    """Wants the robot to leave a circle around its baseline pose within a time; the baseline then moves with it.

    Args:
        params: Radius of the circle, and the time.
    """

    def __init__(self, params: ProgressCheckerParams) -> None:
        self._params = params
        self._baseline: Pose | None = None
        self._since = 0.0

    def reset(self) -> None:
        """Take the next pose as the baseline."""
        self._baseline = None

    def check(self, pose: Pose, now: float) -> bool:
        """Return False when the robot stayed around the baseline for longer than allowed."""
        if self._baseline is None or self._moved(self._baseline, pose):
            self._baseline, self._since = pose, now
            return True
        return now - self._since <= self._params.movement_time_allowance + TIME_RESOLUTION

    def _moved(self, baseline: Pose, pose: Pose) -> bool:
        return math.hypot(pose.x - baseline.x, pose.y - baseline.y) > self._params.required_movement_radius


class PoseProgressChecker(SimpleProgressChecker):
    """A :class:`SimpleProgressChecker` that counts a turn as progress as well."""

    def _moved(self, baseline: Pose, pose: Pose) -> bool:
        turned = abs(wrap_angle(pose.yaw - baseline.yaw)) > self._params.required_movement_angle
        return turned or super()._moved(baseline, pose)


class NoProgressChecker:
    """Lets the robot stand still for ever: progress is not checked."""

    def reset(self) -> None:
        """Do nothing: there is nothing to forget."""

    def check(self, pose: Pose, now: float) -> bool:
        """Return True."""
        return True


def make_goal_checker(params: GoalCheckerParams) -> GoalChecker:
    """Make the goal checker that ``plugin`` names."""
    kinds = {"simple": SimpleGoalChecker, "stopped": StoppedGoalChecker, "position": PositionGoalChecker}
    return kinds[params.plugin](params)


def make_progress_checker(params: ProgressCheckerParams) -> ProgressChecker:
    """Make the progress checker that ``plugin`` names."""
    if params.plugin == "none":
        return NoProgressChecker()
    return PoseProgressChecker(params) if params.plugin == "pose" else SimpleProgressChecker(params)
