"""LyricalRppFollower: Regulated Pure Pursuit as Lyrical has it, on the local plan of the path handler."""

from __future__ import annotations

import numpy as np

from controllers.base import STOP, FollowerSetup, GoalChecker, InvalidPath, LocalPlan, Twist
from controllers.rpp import kernels, lyrical_kernels
from controllers.rpp.controller import REASONS, RppFollower
from controllers.rpp.params import RppParams
from gym_mapbench.costmap import Costmap
from gym_mapbench.world.scenario import Pose


class LyricalRppFollower(RppFollower):
    """Regulated Pure Pursuit on a local plan.

    Attributes:
        last_command: The last command of this action, where the dynamic window lies.
    """

    last_command: Twist = STOP
    _local: LocalPlan | None = None
    _goal_checker: GoalChecker | None

    def reset(self, setup: FollowerSetup) -> None:
        """Forget the plan, the speed limit, the carrot and the last command of the last run."""
        super().reset(setup)
        self._goal_checker = setup.goal_checker
        self._local, self.last_command = None, STOP

    def take_local_plan(self, local: LocalPlan) -> None:
        """Take the part of the plan to follow."""
        self._local = local

    def end_action(self) -> None:
        """Forget the last command (``reset``, which Nav2 calls when an action ends)."""
        self.last_command = STOP

    def compute_velocity_commands(self, pose: Pose, velocity: Twist, costmap: Costmap, now: float) -> Twist:
        """Return the next command; arguments as in :class:`controllers.base.PathFollower`.

        Raises:
            ControllerError: If the way to the carrot is blocked.
            InvalidPath: If there is no local plan, or one pose where a segment is needed.
            ControllerAbort: If the robot is off the costmap.
        """
        local = self._local
        if local is None:
            raise InvalidPath(REASONS[kernels.EMPTY_PLAN])
        path = np.ascontiguousarray(local.path)
        status, v, w, *carrot = lyrical_kernels.follow(
            path, np.hypot(*np.diff(path[:, :2], axis=0).T), self._has_arrived(pose, local), self.last_command,
            *pose, *velocity, (*costmap.grid, costmap.track_unknown_space), self._corners, self._tuning,
        )  # fmt: skip
        self.carrot = carrot[0], carrot[1]
        if status != kernels.OK:
            raise self._error_of(status)(REASONS[status])
        self.last_command = Twist(v, w)
        return self.last_command

    def _has_arrived(self, pose: Pose, local: LocalPlan) -> bool:
        """Whether the robot shall turn at the goal: the server's goal checker says where that is."""
        if not self.params.use_rotate_to_heading or self._goal_checker is None:
            return False
        return self._goal_checker.is_position_reached(pose, local)


def make_rpp(params: RppParams) -> RppFollower:
    """Make Regulated Pure Pursuit, of the release that the parameters belong to."""
    return LyricalRppFollower(params) if params.release == "lyrical" else RppFollower(params)
