"""Checkers: whether the goal is reached, and whether the robot makes progress.

Source: nav2_controller (Humble, Jazzy and Lyrical) plugins/simple_goal_checker.cpp, stopped_goal_checker.cpp,
position_goal_checker.cpp, simple_progress_checker.cpp, pose_progress_checker.cpp.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Protocol

from controllers.base import GoalChecker, LocalPlan, Twist
from controllers.checkers import GoalChecker as GoalCheckerParams
from controllers.checkers import ProgressChecker as ProgressCheckerParams
from controllers.navigator.lyrical_goal_checkers import (
    AdaptiveToleranceGoalChecker,
    AxisGoalChecker,
    is_heading_reached,
)
from controllers.navigator.rate import TIME_RESOLUTION
from gym_mapbench.world.scenario import Pose, wrap_angle


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

    def is_goal_reached(self, pose: Pose, goal: Pose, velocity: Twist, local: LocalPlan | None = None) -> bool:
        """Return whether the robot at ``pose`` is at ``goal``, whatever its velocity."""
        if self._is_far_along(local) or not self._is_position_reached(pose, goal):
            return False
        return is_heading_reached(pose, goal, self._params)

    def is_position_reached(self, pose: Pose, local: LocalPlan) -> bool:
        """Return whether the robot is at the goal's position; if ``stateful``, this is remembered."""
        return not self._is_far_along(local) and self._is_position_reached(pose, local.goal)

    def _is_far_along(self, local: LocalPlan | None) -> bool:
        """Whether too much of the local plan is left (Lyrical)."""
        return local is not None and local.length > self._params.path_length_tolerance

    def _is_position_reached(self, pose: Pose, goal: Pose) -> bool:
        """Whether the robot is within the tolerance, or was before and that still counts."""
        dx, dy = pose.x - goal.x, pose.y - goal.y
        tolerance, buffer = self._params.xy_goal_tolerance, self._params.xy_goal_tolerance_buffer
        if self._position_reached and buffer > 0.0:
            self._position_reached = math.hypot(dx, dy) <= tolerance + buffer
        if self._position_reached:
            return True
        if dx * dx + dy * dy > tolerance * tolerance:
            return False
        self._position_reached = self._params.stateful
        return True


class StoppedGoalChecker(SimpleGoalChecker):
    """A :class:`SimpleGoalChecker` that also wants the robot to stand still."""

    def is_goal_reached(self, pose: Pose, goal: Pose, velocity: Twist, local: LocalPlan | None = None) -> bool:
        """Return whether the robot stands at ``goal``."""
        return (
            super().is_goal_reached(pose, goal, velocity, local)
            and abs(velocity.w) <= self._params.rot_stopped_velocity
            and abs(velocity.v) <= self._params.trans_stopped_velocity
        )


class PositionGoalChecker(SimpleGoalChecker):
    """Wants the position alone."""

    def is_goal_reached(self, pose: Pose, goal: Pose, velocity: Twist, local: LocalPlan | None = None) -> bool:
        """Return whether the robot at ``pose`` is at ``goal``, whatever its heading."""
        return not self._is_far_along(local) and self._is_position_reached(pose, goal)


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


GOAL_CHECKERS: dict[str, Callable[[GoalCheckerParams], GoalChecker]] = {
    "simple": SimpleGoalChecker,
    "stopped": StoppedGoalChecker,
    "position": PositionGoalChecker,
    "axis": AxisGoalChecker,
    "adaptive": AdaptiveToleranceGoalChecker,
}
"""Name of a goal checker -> makes it."""


def make_goal_checker(params: GoalCheckerParams) -> GoalChecker:
    """Make the goal checker that ``plugin`` names."""
    return GOAL_CHECKERS[params.plugin](params)


def make_progress_checker(params: ProgressCheckerParams) -> ProgressChecker:
    """Make the progress checker that ``plugin`` names."""
    if params.plugin == "none":
        return NoProgressChecker()
    return PoseProgressChecker(params) if params.plugin == "pose" else SimpleProgressChecker(params)
