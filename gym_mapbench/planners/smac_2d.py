"""Smac 2D: the cheapest path over the eight neighbours, smoothed.

Source: nav2_smac_planner/src/smac_planner_2d.cpp, a_star.cpp, smoother.cpp (Humble, Jazzy and Lyrical);
include/nav2_smac_planner/goal_manager.hpp (Lyrical).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gym_mapbench.costmap import INSCRIBED_INFLATED_OBSTACLE, NO_INFORMATION, Costmap
from gym_mapbench.errors import EndpointError, UnsafeEndpointError
from gym_mapbench.kernels.smac_2d import search_cells
from gym_mapbench.kernels.smoothing import smooth_and_refine
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
from gym_mapbench.quantities import Count, Fraction, Natural, NonNegative, Positive
from gym_mapbench.releases import Release
from gym_mapbench.ros_params import Keys, RosPlugin, slashed_in_humble
from gym_mapbench.settings import Settings
from gym_mapbench.world.scenario import Pose

MAX_NON_OBSTACLE = 252
SHORTEST_SMOOTHED = 12
EXACT = 0.001
"""Tolerance, cells, below which Jazzy's path ends at the goal itself."""

Iterations = Annotated[Natural, Field(le=2**62)]


class SmootherParams(Settings):
    """Options of the smoother, named and defaulted as in Nav2.

    Args:
        max_iterations: Most rounds; 0 leaves the path as it was found.
        w_smooth: Pull towards the neighbours' middle.
        w_data: Pull towards the path as it was found.
        tolerance: A round that moves all points together by less than this is the last, m.
        do_refinement: Whether to smooth the smoothed path again.
        refinement_num: How many times.
    """

    max_iterations: Iterations = 1000
    w_smooth: Fraction = 0.3
    w_data: Fraction = 0.2
    tolerance: Positive = 1e-10
    do_refinement: bool = True
    refinement_num: Annotated[Natural, Field(le=100)] = 2


class Smac2DParams(Settings):
    """Options of Smac 2D, named and defaulted as in Nav2.

    ``max_planning_time`` is not among them: a plan must not depend on the clock; ``max_iterations`` limits it.

    Args:
        tolerance: A path may end less than this from an unreachable goal, m.
        downsample_costmap: Whether to plan on a coarser costmap.
        downsampling_factor: How many cells make a side of a coarser one.
        allow_unknown: Whether paths may cross unknown cells.
        max_iterations: Most cells to expand; 0 or less means no limit.
        max_on_approach_iterations: Most cells to expand once a path within the tolerance is known; 0 or less means no
            limit.
        cost_travel_multiplier: How much is added to the cost of a step onto a cell of cost 252.
        use_final_approach_orientation: Whether the last pose faces the way the path arrives, not the goal's yaw.
        smoother: Options of the smoother.
        release: Release of Nav2. Humble refuses a start on an obstacle; later releases refuse a start if all cells
            around it are blocked, and do not look at the cell of a plan from the goal's own cell. Lyrical refuses an
            occupied goal if no cell within the tolerance is free, or the tolerance is less than a cell, and its paths
            end at the goal's position.
    """

    tolerance: NonNegative = 0.125
    downsample_costmap: bool = False
    downsampling_factor: Count = 1
    allow_unknown: bool = True
    max_iterations: Annotated[int, Field(le=2**62)] = 1_000_000
    max_on_approach_iterations: Annotated[int, Field(le=2**62)] = 1000
    cost_travel_multiplier: NonNegative = 1.0
    use_final_approach_orientation: bool = False
    smoother: SmootherParams = SmootherParams()
    release: Release = "humble"


