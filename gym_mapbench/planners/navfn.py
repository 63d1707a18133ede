"""NavFn, Nav2's default planner: a potential field around the robot, and the way down to it from the goal.

Source: nav2_navfn_planner (Humble, Jazzy and Lyrical). Its cells are rounded where those of the costmap are truncated,
so potentials and paths lie half a cell below and left of the costs they were computed from; this is copied on purpose.
"""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import model_validator

from gym_mapbench.costmap import INSCRIBED_INFLATED_OBSTACLE, LETHAL_OBSTACLE, NO_INFORMATION, Costmap
from gym_mapbench.errors import ConfigError, EndpointError
from gym_mapbench.kernels.wavefront import COST_NEUTRAL, COST_OBS, LIST_CELLS, POT_HIGH, descend, spread
from gym_mapbench.planners.base import Path, PlannerEntry, cells_of, no_path, refuse_obstacle, set_last_yaw, stay
from gym_mapbench.quantities import Count, NonNegative
from gym_mapbench.releases import Release
from gym_mapbench.ros_params import Keys, RosPlugin, slashed_in_humble
from gym_mapbench.settings import ExtendedSettings
from gym_mapbench.world.scenario import Pose

COST_FACTOR = 0.8
AT_GOAL_SQUARED = 1e-6
_FOUR_TIMES = "a path has at most 4 times as many points as the longer side has cells"
Cell = tuple[int, int]
"""``(row, col)``."""


class NavfnParams(ExtendedSettings):
    """Options of NavFn, named and defaulted as in Nav2.

    Args:
        tolerance: How far from an unreachable goal a path may end, along either axis, m.
        use_astar: Whether to spread towards the goal first.
        allow_unknown: Whether paths may cross unknown cells.
        use_final_approach_orientation: Whether the last pose faces the way the path arrives, not the goal's yaw.
        release: Release of Nav2. In Jazzy the goal replaces a last pose within 1 mm of it, and a plan from the goal
            itself succeeds even on an obstacle.
        max_cycles_factor: Lyrical: largest number of points of a path, as a multiple of the longer side in cells; 4 in
            older releases.
    """

    newer: ClassVar[tuple[str, ...]] = ("max_cycles_factor",)
    MISSING: ClassVar[Mapping[Release, Mapping[str, str]]] = {
        "humble": {"max_cycles_factor": _FOUR_TIMES},
        "jazzy": {"max_cycles_factor": _FOUR_TIMES},
    }

    tolerance: NonNegative = 0.5
    use_astar: bool = False
    allow_unknown: bool = True
    use_final_approach_orientation: bool = False
    release: Release = "humble"
    max_cycles_factor: Count = 4

    @model_validator(mode="after")
    def _has_the_factor(self) -> Self:
        if self.release in self.MISSING and self.max_cycles_factor != 4:
            raise ConfigError(
                f"max_cycles_factor: Nav2 {self.release.capitalize()} has no such parameter: {_FOUR_TIMES}"
            )
        return self


@dataclass
class _Spread:
    """A potential, and the cells and the costs that it was computed from."""

    start: Cell = (-1, -1)
    goal: Cell = (-1, -1)
    costs: bytes = b""
    potential: NDArray[np.float32] = field(default_factory=lambda: np.empty((0, 0), np.float32))


