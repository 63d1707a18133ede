"""Theta*: paths of straight pieces at any angle.

Source: nav2_theta_star_planner/src/theta_star_planner.cpp, theta_star.cpp (Humble, Jazzy and Lyrical).
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from gym_mapbench.costmap import FREE_SPACE, INSCRIBED_INFLATED_OBSTACLE, LETHAL_OBSTACLE, NO_INFORMATION, Costmap
from gym_mapbench.errors import EndpointError, UnsafeEndpointError
from gym_mapbench.kernels.theta_star import search_corners
from gym_mapbench.planners.base import (
    Path,
    PlannerEntry,
    cells_of,
    no_path,
    refuse_obstacle,
    set_last_yaw,
    stay,
    to_centres,
)
from gym_mapbench.quantities import NonNegative
from gym_mapbench.releases import Release
from gym_mapbench.ros_params import Keys, RosPlugin, Section, slashed_in_humble
from gym_mapbench.settings import Settings
from gym_mapbench.world.scenario import Pose

MAX_NON_OBSTACLE = 252
NEUTRAL_COST = 26
COST_FACTOR = 0.9


class ThetaStarParams(Settings):
    """Options of Theta*, named and defaulted as in Nav2.

    Args:
        how_many_corners: Neighbours of a cell, 4 or 8.
        w_euc_cost: Weight of the path's length in cells.
        w_traversal_cost: Weight of the costs of its cells.
        allow_unknown: Whether paths may cross unknown cells.
        use_final_approach_orientation: Whether the last pose faces the way the path arrives, not the goal's yaw.
        release: Release of Nav2. Since Jazzy a plan first frees the cell from which the plan before it began.
    """

    how_many_corners: Literal[4, 8] = 8
    w_euc_cost: NonNegative = 1.0
    w_traversal_cost: NonNegative = 2.0
    allow_unknown: bool = True
    use_final_approach_orientation: bool = False
    release: Release = "humble"


@dataclass
class ThetaStarPlanner:
    """Plan by Theta*."""

    params: ThetaStarParams = field(default_factory=ThetaStarParams)
    _last_start: tuple[int, int] = (0, 0)

    def plan(self, costmap: Costmap, start: Pose, goal: Pose) -> Path:
        """Return a path with a pose per cell length that ends just before the goal; see ``GlobalPlanner.plan``.

        Since Jazzy the cell from which it last planned counts as free, so a second plan from a cell on an obstacle
        begins: Nav2 frees the start before it takes the new one. There the cell is free until its next update.
        """
        start_cell, goal_cell = cells_of(costmap, start, goal)
        direct = self.params.use_final_approach_orientation
        if start_cell == goal_cell:
            refuse_obstacle(costmap, start_cell, start, goal)
            return stay(start, goal, direct)
        step_cost, line_cost = self._traversal_costs()
        if costmap.costs[goal_cell] == LETHAL_OBSTACLE:
            raise no_path(start, goal, "start or goal is in an obstacle", EndpointError)
        costs, self._last_start = self._freed(costmap.costs), start_cell
        if np.isinf(step_cost[[costs[start_cell], costs[goal_cell]]]).any():
            raise no_path(start, goal, "start or goal is in an obstacle", UnsafeEndpointError)
        weights = self.params.w_euc_cost, min(1.0, self.params.w_euc_cost)
        corners = self.params.how_many_corners
        cells = search_corners(costs, step_cost, line_cost, *start_cell, *goal_cell, corners, *weights)
        if len(cells) == 0:
            raise no_path(start, goal, "start and goal are not connected")
        path = _interpolated(to_centres(cells, costmap), costmap.resolution)
        set_last_yaw(path, start, goal, direct)
        return path

    def _freed(self, costs: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return the costs with the cell free from which the last plan began (``clearStart``)."""
        rows, cols = costs.shape
        row, col = self._last_start
        if self.params.release == "humble" or row >= rows or col >= cols or costs[row, col] == FREE_SPACE:
            return costs
        freed = costs.copy()
        freed[row, col] = FREE_SPACE
        return freed

    def _traversal_costs(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Cost ``(256,)`` of every cost value for a step and on a line of sight; inf where it is unsafe."""
        cost = NEUTRAL_COST + COST_FACTOR * np.arange(256)
        traversal = self.params.w_traversal_cost * cost * cost / MAX_NON_OBSTACLE / MAX_NON_OBSTACLE
        stepped = traversal.copy()
        stepped[INSCRIBED_INFLATED_OBSTACLE:NO_INFORMATION] = np.inf
        passed = np.where(cost <= MAX_NON_OBSTACLE, traversal, np.inf)
        unknown = self.params.w_traversal_cost * INSCRIBED_INFLATED_OBSTACLE * INSCRIBED_INFLATED_OBSTACLE
        passed[NO_INFORMATION] = unknown / MAX_NON_OBSTACLE / MAX_NON_OBSTACLE
        if not self.params.allow_unknown:
            stepped[NO_INFORMATION] = passed[NO_INFORMATION] = np.inf
        return stepped, passed


def _interpolated(corners: NDArray[np.float64], spacing: float) -> Path:
    """Return poses every ``spacing`` m along straight pieces ``(n, 2)`` m; the last corner itself is left out."""
    pieces = []
    for first, second in itertools.pairwise(corners):
        length = float(np.hypot(*(second - first)))
        along = np.arange(max(1, int(length / spacing))) * spacing
        pieces.append(first + along[:, None] * (second - first) / length)
    points = np.vstack(pieces)
    return np.column_stack([points, np.zeros(len(points))])


def adapt(section: Section) -> None:
    """Take 8 for a number of neighbours that is neither 4 nor 8, as Nav2 does."""
    section.correct("how_many_corners", (4, 8), 8)


THETA_STAR = PlannerEntry(
    ThetaStarParams,
    ThetaStarPlanner,
    nav2=RosPlugin(
        slashed_in_humble("nav2_theta_star_planner", "ThetaStarPlanner"),
        "Theta*",
        ThetaStarParams,
        Keys(
            ros_only=frozenset({"plugin", "terminal_checking_interval"}),
            elsewhere={"w_heuristic_cost": "Theta* computes it from w_euc_cost"},
        ),
        adapt=adapt,
    ),
)
