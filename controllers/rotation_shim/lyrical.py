"""LyricalRotationShimFollower: the Rotation Shim Controller as Lyrical has it, on the local plan of the path handler.

Source: nav2_rotation_shim_controller: src/nav2_rotation_shim_controller.cpp (Lyrical).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from controllers.base import FollowerSetup, LocalPlan, PathFollower, Twist
from controllers.rotation_shim.controller import RotationShimFollower
from controllers.rotation_shim.params import RotationShimParams
from gym_mapbench.costmap import Costmap
from gym_mapbench.world.scenario import Pose, wrap_angle


class LyricalRotationShimFollower(RotationShimFollower):
    """Turns on the spot towards the local plan in any cycle, and lets another controller follow it.

    Arguments as :class:`~controllers.rotation_shim.controller.RotationShimFollower`.
    """

    _local: LocalPlan | None = None

    def reset(self, setup: FollowerSetup) -> None:
        """Forget everything of the last run."""
        super().reset(setup)
        self._local = None

    def take_local_plan(self, local: LocalPlan) -> None:
        """Take the part of the plan to follow; its bearing counts in every cycle, unless one turn was enough."""
        self._path, self._local = local.path, local
        if not self.params.rotate_to_heading_once:
            self._looks_at_path = True
        take = getattr(self.primary, "take_local_plan", None)
        if take is not None:
            take(local)

    def _turn_at_goal(self, pose: Pose, velocity: Twist, costmap: Costmap) -> float | None:
        """Turn rate to the goal's heading; None if the goal checker says no, or the turn is blocked."""
        local, checker = self._local, self._setup.goal_checker
        if not self.params.rotate_to_goal_heading or local is None or checker is None:
            return None
        if not checker.is_position_reached(pose, local):
            return None
        return self._free_turn(wrap_angle(local.goal.yaw - pose.yaw), pose, velocity, costmap)


def make_shim(make_primary: Callable[[Any], PathFollower], params: RotationShimParams) -> RotationShimFollower:
    """Make the Rotation Shim of a release around the controller that ``make_primary`` makes."""
    kind = LyricalRotationShimFollower if params.release == "lyrical" else RotationShimFollower
    return kind(make_primary, params)
