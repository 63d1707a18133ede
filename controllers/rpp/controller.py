"""RppFollower: Nav2's Regulated Pure Pursuit as a path follower."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from controllers.base import ControllerError, FollowerSetup, Twist
from controllers.rpp import kernels
from controllers.rpp.params import RppParams
from gym_mapbench.costmap import Costmap
from gym_mapbench.scenario import Pose

# As Nav2 words them, so that logs of both compare.
REASONS = {
    kernels.EMPTY_PLAN: "Resulting plan has 0 poses in it.",
    kernels.OFF_COSTMAP: "Costmap is too small to fully include the robot's footprint: increase its size.",
    kernels.COLLISION_AHEAD: "RegulatedPurePursuitController detected collision ahead!",
}

TUNING = np.dtype(
    [
        *(
            (name, np.bool_ if field.annotation is bool else np.float64)
            for name, field in RppParams.model_fields.items()
        ),
        *(
            (name, np.float64)
            for name in ("control_period", "xy_goal_tolerance", "inscribed_radius", "circumscribed_radius")
        ),
    ],
    align=True,
)
"""Parameters as the kernels take them; ``max_robot_pose_search_dist`` is NaN for half the costmap."""


class RppFollower:
    """Regulated Pure Pursuit (Nav2 Humble).

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

    def move_plan(self, path: NDArray[np.float64]) -> None:
        """Take the same plan where it lies by now; what is behind stays behind."""
        self._path = path

    def set_speed_limit(self, speed: float, percentage: bool = False) -> None:
        """Limit the speed to ``speed`` m/s, or per cent of ``desired_linear_vel``; 0 lifts the limit."""
        base = self.params.desired_linear_vel
        limited = base * speed / 100.0 if percentage else float(speed)
        self._tuning["desired_linear_vel"] = limited if speed else base

    def compute_velocity_commands(self, pose: Pose, velocity: Twist, costmap: Costmap, now: float) -> Twist:
        """Return the next command; arguments as in :class:`controllers.base.PathFollower`.

        Raises:
            ControllerError: If the plan is empty, the robot is off the costmap, or the way to the carrot is blocked.
        """
        status, v, w, carrot_x, carrot_y, self._begin = kernels.follow(
            self._path,
            self._steps,
            self._begin,
            *pose,
            *velocity,
            costmap.costs,
            costmap.resolution,
            costmap.origin_x,
            costmap.origin_y,
            costmap.track_unknown_space,
            self._corners,
            self._tuning,
        )
        self.carrot = carrot_x, carrot_y
        if status != kernels.OK:
            raise ControllerError(REASONS[status])
        return Twist(v, w)

    def _forget_plan(self) -> None:
        self.set_plan(np.empty((0, 3)))
        self.carrot = math.nan, math.nan


def make_tuning(params: RppParams, setup: FollowerSetup) -> NDArray[np.void]:
    """Join the parameters with what the controller server tells the plugin: one record of :data:`TUNING`."""
    values = params.model_dump() | {
        "control_period": setup.control_period,
        "xy_goal_tolerance": setup.xy_goal_tolerance,
        "inscribed_radius": setup.footprint.inscribed_radius,
        "circumscribed_radius": setup.footprint.circumscribed_radius,
    }
    search_dist = params.max_robot_pose_search_dist
    if search_dist is None:
        values["max_robot_pose_search_dist"] = math.nan
    elif search_dist < 0:
        values["max_robot_pose_search_dist"] = math.inf
    # Nav2 switches reversing off, with a warning, where it could not tell it from a turn on the spot.
    values["allow_reversing"] = params.allow_reversing and not params.use_rotate_to_heading
    return np.array([tuple(values[name] for name in TUNING.fields or ())], dtype=TUNING)
