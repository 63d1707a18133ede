"""RppFollower: Nav2's Regulated Pure Pursuit as a path follower."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from controllers.base import ControllerAbort, ControllerError, FollowerSetup, InvalidPath, Twist
from controllers.local_plan import search_distance
from controllers.records import fill_groups, record_of
from controllers.rpp import kernels
from controllers.rpp.params import RppParams
from gym_mapbench.costmap import Costmap
from gym_mapbench.world.scenario import Pose

# The messages are worded as in Nav2, so that logs of both can be compared.
REASONS = {
    kernels.EMPTY_PLAN: "Resulting plan has 0 poses in it.",
    kernels.OFF_COSTMAP: "RegulatedPurePursuitController: Dimensions of the costmap are too small to encapsulate the "
    "robot footprint at current speeds!",
    kernels.SINGLE_POSE: "Received plan with length of one",
    kernels.COLLISION_AHEAD: "RegulatedPurePursuitController detected collision ahead!",
}

LATER_RULES = ("last_of_equals", "keeps_segment", "searches_width", "turns_are_cusps")
TUNING = record_of(
    RppParams,
    ("control_period", np.float64),
    ("xy_goal_tolerance", np.float64),
    ("inscribed_radius", np.float64),
    ("circumscribed_radius", np.float64),
    ("cost_at_radius", np.float64),
    *((rule, np.bool_) for rule in LATER_RULES),
)
"""The parameters in the form that kernels take, what the run adds, and what depends on the release: the cost that is
assumed for an obstacle at the inscribed radius, which of equally near poses is taken, whether the last segment of the
plan is kept, whether half the width of the costmap is searched rather than half of its larger side, and whether a turn
of the path on the spot is a cusp."""


class RppFollower:
    """Regulated Pure Pursuit.

    Args:
        params: Parameters; the defaults of Nav2's code if None.

    Attributes:
        carrot: The lookahead point of the last call in the robot frame, ``(x, y)`` m; NaN where there was none.
    """

    carrot: tuple[float, float]
    _tuning: NDArray[np.void]
    _corners: NDArray[np.float64]

    def __init__(self, params: RppParams | None = None) -> None:
        self.params = params or RppParams()
        self._forget_plan()

    def reset(self, setup: FollowerSetup) -> None:
        """Forget the plan, the speed limit and the carrot of the last run."""
        self._tuning = make_tuning(self.params, setup)
        self._corners = np.ascontiguousarray(setup.footprint.corners)
        self._forget_plan()

    def set_plan(self, path: NDArray[np.float64]) -> None:
        """Take a new global plan, ``(n, 3)`` x, y in m and yaw in rad, start to goal."""
        self._path = np.ascontiguousarray(path, dtype=np.float64)
        self._steps = np.hypot(*np.diff(self._path[:, :2], axis=0).T)
        self._begin = 0
        self._arrived = False

    def end_action(self) -> None:
        """Forget that the goal's position was reached (``reset``, which Jazzy calls when an action ends)."""
        self._arrived = False

    def move_plan(self, path: NDArray[np.float64]) -> None:
        """Take the same plan at its new place; poses that were passed stay passed."""
        self._path = path

    def set_speed_limit(self, speed: float, percentage: bool = False) -> None:
        """Limit the speed to ``speed`` m/s or per cent of ``desired_linear_vel``; 0 lifts the limit."""
        base = self.params.desired_linear_vel
        limited = base * speed / 100.0 if percentage else float(speed)
        self._tuning["desired_linear_vel"] = limited if speed else base

    def compute_velocity_commands(self, pose: Pose, velocity: Twist, costmap: Costmap, now: float) -> Twist:
        """Return the next command; arguments as in :class:`controllers.base.PathFollower`.

        Raises:
            ControllerError: If the way to the carrot is blocked; in Humble also in the following cases.
            InvalidPath: If the plan is empty, or has only one pose where a segment is needed.
            ControllerAbort: If the robot is off the costmap.
        """
        status, v, w, carrot_x, carrot_y, self._begin, self._arrived = kernels.follow(
            self._path, self._steps, self._begin, self._arrived, *pose, *velocity,
            *costmap.grid, costmap.track_unknown_space, self._corners, self._tuning,
        )  # fmt: skip
        self.carrot = carrot_x, carrot_y
        if status != kernels.OK:
            raise self._error_of(status)(REASONS[status])
        return Twist(v, w)

    def _error_of(self, status: int) -> type[ControllerError | ControllerAbort]:
        """Return the error that a failure is in this release."""
        if self.params.release == "humble" or status == kernels.COLLISION_AHEAD:
            return ControllerError
        return ControllerAbort if status == kernels.OFF_COSTMAP else InvalidPath

    def _forget_plan(self) -> None:
        self.set_plan(np.empty((0, 3)))
        self.carrot = math.nan, math.nan


def make_tuning(params: RppParams, setup: FollowerSetup) -> NDArray[np.void]:
    """Join the parameters with what the controller server tells the plugin: one record of :data:`TUNING`."""
    humble, tuning = params.release == "humble", np.zeros(1, dtype=TUNING)
    fill_groups(tuning, params)
    tuning["control_period"] = setup.control_period
    tuning["xy_goal_tolerance"] = setup.xy_goal_tolerance
    tuning["inscribed_radius"] = setup.footprint.inscribed_radius
    tuning["circumscribed_radius"] = setup.footprint.circumscribed_radius
    tuning["cost_at_radius"] = 252.0 if humble else 253.0
    tuning["max_robot_pose_search_dist"] = search_distance(params.max_robot_pose_search_dist)
    if not params.use_fixed_curvature_lookahead:
        # Nav2 switches this off, with a warning (parameter_handler.cpp): only the second carrot can lie past the end.
        tuning["interpolate_curvature_after_goal"] = False
    for rule in LATER_RULES:
        tuning[rule] = not humble
    if not humble:
        tuning["use_interpolation"] = True
    elif params.use_rotate_to_heading:
        # Humble switches reversing off, with a warning, because it could not tell it from a turn on the spot.
        tuning["allow_reversing"] = False
    return tuning
