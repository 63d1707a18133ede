"""LyricalGracefulFollower: the Graceful Controller as Lyrical has it, on the local plan of the path handler."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from controllers.base import FollowerSetup, GoalChecker, InvalidPath, LocalPlan, Twist
from controllers.graceful.controller import REASONS, GracefulFollower
from controllers.graceful.kernels import following, lyrical
from controllers.graceful.params import GracefulParams
from gym_mapbench.costmap import Costmap
from gym_mapbench.world.scenario import Pose


class LyricalGracefulFollower(GracefulFollower):
    """The Graceful Controller on a local plan; arguments as :class:`GracefulFollower`."""

    _local: LocalPlan | None = None
    _goal_checker: GoalChecker | None
    _safe_heading: float

    def reset(self, setup: FollowerSetup) -> None:
        """Forget the plan and the speed limit of the last run."""
        super().reset(setup)
        self._goal_checker, self._local = setup.goal_checker, None

    def set_plan(self, path: NDArray[np.float64]) -> None:
        """Take note of a new global plan: the robot may turn towards it first."""
        super().set_plan(path)
        self._safe_heading = math.nan

    def take_local_plan(self, local: LocalPlan) -> None:
        """Take the part of the plan to follow."""
        self._local = local

    def compute_velocity_commands(self, pose: Pose, velocity: Twist, costmap: Costmap, now: float) -> Twist:
        """Return the next command; arguments as in :class:`controllers.base.PathFollower`.

        Raises:
            ControllerError: If no target can be reached.
            InvalidPath: If there is no local plan.
        """
        local = self._local
        if local is None:
            raise InvalidPath(REASONS["lyrical"][following.EMPTY_PLAN])
        place = tuple(map(float, pose))
        scene = *costmap.grid, costmap.track_unknown_space, self._corners, self._use_radius, place
        arrived = self._goal_checker is not None and self._goal_checker.is_position_reached(pose, local)
        status, v, w, self._turns_first, self._safe_heading = lyrical.follow(
            np.ascontiguousarray(local.path), arrived, self._turns_first, self._safe_heading, scene, self._tuning
        )
        if status != following.OK:
            raise self._error_of(status)(REASONS["lyrical"][status])
        return Twist(v, w)


def make_graceful(params: GracefulParams) -> GracefulFollower:
    """Make the Graceful Controller, of the release that the parameters belong to."""
    return LyricalGracefulFollower(params) if params.release == "lyrical" else GracefulFollower(params)
