"""FeasiblePathHandler: cuts the local plan of all controllers (Lyrical).

Source: nav2_controller (Lyrical) plugins/feasible_path_handler.cpp.
"""

from __future__ import annotations

import math

import numpy as np

from controllers.base import InvalidPath, LocalPlan
from controllers.path_handler import PathHandler
from controllers.plan_window import Path, PlanAhead
from gym_mapbench.costmap import Costmap
from gym_mapbench.world.scenario import Pose, wrap_angle

SAME_PLACE = 1e-4
"""Steps of a path up to this length count as none, m."""


class FeasiblePathHandler(PlanAhead):
    """Keeps the plan of an action, forgets the poses that were passed, and cuts the local plan.

    Args:
        params: Parameters of the path handler.
    """

    def __init__(self, params: PathHandler) -> None:
        super().__init__(params, wrap_angle, last_of_equals=True, keeps_segment=True)

    def first_turn(self, path: Path) -> int:
        """Return the number of poses before the first constraint that is enforced."""
        return first_constraint(path, self._params)

    def local_plan(self, pose: Pose, costmap: Costmap) -> LocalPlan:
        """Return the part of the plan ahead of the robot.

        Raises:
            InvalidPath: If there is none.
        """
        if self._params.reject_unit_path and len(self._ahead) == 1:
            raise InvalidPath("Received plan with length of one")
        path, steps = self._next_window(pose, costmap)
        return LocalPlan(path, float(steps.sum()), Pose(*self._plan[-1].tolist()))


def first_constraint(path: Path, params: PathHandler) -> int:
    """Return the number of poses before the first constraint, a cusp or a turn on the spot; all without one."""
    if len(path) < 3:
        return len(path)
    cusp = _first_cusp(path) if params.enforce_path_inversion else len(path)
    turn = _first_turn(path, params.minimum_rotation_angle) if params.enforce_path_rotation else len(path)
    return min(cusp, turn)


def _first_cusp(path: Path) -> int:
    """Return the number of poses up to that at which the path turns back on itself; short steps do not count."""
    steps = np.diff(path[:, :2], axis=0)
    counting = np.flatnonzero(np.hypot(*steps.T) > SAME_PLACE)
    back = np.flatnonzero((steps[counting[:-1]] * steps[counting[1:]]).sum(axis=1) < 0.0)
    return int(counting[back[0] + 1]) + 1 if len(back) else len(path)


def _first_turn(path: Path, minimum_rotation_angle: float) -> int:
    """Return the number of poses before that at which a turn on the spot exceeds an angle (rad)."""
    turned = 0.0
    for i in range(1, len(path)):
        stays = math.hypot(*(path[i, :2] - path[i - 1, :2])) < SAME_PLACE
        turned = turned + abs(wrap_angle(path[i, 2] - path[i - 1, 2])) if stays else 0.0
        if turned > minimum_rotation_angle > 0.0:
            return i
    return len(path)
