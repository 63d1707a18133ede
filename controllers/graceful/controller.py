"""GracefulFollower: Nav2's Graceful Controller as a path follower."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from controllers.base import ControllerAbort, ControllerError, FollowerSetup, InvalidPath, Twist
from controllers.graceful.kernels import following
from controllers.graceful.params import GracefulParams
from controllers.local_plan import search_distance
from controllers.records import fill_groups, record_of
from gym_mapbench.costmap import Costmap
from gym_mapbench.world.scenario import Pose

# The messages are worded as in Nav2, so that logs of both can be compared.
REASONS = {
    "humble": {
        following.EMPTY_PLAN: "Resulting plan has 0 poses in it.",
        following.COLLISION: "Collision detected in the trajectory",
    },
    "jazzy": {
        following.EMPTY_PLAN: "Resulting plan has 0 poses in it.",
        following.COLLISION: "Collision detected in trajectory",
    },
}
REASONS["lyrical"] = REASONS["jazzy"]

JAZZYS_RULES = ("last_of_equals", "adds_headings", "takes_farthest")
TUNING = record_of(
    GracefulParams,
    ("sharpness", np.float64),
    ("xy_goal_tolerance", np.float64),
    ("keeps_segment", np.bool_),
    ("searches_width", np.bool_),
    ("can_stop", np.bool_),
    *((rule, np.bool_) for rule in JAZZYS_RULES),
)
"""The parameters in the form that kernels take, ``lambda`` under the name ``sharpness`` too, the goal checker's
tolerance (m), and what depends on the release: which of equally near poses is taken,
whether poses without headings of their own get them, whether the target is the farthest that can be reached,
and whether the robot is slow enough to stop at the target."""


class GracefulFollower:
    """The Graceful Controller: a smooth control law towards a target on the path.

    Args:
        params: Parameters; the defaults of Humble's code if None.
    """

    _tuning: NDArray[np.void]
    _corners: NDArray[np.float64]
    _use_radius: bool

    def __init__(self, params: GracefulParams | None = None) -> None:
        self.params = params or GracefulParams()
        self.set_plan(np.empty((0, 3)))

    def reset(self, setup: FollowerSetup) -> None:
        """Forget the plan and the speed limit of the last run."""
        self._tuning = make_tuning(self.params, setup)
        self._corners = np.ascontiguousarray(setup.footprint.corners)
        self._use_radius = setup.footprint.use_radius
        self.set_plan(np.empty((0, 3)))

    def set_plan(self, path: NDArray[np.float64]) -> None:
        """Take a new global plan, ``(n, 3)`` x, y in m and yaw in rad, start to goal."""
        self._path = np.ascontiguousarray(path, dtype=np.float64)
        self._steps = np.hypot(*np.diff(self._path[:, :2], axis=0).T)
        self._begin = 0
        self._arrived = False
        self._turns_first = True

    def move_plan(self, path: NDArray[np.float64]) -> None:
        """Take the same plan at its new place; poses that were passed stay passed."""
        self._path = np.ascontiguousarray(path, dtype=np.float64)

    def set_speed_limit(self, speed: float, percentage: bool = False) -> None:
        """Limit the speed to ``speed`` m/s or per cent of ``v_linear_max``, and the turn rate by as much; 0 lifts both.

        ``v_linear_min`` stays the lowest speed.
        """
        params = self.params
        share = speed / 100.0 if percentage else speed / params.v_linear_max
        top = params.v_linear_max * share
        self._tuning["v_linear_max"] = max(top, params.v_linear_min) if speed else params.v_linear_max
        self._tuning["v_angular_max"] = params.v_angular_max * share if speed else params.v_angular_max

    def compute_velocity_commands(self, pose: Pose, velocity: Twist, costmap: Costmap, now: float) -> Twist:
        """Return the next command; arguments as in :class:`controllers.base.PathFollower`.

        Raises:
            ControllerError: If no target can be reached; in Humble also if the plan is empty.
            InvalidPath: If the plan is empty, in Jazzy.
        """
        place = tuple(map(float, pose))
        scene = *costmap.grid, costmap.track_unknown_space, self._corners, self._use_radius, place
        status, v, w, self._begin, self._arrived, self._turns_first = following.follow(
            self._path, self._steps, self._begin, self._arrived, self._turns_first, scene, self._tuning
        )
        if status != following.OK:
            raise self._error_of(status)(REASONS[self.params.release][status])
        return Twist(v, w)

    def _error_of(self, status: int) -> type[ControllerError | ControllerAbort]:
        """Return the error that a failure is in this release."""
        return InvalidPath if status == following.EMPTY_PLAN and self.params.release != "humble" else ControllerError


def make_tuning(params: GracefulParams, setup: FollowerSetup) -> NDArray[np.void]:
    """Join the parameters with what the controller server tells the plugin: one record of :data:`TUNING`."""
    tuning = np.zeros(1, dtype=TUNING)
    fill_groups(tuning, params)
    tuning["sharpness"] = getattr(params, "lambda")
    tuning["xy_goal_tolerance"] = setup.xy_goal_tolerance
    tuning["max_robot_pose_search_dist"] = search_distance(params.max_robot_pose_search_dist)
    tuning["searches_width"], tuning["can_stop"] = True, params.release == "lyrical"
    tuning["use_collision_detection"] = params.use_collision_detection is not False
    for rule in JAZZYS_RULES:
        tuning[rule] = params.release != "humble"
    if params.initial_rotation:  # Nav2 then switches driving backwards off, with a warning
        tuning["allow_backward"] = False
    return tuning
