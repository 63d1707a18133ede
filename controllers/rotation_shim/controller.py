"""RotationShimFollower: Nav2's Rotation Shim Controller as a path follower around another.

Source: nav2_rotation_shim_controller: src/nav2_rotation_shim_controller.cpp (Humble, Jazzy and Lyrical).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.base import FollowerSetup, PathFollower, Twist
from controllers.checkers import GoalChecker
from controllers.navigator.checkers import PositionGoalChecker
from controllers.rotation_shim.kernels import turn_is_free
from controllers.rotation_shim.params import RotationShimParams
from controllers.rpp.regulation import reachable_turn_rate, rotation_speed
from gym_mapbench.costmap import LETHAL_OBSTACLE, Costmap
from gym_mapbench.errors import ConfigError
from gym_mapbench.world.scenario import Pose, wrap_angle


class RotationShimFollower:
    """Turns on the spot towards a new path, and lets another controller follow it.

    Args:
        make_primary: Makes the primary controller from the same parameters.
        params: Parameters of both.

    Attributes:
        primary: The primary controller, which follows the path.
    """

    _setup: FollowerSetup
    _goal: tuple[float, ...] | None
    _at_goal: PositionGoalChecker

    def __init__(self, make_primary: Callable[[Any], PathFollower], params: RotationShimParams) -> None:
        self.params = params
        self.primary = make_primary(params.of_primary())
        self._forget_run()

    def reset(self, setup: FollowerSetup) -> None:
        """Forget everything of the last run."""
        self._setup = setup
        self._at_goal = PositionGoalChecker(GoalChecker(xy_goal_tolerance=setup.xy_goal_tolerance))
        self._corners = np.ascontiguousarray(setup.footprint.corners)
        self.primary.reset(setup)
        self._forget_run()

    def set_plan(self, path: NDArray[np.float64]) -> None:
        """Take a new global plan, ``(n, 3)`` x, y in m and yaw in rad, start to goal."""
        goal = tuple(path[-1].tolist()) if len(path) else None
        same_goal = not self._turns and goal is not None and goal == self._goal
        self._looks_at_path = not (self.params.rotate_to_heading_once and same_goal)
        self._path, self._goal = path, goal
        self.primary.set_plan(path)
        self._at_goal.reset()

    def move_plan(self, path: NDArray[np.float64]) -> None:
        """Take the same plan at its new place; nothing is forgotten."""
        self._path = path
        self.primary.move_plan(path)

    def set_speed_limit(self, speed: float, percentage: bool) -> None:
        """Limit the speed of the primary; turns on the spot have no limit, as in Nav2.

        Raises:
            ConfigError: If the primary takes no speed limits.
        """
        limit = getattr(self.primary, "set_speed_limit", None)
        if limit is None:
            raise ConfigError("speed limit: expected a primary controller with set_speed_limit")
        limit(speed, percentage)

    def end_action(self) -> None:
        """Forget the last turn rate (``reset``, which Jazzy calls when an action ends); the primary forgets as well."""
        self._last_turn_rate = 0.0
        self._at_goal.reset()
        forget = getattr(self.primary, "end_action", None)
        if forget is not None:
            forget()

    def compute_velocity_commands(self, pose: Pose, velocity: Twist, costmap: Costmap, now: float) -> Twist:
        """Return the next command; see :class:`~controllers.base.PathFollower`. Errors are those of the primary."""
        turn_rate = self._turn_at_goal(pose, velocity, costmap)
        if turn_rate is None:
            turn_rate = self._turn_to_path(pose, velocity, costmap)
        if turn_rate is None:
            self._turns = False
            command = self.primary.compute_velocity_commands(pose, velocity, costmap, now)
        else:
            command = Twist(0.0, turn_rate)
        self._last_turn_rate = command.w
        return command

    def _turn_at_goal(self, pose: Pose, velocity: Twist, costmap: Costmap) -> float | None:
        """Turn rate to the goal's heading; None if the robot is not at the goal or the turn is blocked."""
        if not self.params.rotate_to_goal_heading or not len(self._path):
            return None
        goal = Pose(*self._path[-1].tolist())
        if not self._at_goal.is_goal_reached(pose, goal, velocity):
            return None
        return self._free_turn(wrap_angle(goal.yaw - pose.yaw), pose, velocity, costmap)

    def _turn_to_path(self, pose: Pose, velocity: Twist, costmap: Costmap) -> float | None:
        """Turn rate towards a path that the robot does not face yet; None hands over until the next path."""
        if not self._looks_at_path:
            return None
        angle, params = self._angle_to_path(pose), self.params
        threshold = params.angular_disengage_threshold if self._turns else params.angular_dist_threshold
        turn_rate = None
        if angle is not None and abs(angle) > threshold:
            self._turns = True
            turn_rate = self._free_turn(angle, pose, velocity, costmap)
        self._looks_at_path = turn_rate is not None
        return turn_rate

    def _angle_to_path(self, pose: Pose) -> float | None:
        """Angle between the robot's heading and the path's, rad; None where the path is too short to tell."""
        if len(self._path) < 2:
            return None
        away = np.hypot(*(self._path[1:, :2] - self._path[0, :2]).T)
        far = np.flatnonzero(away >= self.params.forward_sampling_distance)
        if not len(far) and self.params.release == "humble":
            return None
        x, y, yaw = self._path[far[0] + 1 if len(far) else -1].tolist()
        if self.params.use_path_orientations:
            return wrap_angle(yaw - pose.yaw)
        return wrap_angle(math.atan2(y - pose.y, x - pose.x) - pose.yaw)

    def _free_turn(self, angle: float, pose: Pose, velocity: Twist, costmap: Costmap) -> float | None:
        """Turn rate on the spot for an angle, None if the robot would touch something; Humble may overshoot."""
        params, period = self.params, self._setup.control_period
        law = reachable_turn_rate if params.release == "humble" else rotation_speed
        current = velocity.w if params.closed_loop else self._last_turn_rate
        top, accel = params.rotate_to_heading_angular_vel, params.max_angular_accel
        turn_rate = float(law(angle, current, top, accel, period))
        max_cost = LETHAL_OBSTACLE if params.max_cost_threshold is None else params.max_cost_threshold
        is_free = turn_is_free(
            (*costmap.grid, costmap.track_unknown_space), self._corners, *map(float, pose), turn_rate,
            abs(angle) - params.angular_dist_threshold, period, params.simulate_ahead_time, float(max_cost),
        )  # fmt: skip
        return turn_rate if is_free else None

    def _forget_run(self) -> None:
        self._path = np.empty((0, 3))
        self._goal = None
        self._looks_at_path = self._turns = False
        self._last_turn_rate = 0.0
