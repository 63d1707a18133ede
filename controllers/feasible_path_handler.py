"""FeasiblePathHandler: cuts the local plan of all controllers (Lyrical).

Source: nav2_controller (Lyrical) plugins/feasible_path_handler.cpp.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from controllers.base import InvalidPath, LocalPlan
from controllers.path_handler import PathHandler
from controllers.plan_window import find_window
from gym_mapbench.costmap import Costmap
from gym_mapbench.world.scenario import Pose, wrap_angle

Path = NDArray[np.float64]
SAME_PLACE = 1e-4
"""Steps of a path up to this length count as none, m."""


class FeasiblePathHandler:
    """Keeps the plan of an action, forgets the poses that were passed, and cuts the local plan.

    Args:
        params: Parameters of the path handler.
    """

    _plan: Path
    _ahead: Path
    _steps: Path
    _passed: int

    def __init__(self, params: PathHandler) -> None:
        self._params = params
        self._enforces = params.enforce_path_inversion or params.enforce_path_rotation
        self.set_plan(np.empty((0, 3)))

    def set_plan(self, path: Path) -> None:
        """Take a new plan, ``(n, 3)`` x, y in m and yaw in rad, start to goal."""
        self._plan = np.array(path, dtype=np.float64, order="C")
        self._look_ahead()

    def move_plan(self, path: Path) -> None:
        """Take the same plan at its new place; passed poses stay passed, and constraints stay where they are."""
        self._plan = path[len(path) - len(self._plan) :]
        self._ahead = self._plan[: len(self._ahead)]

    def local_plan(self, pose: Pose, costmap: Costmap) -> LocalPlan:
        """Return the part of the plan ahead of the robot.

        Raises:
            InvalidPath: If there is none.
        """
        poses = len(self._ahead)
        if poses == 0 or (self._params.reject_unit_path and poses == 1):
            raise InvalidPath("Received plan with zero length" if poses == 0 else "Received plan of one pose")
        self._passed, end = find_window(
            self._ahead, self._steps, self._passed, pose.x, pose.y, self._search_distance(costmap),
            self._params.prune_distance, (costmap.resolution, costmap.origin_x, costmap.origin_y), costmap.costs.shape,
            True, True,
        )  # fmt: skip
        path, steps = self._ahead[self._passed : end], self._steps[self._passed : max(end - 1, self._passed)]
        goal = Pose(*self._plan[-1].tolist())
        if len(self._ahead) < len(self._plan) and self._is_at_end_of_stretch(pose):
            self._plan = self._plan[len(self._ahead) :]
            self._look_ahead()
        if len(path) == 0:
            raise InvalidPath("Resulting plan has 0 poses in it.")
        return LocalPlan(path, float(steps.sum()), goal)

    def _search_distance(self, costmap: Costmap) -> float:
        given = self._params.max_robot_pose_search_dist
        if given is None:
            return float(max(costmap.costs.shape) * costmap.resolution / 2)
        return math.inf if given < 0.0 else float(given)

    def _look_ahead(self) -> None:
        """Begin with the plan, up to the first constraint if constraints are enforced."""
        self._passed = 0
        self._ahead = self._plan[: first_constraint(self._plan, self._params)] if self._enforces else self._plan
        self._steps = np.hypot(*np.diff(self._ahead[:, :2], axis=0).T)

    def _is_at_end_of_stretch(self, pose: Pose) -> bool:
        """Whether the robot is at the constraint, within both tolerances."""
        x, y, yaw = self._ahead[-1].tolist()
        near = math.hypot(pose.x - x, pose.y - y) <= self._params.inversion_xy_tolerance
        return near and abs(wrap_angle(yaw - pose.yaw)) <= self._params.inversion_yaw_tolerance


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
