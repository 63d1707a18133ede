"""The part of the global plan that MPPI looks at, in Humble and Jazzy; Lyrical's server cuts it.

Source: nav2_mppi_controller/src/path_handler.cpp (Humble and Jazzy).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from controllers.base import InvalidPath
from controllers.mppi.params import MppiParams
from controllers.plan_window import find_window
from gym_mapbench.costmap import Costmap
from gym_mapbench.kernels.geometry import normalize_angle
from gym_mapbench.world.scenario import Pose

Path = NDArray[np.float64]


class Handling(NamedTuple):
    """How the plan is cut; arguments as in :class:`~controllers.mppi.params.MppiParams`."""

    prune_distance: float = 2.0
    max_robot_pose_search_dist: float | None = None
    enforce_path_inversion: bool = False
    inversion_xy_tolerance: float = 0.2
    inversion_yaw_tolerance: float = 0.4


def handling_of(params: MppiParams) -> Handling:
    """Return how the plan is cut: as MPPI's parameters say, in Lyrical as the path handler of Nav2's code does."""
    given = {name: getattr(params, name) for name in Handling._fields}
    return Handling(**{name: value for name, value in given.items() if value is not None})


def end_of(path: Path) -> tuple[float, float]:
    """Return the place of a path's last pose in single precision, m."""
    x, y = path[-1, :2].astype(np.float32).tolist()
    return x, y


def first_cusp(path: Path) -> int:
    """Return how many poses lie before the path turns back on itself, all of them if it does not."""
    steps = np.diff(path[:, :2], axis=0).astype(np.float32)
    back = np.flatnonzero((steps[:-1] * steps[1:]).sum(axis=1) < 0.0)
    return int(back[0]) + 2 if len(back) else len(path)


class PathHandler:
    """Keeps the plan of a run and cuts the local path from it.

    Args:
        params: MPPI's parameters.
    """

    _plan: Path
    _ahead: Path
    _steps: NDArray[np.float64]
    _cusp: int
    _passed: int

    def __init__(self, params: MppiParams) -> None:
        self._release, self._handling = params.release, handling_of(params)
        self.set_plan(np.empty((0, 3)))

    def set_plan(self, path: Path) -> None:
        """Take a new plan, ``(n, 3)`` x, y in m and yaw in rad."""
        self._plan = np.array(path, dtype=np.float64, order="C")
        self._look_ahead()

    def move_plan(self, path: Path) -> None:
        """Take the same plan at its new place; the poses passed and the cusps stay the same."""
        self._plan = path[len(path) - len(self._plan) :]
        self._ahead = self._plan[: self._cusp] if self._cusp else self._plan

    def local_path(self, pose: Pose, costmap: Costmap) -> Path:
        """Return the poses ahead, ``(m, 3)``, and forget those that were passed.

        Raises:
            InvalidPath: If there are no poses ahead.
        """
        if len(self._ahead) == 0:
            raise InvalidPath("Received plan with zero length")
        place = (costmap.resolution, costmap.origin_x, costmap.origin_y)
        search, prune = self._search_distance(costmap), self._handling.prune_distance
        self._passed, end = find_window(
            self._ahead, self._steps, self._passed, pose.x, pose.y, search, prune, place, costmap.costs.shape,
            self._release != "humble", False,
        )  # fmt: skip
        window = self._ahead[self._passed : end]
        if self._cusp and self._at_cusp(pose):
            self._plan = self._plan[self._cusp :]
            self._look_ahead()
        if len(window) == 0:
            raise InvalidPath("Resulting plan has 0 poses in it.")
        return window

    def goal(self, window: Path) -> tuple[float, float]:
        """Return the goal in the sense of the critics, m: the end of the plan in Jazzy, else of the local path."""
        if self._release == "humble":
            return end_of(window)
        x, y = self._plan[-1, :2].tolist()
        return x, y

    def _search_distance(self, costmap: Costmap) -> float:
        given = self._handling.max_robot_pose_search_dist
        return max(costmap.costs.shape) * costmap.resolution / 2 if given is None else float(given)

    def _look_ahead(self) -> None:
        """Begin with the plan, up to its first cusp if inversions are enforced; ``_cusp`` is 0 if there is no cusp."""
        self._cusp = self._passed = 0
        if self._handling.enforce_path_inversion and len(self._plan) >= 3:
            cusp = first_cusp(self._plan)
            self._cusp = cusp if cusp < len(self._plan) else 0
        self._ahead = self._plan[: self._cusp] if self._cusp else self._plan
        self._steps = np.hypot(*np.diff(self._ahead[:, :2], axis=0).T)

    def _at_cusp(self, pose: Pose) -> bool:
        """Whether the robot is where the path turns back, within both tolerances."""
        x, y, yaw = self._ahead[-1].tolist()
        turn = abs(float(normalize_angle(yaw - pose.yaw)))
        near = math.hypot(pose.x - x, pose.y - y) <= self._handling.inversion_xy_tolerance
        return near and turn <= self._handling.inversion_yaw_tolerance
