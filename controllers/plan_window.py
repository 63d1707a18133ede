"""The part of the plan that lies ahead of the robot."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from controllers.base import InvalidPath
from controllers.path_handler import PathHandler
from gym_mapbench.costmap import Costmap
from gym_mapbench.kernels.geometry import cell_index
from gym_mapbench.kernels.jit import kernel
from gym_mapbench.world.scenario import Pose

Path = NDArray[np.float64]


@kernel
def _first_beyond(steps, begin, length):
    """Index of the first pose whose distance along the path from pose ``begin`` exceeds ``length``; else the end."""
    travelled = 0.0
    for i in range(begin, len(steps)):
        travelled += steps[i]
        if travelled > length:
            return i + 1
    return len(steps) + 1


@kernel
def find_window(path, steps, passed, x, y, search, prune, place, shape, last_of_equals, keeps_segment):
    """Return ``(first, end)`` of the local path: from the nearest pose on, as far as ``prune`` and the costmap reach.

    Args:
        path: ``(n, 3)`` plan.
        steps: ``(n - 1,)`` distances between its poses, m.
        passed: Number of poses that the robot has passed.
        x: Position of the robot, m.
        y: Position of the robot, m.
        search: Length of path in which the nearest pose is sought, m.
        prune: Length of the local path, m.
        place: ``(resolution, origin_x, origin_y)`` of the costmap.
        shape: ``(rows, cols)`` of the costmap.
        last_of_equals: Whether of equally near poses the last is taken, rather than the first.
        keeps_segment: Whether the pose before the last is taken if the last is nearest, so that a segment remains.
    """
    best, first = math.inf, passed
    for i in range(passed, _first_beyond(steps, passed, search)):
        distance = math.hypot(path[i, 0] - x, path[i, 1] - y)
        if distance < best or (last_of_equals and distance == best):
            best, first = distance, i
    if keeps_segment and len(path) > 1:
        first = min(first, len(path) - 2)
    end = _first_beyond(steps, first, prune)
    for i in range(first, end):
        if cell_index(path[i, 0], path[i, 1], place[1], place[2], place[0], shape[0], shape[1]) < 0:
            return first, i
    return first, end


class PlanAhead(ABC):
    """Keeps a plan, forgets the poses that were passed, and hides those beyond a turn until the robot is there.

    Args:
        params: How the plan is cut.
        wrap: Wraps an angle to (-pi, pi].
        last_of_equals: As in :func:`find_window`.
        keeps_segment: As in :func:`find_window`.
    """

    _plan: Path
    _ahead: Path
    _steps: NDArray[np.float64]
    _passed: int

    def __init__(
        self, params: PathHandler, wrap: Callable[[float], float], *, last_of_equals: bool, keeps_segment: bool
    ) -> None:
        self._params, self._wrap = params, wrap
        self._last_of_equals, self._keeps_segment = last_of_equals, keeps_segment
        self.set_plan(np.empty((0, 3)))

    @abstractmethod
    def first_turn(self, path: Path) -> int:
        """Return how many poses of a plan lie before its first turn that is enforced, all without one."""

    def set_plan(self, path: Path) -> None:
        """Take a new plan, ``(n, 3)`` x, y in m and yaw in rad, start to goal."""
        self._plan = np.array(path, dtype=np.float64, order="C")
        self._look_ahead()

    def move_plan(self, path: Path) -> None:
        """Take the same plan at its new place; the poses passed and the turns stay the same."""
        self._plan = path[len(path) - len(self._plan) :]
        self._ahead = self._plan[: len(self._ahead)]

    def _next_window(self, pose: Pose, costmap: Costmap) -> tuple[Path, NDArray[np.float64]]:
        """Return the poses ahead and the distances between them, and forget those that were passed.

        Raises:
            InvalidPath: If there are no poses ahead.
        """
        if len(self._plan) == 0:
            raise InvalidPath("Received plan with zero length")
        place = (costmap.resolution, costmap.origin_x, costmap.origin_y)
        self._passed, end = find_window(
            self._ahead, self._steps, self._passed, pose.x, pose.y, self._search_distance(costmap),
            self._params.prune_distance, place, costmap.costs.shape, self._last_of_equals, self._keeps_segment,
        )  # fmt: skip
        window, steps = self._ahead[self._passed : end], self._steps[self._passed : max(end - 1, self._passed)]
        if len(self._ahead) < len(self._plan) and self._is_at_turn(pose):
            self._plan = self._plan[len(self._ahead) :]
            self._look_ahead()
        if len(window) == 0:
            raise InvalidPath("Resulting plan has 0 poses in it.")
        return window, steps

    def _search_distance(self, costmap: Costmap) -> float:
        given = self._params.max_robot_pose_search_dist
        if given is None:
            return float(max(costmap.costs.shape) * costmap.resolution / 2)
        return math.inf if given < 0.0 else float(given)

    def _look_ahead(self) -> None:
        self._passed, self._ahead = 0, self._plan[: self.first_turn(self._plan)]
        self._steps = np.hypot(*np.diff(self._ahead[:, :2], axis=0).T)

    def _is_at_turn(self, pose: Pose) -> bool:
        """Whether the robot is where the poses ahead end, within both tolerances."""
        x, y, yaw = self._ahead[-1].tolist()
        near = math.hypot(pose.x - x, pose.y - y) <= self._params.inversion_xy_tolerance
        return near and abs(float(self._wrap(yaw - pose.yaw))) <= self._params.inversion_yaw_tolerance
