"""Goal checkers that only Lyrical has: along and across the path, and with a tolerance that adapts.

Source: nav2_controller (Lyrical) plugins/axis_goal_checker.cpp, adaptive_tolerance_goal_checker.cpp.
"""

from __future__ import annotations

import math

import numpy as np

from controllers.base import LocalPlan, Twist
from controllers.checkers import GoalChecker as GoalCheckerParams
from gym_mapbench.world.scenario import Pose, wrap_angle

APART = 1e-6
"""Distance from which on two poses give a direction, m."""


def is_heading_reached(pose: Pose, goal: Pose, params: GoalCheckerParams) -> bool:
    """Return whether the robot has the goal's heading, or the opposite one where that is as good."""
    error = abs(wrap_angle(goal.yaw - pose.yaw))
    if params.symmetric_yaw_tolerance:
        error = min(error, abs(wrap_angle(goal.yaw + math.pi - pose.yaw)))
    return error <= params.yaw_goal_tolerance


class AxisGoalChecker:
    """Wants the robot within one tolerance along the path's end and another across it, whatever its heading.

    Args:
        params: The tolerances, and ``is_overshoot_valid``.
    """

    def __init__(self, params: GoalCheckerParams) -> None:
        self._params = params

    def reset(self) -> None:
        """Do nothing: there is nothing to forget."""

    def is_goal_reached(self, pose: Pose, goal: Pose, velocity: Twist, local: LocalPlan | None = None) -> bool:
        """Return whether the robot is at ``goal``, seen along the end of the local plan."""
        return local is not None and self.is_position_reached(pose, local)

    def is_position_reached(self, pose: Pose, local: LocalPlan) -> bool:
        """Return whether the robot is at the goal's position, seen along the end of the local plan."""
        params, goal = self._params, local.goal
        if local.length > params.path_length_tolerance:
            return False
        dx, dy = goal.x - pose.x, goal.y - pose.y
        direction = _direction_at_end(local)
        if direction is None:
            return math.hypot(dx, dy) < math.hypot(params.along_path_tolerance, params.cross_track_tolerance)
        along = dx * math.cos(direction) + dy * math.sin(direction)
        across = dy * math.cos(direction) - dx * math.sin(direction)
        left = along if params.is_overshoot_valid else abs(along)
        return left < params.along_path_tolerance and abs(across) < params.cross_track_tolerance


def _direction_at_end(local: LocalPlan) -> float | None:
    """Direction (rad) to the goal from the last pose of the local plan that is not at the goal; None without one.

    As in Nav2 the very last pose is passed over, even where the local plan ends before the goal.
    """
    away = np.array([local.goal.x, local.goal.y]) - local.path[:-1, :2]
    apart = np.flatnonzero(np.hypot(*away.T) >= APART)
    if not len(apart):
        return None
    dx, dy = away[apart[-1]].tolist()
    return math.atan2(dy, dx)


class AdaptiveToleranceGoalChecker:
    """Wants the position within a fine tolerance, or a coarse one if the robot comes no nearer; then the heading.

    The call in which the robot comes within the coarse tolerance only begins to count. Later on the position counts as
    reached once the least distance has not fallen for ``required_stagnation_cycles`` calls, once the robot has stood
    for as many calls, or once it is at or past the line through the goal that is perpendicular to the direction from
    which it came. The calls of a controller count as well as those of the server.

    Args:
        params: The tolerances, and what counts as standing and as coming no nearer.
    """

    _entry: tuple[float, float] | None
    _least: float
    _stagnant: int
    _standing: int

    def __init__(self, params: GoalCheckerParams) -> None:
        self._params = params
        self.reset()

    def reset(self) -> None:
        """Forget that the position was reached, and how the robot came near."""
        self._position_reached = False
        self._velocity = Twist(0.0, 0.0)
        self._leave()

    def is_goal_reached(self, pose: Pose, goal: Pose, velocity: Twist, local: LocalPlan | None = None) -> bool:
        """Return whether the robot at ``pose``, moving with ``velocity``, is at ``goal``."""
        self._velocity = velocity
        far = local is not None and local.length > self._params.path_length_tolerance
        return not far and self._reach(pose, goal) and is_heading_reached(pose, goal, self._params)

    def is_position_reached(self, pose: Pose, local: LocalPlan) -> bool:
        """Return whether the goal's position is reached, at the velocity of the server's last call; the call counts."""
        return local.length <= self._params.path_length_tolerance and self._reach(pose, local.goal)

    def _reach(self, pose: Pose, goal: Pose) -> bool:
        """Whether the position is reached, or was before and that still counts."""
        if self._position_reached:
            return True
        params, distance = self._params, math.hypot(pose.x - goal.x, pose.y - goal.y)
        if params.fine_xy_goal_tolerance < distance > params.coarse_xy_goal_tolerance:
            self._leave()
            return False
        reached = distance <= params.fine_xy_goal_tolerance or self._comes_no_nearer(pose, goal, distance)
        self._position_reached = reached and params.stateful
        return reached

    def _comes_no_nearer(self, pose: Pose, goal: Pose, distance: float) -> bool:
        """Whether the robot within the coarse tolerance stagnates, stands or has passed the goal."""
        dx, dy = goal.x - pose.x, goal.y - pose.y
        if self._entry is None:
            self._entry, self._least = (dx, dy), distance
            return False
        self._stagnant = 0 if distance < self._least else self._stagnant + 1
        self._least = min(self._least, distance)
        self._standing = self._standing + 1 if self._stands() else 0
        passed = dx * self._entry[0] + dy * self._entry[1] <= 0.0
        return passed or max(self._stagnant, self._standing) >= self._params.required_stagnation_cycles

    def _stands(self) -> bool:
        slow = abs(self._velocity.v) <= self._params.trans_stopped_velocity
        return slow and abs(self._velocity.w) <= self._params.rot_stopped_velocity

    def _leave(self) -> None:
        """Forget how the robot came near."""
        self._entry = None
        self._least, self._stagnant, self._standing = math.inf, 0, 0