@dataclass(frozen=True)
class Smac2DPlanner:
    """Plan by Smac 2D."""

    params: Smac2DParams = field(default_factory=Smac2DParams)

    def plan(self, costmap: Costmap, start: Pose, goal: Pose) -> Path:
        """Return a smoothed path through cell centres; see ``GlobalPlanner.plan``."""
        params = self.params
        if params.downsample_costmap:
            costmap = downsampled(costmap, params.downsampling_factor)
        start_cell, goal_cell = cells_of(costmap, start, goal)
        if start_cell == goal_cell:
            return self._stay(costmap, start_cell, start, goal)
        step_cost = self._step_cost()
        passable = np.isfinite(step_cost)[costmap.costs]
        self._refuse_endpoints(passable, costmap, start, goal)
        cells = self._search(costmap, step_cost, start_cell, goal_cell)
        if len(cells) == 0:
            raise no_path(start, goal, "start and goal are not connected, or the search was cut off")
        path = np.zeros((len(cells), 3))
        path[:, :2] = self._smoothed(to_centres(cells, costmap), costmap)
        steps = np.diff(path[:, :2], axis=0)
        path[:-1, 2] = np.arctan2(steps[:, 1], steps[:, 0])
        if params.release == "lyrical" and tuple(cells[-1]) == goal_cell:
            path[-1, :2] = goal.x, goal.y
        set_last_yaw(path, start, goal, params.use_final_approach_orientation)
        return path

    def _stay(self, costmap: Costmap, cell: tuple[int, int], start: Pose, goal: Pose) -> Path:
        """Return the plan from the goal's own cell; only Humble looks whether that is an obstacle."""
        if self.params.release == "humble":
            refuse_obstacle(costmap, cell, start, goal)
        path = stay(start, goal, self.params.use_final_approach_orientation)
        if self.params.release == "lyrical":
            path[0, :2] = goal.x, goal.y
        return path

    def _refuse_endpoints(self, passable: NDArray[np.bool_], costmap: Costmap, start: Pose, goal: Pose) -> None:
        """Refuse a start or a goal as the release does.

        Raises:
            UnsafeEndpointError: If Humble finds the start on an obstacle.
            EndpointError: If a later release says that start or goal is occupied, so that the tree tries no recovery.
        """
        start_cell, goal_cell = cells_of(costmap, start, goal)
        if self.params.release == "humble":
            if not passable[start_cell]:
                raise no_path(start, goal, "the start is in an obstacle", UnsafeEndpointError)
            return
        if not passable[goal_cell] and not self._may_end_near(passable, costmap, goal):
            raise no_path(start, goal, "the goal is in an obstacle", EndpointError)
        row, col = start_cell
        around = passable[max(0, row - 1) : row + 2, max(0, col - 1) : col + 2]
        if around.sum() == passable[start_cell]:
            raise no_path(start, goal, "all cells around the start are blocked", EndpointError)

    def _may_end_near(self, passable: NDArray[np.bool_], costmap: Costmap, goal: Pose) -> bool:
        """Whether a search for an occupied goal begins.

        In Jazzy it does with any tolerance, in Lyrical with one of a cell or more if the corner of a free cell lies
        within (``isZoneValid``).
        """
        tolerance = self.params.tolerance / costmap.resolution
        if self.params.release != "lyrical":
            return tolerance >= EXACT
        row, col = (goal.y - costmap.origin_y) / costmap.resolution, (goal.x - costmap.origin_x) / costmap.resolution
        rows, cols = np.nonzero(passable)
        return tolerance >= 1.0 and bool((np.hypot(rows - row, cols - col) <= tolerance).any())

    def _step_cost(self) -> NDArray[np.float64]:
        """Cost ``(256,)`` of a straight step onto a cell of every cost value; inf where blocked."""
        params = self.params
        step_cost = 1.0 + params.cost_travel_multiplier * np.arange(256) / MAX_NON_OBSTACLE
        step_cost[INSCRIBED_INFLATED_OBSTACLE:NO_INFORMATION] = np.inf
        if not params.allow_unknown:
            step_cost[NO_INFORMATION] = np.inf
        return np.asarray(step_cost, np.float64)

    def _search(
        self, costmap: Costmap, step_cost: NDArray[np.float64], start: tuple[int, int], goal: tuple[int, int]
    ) -> NDArray[np.int64]:
        params = self.params
        limits = [n if n > 0 else 2**62 for n in (params.max_iterations, params.max_on_approach_iterations)]
        tolerance = params.tolerance / costmap.resolution
        cells: NDArray[np.int64] = search_cells(costmap.costs, step_cost, *start, *goal, tolerance, *limits)
        return cells

    def _smoothed(self, points: NDArray[np.float64], costmap: Costmap) -> NDArray[np.float64]:
        """Smooth a path ``(n, 2)`` m, then refine it as often as wanted, as long as it comes to rest."""
        options = self.params.smoother
        if len(points) < SHORTEST_SMOOTHED or options.max_iterations == 0:
            return points
        weights = options.w_data, options.w_smooth, options.tolerance, options.max_iterations
        refinements = options.refinement_num if options.do_refinement else 0
        smoothed: NDArray[np.float64] = smooth_and_refine(points, *costmap.grid, *weights, refinements)[0]
        return smoothed


def downsampled(costmap: Costmap, factor: int) -> Costmap:
    """Return a costmap of cells ``factor`` times as wide, each with the highest cost that it covers."""
    rows, cols = costmap.costs.shape
    row_starts, col_starts = np.arange(0, rows, factor), np.arange(0, cols, factor)
    by_rows = np.maximum.reduceat(costmap.costs, row_starts, axis=0)
    costs = np.ascontiguousarray(np.maximum.reduceat(by_rows, col_starts, axis=1))
    resolution = costmap.resolution * factor
    return Costmap(costs, resolution, costmap.origin_x, costmap.origin_y, costmap.track_unknown_space)


SMAC_2D = PlannerEntry(
    Smac2DParams,
    Smac2DPlanner,
    nav2=RosPlugin(
        slashed_in_humble("nav2_smac_planner", "SmacPlanner2D"),
        "Smac 2D",
        Smac2DParams,
        Keys(
            ros_only=frozenset({"plugin", "max_planning_time", "terminal_checking_interval"}),
            elsewhere=dict.fromkeys(
                (
                    "analytic_expansion_max_cost",
                    "analytic_expansion_max_length",
                    "analytic_expansion_ratio",
                    "angle_quantization_bins",
                    "cache_obstacle_heuristic",
                    "change_penalty",
                    "cost_penalty",
                    "debug_visualizations",
                    "goal_heading_mode",
                    "lattice_filepath",
                    "lookup_table_size",
                    "minimum_turning_radius",
                    "motion_model_for_search",
                    "non_straight_penalty",
                    "retrospective_penalty",
                    "reverse_penalty",
                    "rotation_penalty",
                    "smooth_path",
                    "smoother.optimizer",
                    "smoother.smoother",
                ),
                "a parameter of Hybrid-A*, State Lattice or an older Smac planner",
            ),
        ),
        stands_in_for=("nav2_smac_planner",),
    ),
)