@dataclass(frozen=True)
class NavfnPlanner:
    """Plan by NavFn.

    The potential of the last plan is kept: a robot that stands asks for the same again and again.
    """

    params: NavfnParams = field(default_factory=NavfnParams)
    _last: _Spread = field(default_factory=_Spread, init=False, repr=False, compare=False)

    def plan(self, costmap: Costmap, start: Pose, goal: Pose) -> Path:
        """Return the path of ``NavfnPlanner::createPlan``, about two poses a cell; see ``GlobalPlanner.plan``."""
        start_cell, goal_cell = self._cells(costmap, start, goal)
        direct, humble = self.params.use_final_approach_orientation, self.params.release == "humble"
        if (start.x, start.y) == (goal.x, goal.y):
            if humble:
                refuse_obstacle(costmap, costmap.world_to_map(start.x, start.y) or start_cell, start, goal)
            return stay(start, goal, direct)
        potential = self._spread(costmap, start_cell, goal_cell)
        end = self._reachable(potential, costmap, goal)
        if end is None:
            raise no_path(start, goal, "start and goal are not connected")
        width = costmap.costs.shape[1]
        points, arrived = descend(
            potential, _flat(start_cell, width), _flat(end[1], width), self._most_points(costmap), self._fused
        )
        if not arrived:
            raise no_path(start, goal, self._why_short(len(points), costmap))
        path = _to_path(points, costmap, end[0], 0.0 if humble else AT_GOAL_SQUARED)
        set_last_yaw(path, start, goal, direct)
        return path

    def potential(self, costmap: Costmap, start: Pose, goal: Pose) -> NDArray[np.float32]:
        """Potentials ``(rows, cols)`` float32 around the start, inf where the wave has not arrived.

        Raises:
            EndpointError: If start or goal is off the map.
        """
        potential = self._spread(costmap, *self._cells(costmap, start, goal))
        return np.where(potential < POT_HIGH, potential, np.float32(np.inf))

    @property
    def _fused(self) -> bool:
        """Whether the kernels round a product and a sum once, as Lyrical's recordings do."""
        return self.params.release == "lyrical"

    def _most_points(self, costmap: Costmap) -> int:
        """Largest number of points of a path."""
        longer: int = max(costmap.costs.shape)
        return self.params.max_cycles_factor * longer

    def _why_short(self, points: int, costmap: Costmap) -> str:
        """Say why NavFn's walk down the potential ended before the start."""
        most, factor = self._most_points(costmap), self.params.max_cycles_factor
        if points < most:
            return "the potential has a dead end"
        return f"NavFn follows at most {most} points, {factor} times the longer side in cells, and the way is longer"

    def _cells(self, costmap: Costmap, start: Pose, goal: Pose) -> tuple[Cell, Cell]:
        """Cells of start and goal, rounded; Jazzy also looks at the cell that the costmap gives for the goal."""
        if self.params.release != "humble":
            _, goal_cell = cells_of(costmap, start, goal)
            if self.params.tolerance == 0.0 and costmap.costs[goal_cell] == LETHAL_OBSTACLE:
                raise no_path(start, goal, "the goal is in an obstacle", EndpointError)
        cells = [navfn_cell(costmap, pose.x, pose.y) for pose in (start, goal)]
        if cells[0] is None or cells[1] is None:
            raise no_path(start, goal, f"the {'start' if cells[0] is None else 'goal'} is off the map", EndpointError)
        return cells[0], cells[1]

    def _spread(self, costmap: Costmap, start: Cell, goal: Cell) -> NDArray[np.float32]:
        last, costs, shape = self._last, costmap.costs.tobytes(), costmap.costs.shape
        if (last.start, last.goal, last.costs, last.potential.shape) != (start, goal, costs, shape):
            cost_of, ends = navfn_costs(self.params.allow_unknown), (_flat(start, shape[1]), _flat(goal, shape[1]))
            last.potential = spread(costmap.costs, cost_of, *ends, self.params.use_astar, self._fused, LIST_CELLS)
            last.start, last.goal, last.costs = start, goal, costs
        return last.potential

    def _reachable(self, potential: NDArray[np.float32], costmap: Costmap, goal: Pose) -> tuple[Pose, Cell] | None:
        """Return the goal, or else the reachable point nearest to it within the tolerance, with its cell."""
        best, least = None, math.inf
        tolerance = self.params.tolerance
        scan = (
            (x, y)
            for y in _scan(goal.y, tolerance, costmap.resolution)
            for x in _scan(goal.x, tolerance, costmap.resolution)
        )
        for x, y in itertools.chain([goal[:2]], scan):
            squared = (x - goal.x) ** 2 + (y - goal.y) ** 2
            cell = navfn_cell(costmap, x, y) if squared < least else None
            if cell is not None and potential[cell] < POT_HIGH:
                best, least = (Pose(x, y, goal.yaw), cell), squared
            if least == 0:
                break
        return best


@functools.cache
def navfn_costs(allow_unknown: bool) -> NDArray[np.uint8]:
    """NavFn's cost ``(256,)`` uint8 of every cost value (``setCostmap``)."""
    costs: NDArray[np.float64] = np.trunc(COST_NEUTRAL + COST_FACTOR * np.arange(256)).clip(0, COST_OBS)
    costs[INSCRIBED_INFLATED_OBSTACLE:] = COST_OBS
    costs[NO_INFORMATION] = COST_OBS - 1 if allow_unknown else COST_OBS
    table = costs.astype(np.uint8)
    table.flags.writeable = False
    return table


def navfn_cell(costmap: Costmap, x: float, y: float) -> Cell | None:
    """Return ``(row, col)`` of the cell whose lower-left corner is nearest, None off the map."""
    if x < costmap.origin_x or y < costmap.origin_y:
        return None
    row = _round_half_up((y - costmap.origin_y) / costmap.resolution)
    col = _round_half_up((x - costmap.origin_x) / costmap.resolution)
    rows, cols = costmap.costs.shape
    return (row, col) if row < rows and col < cols else None


def _round_half_up(value: float) -> int:
    whole = math.floor(value)
    return whole + (value - whole >= 0.5)


def _flat(cell: Cell, width: int) -> int:
    return cell[0] * width + cell[1]


def _scan(centre: float, tolerance: float, step: float) -> list[float]:
    """Coordinates from ``centre - tolerance`` on, summed up step by step as Nav2 does."""
    values = [centre - tolerance]
    while values[-1] + step <= centre + tolerance:
        values.append(values[-1] + step)
    return values


def _to_path(points: NDArray[np.float32], costmap: Costmap, goal: Pose, at_goal: float) -> Path:
    """Turn points ``(n, 2)`` col, row from goal to start into poses from start to goal, all but the last of yaw 0.

    The goal is appended. It replaces the last pose if that lies beyond it, or if the square of their distance is less
    than ``at_goal``, m^2 (``smoothApproachToGoal``).
    """
    path = np.zeros((len(points) + 1, 3))
    path[:-1, :2] = points[::-1]
    path[:, :2] *= costmap.resolution
    path[:, 0] += costmap.origin_x
    path[:, 1] += costmap.origin_y
    if _lies_beyond(path[:-1], goal) or ((path[-2, :2] - goal[:2]) ** 2).sum() < at_goal:
        path = path[:-1]
    path[-1] = goal
    return path


def _lies_beyond(path: Path, goal: Pose) -> bool:
    """Whether the last pose is farther from the one before than the goal is."""
    if len(path) < 2:
        return False
    (x, y), (last_x, last_y) = path[-2:, :2].tolist()
    to_goal = (goal.x - x) ** 2 + (goal.y - y) ** 2
    return bool((last_x - x) ** 2 + (last_y - y) ** 2 > to_goal)


NAVFN = PlannerEntry(
    NavfnParams,
    NavfnPlanner,
    nav2=RosPlugin(
        slashed_in_humble("nav2_navfn_planner", "NavfnPlanner"),
        "NavFn",
        NavfnParams,
        Keys(ros_only=frozenset({"plugin"})),
    ),
)
