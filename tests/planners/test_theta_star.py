"""Theta*: straight pieces, lines of sight, and what a path costs."""

from __future__ import annotations

import heapq
import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gym_mapbench.costmap import Costmap
from gym_mapbench.errors import EndpointError, NoPathError, UnsafeEndpointError
from gym_mapbench.kernels.theta_star import length_in_sight, search_corners
from gym_mapbench.planners.theta_star import ThetaStarParams, ThetaStarPlanner
from gym_mapbench.releases import RELEASES
from gym_mapbench.world.scenario import Pose


def metre_map(costs):
    return Costmap(np.ascontiguousarray(costs, np.uint8), 1.0, 0.0, 0.0)


def walk(first, second):
    """Cells of Nav2's line of sight between two cells, both included, and the cells beside each diagonal step.

    A step changes the column if the straight line crosses the border to the next one before it is level with the
    middle of the next row; likewise the row, and a tie goes to the row.
    """
    (r0, c0), (r1, c1) = first, second
    rows, cols = abs(r1 - r0), abs(c1 - c0)
    up, right = (1 if r1 > r0 else -1), (1 if c1 > c0 else -1)
    row = col = 0
    cells, beside = [first], []
    while (row, col) != (rows, cols):
        crosses = (col + Fraction(1, 2)) * rows < (row + 1) * cols
        climbs = (row + Fraction(1, 2)) * cols <= (col + 1) * rows
        if crosses and climbs:
            beside += [(r0 + up * row, c0 + right * (col + 1)), (r0 + up * (row + 1), c0 + right * col)]
        row, col = row + climbs, col + crosses
        cells.append((r0 + up * row, c0 + right * col))
    return cells, beside


@given(*[st.integers(0, 12)] * 4, st.integers(0, 1000))
@settings(max_examples=300)
def test_a_line_of_sight_equals_its_plain_twin(r0, c0, r1, c1, seed):
    width, rng = 13, np.random.default_rng(seed)
    line, step = rng.random(width * width), np.where(rng.random(width * width) < 0.03, np.inf, 0.0)
    cells, beside = walk((r0, c0), (r1, c1))
    ends = r0 * width + c0, r1 * width + c1
    free = all(np.isfinite(step[row * width + col]) for row, col in beside)
    expected = 2.0 + sum(line[row * width + col] for row, col in cells[:-1]) if free else np.inf
    assert length_in_sight(step, line, width, *ends, 2.0, np.inf) == pytest.approx(expected)
    assert length_in_sight(step, line, width, *ends, 2.0, 2.0) == 2.0


def test_a_line_of_sight_sums_a_cell_per_step_along_its_longer_axis():
    cells, beside = walk((0, 0), (2, 5))
    assert cells == [(0, 0), (0, 1), (1, 2), (1, 3), (2, 4), (2, 5)]
    assert beside == [(0, 2), (1, 1), (1, 4), (2, 3)]
    assert length_in_sight(np.zeros(60), np.ones(60), 10, 0, 25, 0.0, np.inf) == 5.0


class Node:
    """A cell of the plain twin, ordered by what its path costs with the estimate of what is left."""

    def __init__(self, cell):
        self.cell, self.length, self.key, self.parent, self.listed = cell, math.inf, math.inf, self, False

    def __lt__(self, other):
        return self.key < other.key


def plain_corners(costs, step_cost, line_cost, start, goal, neighbours, w_euc, w_heur):
    """Cells where a path turns; a key falls inside the heap as it stands, and the start is expanded twice.

    The cell that empties the heap is neither expanded nor taken for the goal.
    """
    nodes = {cell: Node(cell) for cell in np.ndindex(costs.shape)}

    def looks_back(node):
        ancestor = node.parent.parent
        cells, beside = walk(node.cell, ancestor.cell)
        if any(math.isinf(step_cost[costs[cell]]) for cell in beside):
            return
        length = sum(float(line_cost[costs[cell]]) for cell in cells[:-1])
        length = ancestor.length + w_euc * math.dist(node.cell, ancestor.cell) + length
        if length < node.length:
            node.length, node.parent = length, ancestor
            node.key = length + w_heur * math.dist(node.cell, goal)

    node, heap = nodes[start], [nodes[start]]
    node.length = float(step_cost[costs[start]])
    node.key = node.length + w_heur * math.dist(start, goal)
    while node.cell != goal:
        node.listed = False
        looks_back(node)
        for d_row, d_col in ((1, 0), (-1, 0), (0, 1), (0, -1), (-1, 1), (1, -1), (1, 1), (-1, -1))[:neighbours]:
            near = nodes.get((node.cell[0] + d_row, node.cell[1] + d_col))
            if near is None:
                continue
            length = node.length + w_euc * math.hypot(d_row, d_col) + float(step_cost[costs[near.cell]])
            key = length + w_heur * math.dist(near.cell, goal)
            if key < near.key:
                near.length, near.key, near.parent = length, key, node
                if not near.listed:
                    near.listed = True
                    heapq.heappush(heap, near)
        node = heapq.heappop(heap)
        if not heap:
            return []
    corners = [node.cell]
    while node.parent is not node:
        node = node.parent
        corners.append(node.cell)
    return corners[::-1]


@given(
    st.integers(0, 2**31), st.sampled_from([4, 8]), st.sampled_from([0.5, 1.0, 2.0]), st.sampled_from([0.0, 1.0, 2.0])
)
@settings(max_examples=60, deadline=None)
def test_the_search_equals_its_plain_twin(seed, corners, w_euc, w_traversal):
    rng = np.random.default_rng(seed)
    shape = tuple(rng.integers(3, 25, 2))
    costs = np.where(rng.random(shape) < 0.15, 254, rng.choice([0, 0, 40, 128, 251, 252, 255], shape)).astype(np.uint8)
    start, goal = (tuple(int(n) for n in rng.integers(0, shape)) for _ in range(2))
    planner = ThetaStarPlanner(ThetaStarParams(w_euc_cost=w_euc, w_traversal_cost=w_traversal))
    asked = costs, *planner._traversal_costs()
    weights = corners, w_euc, min(1.0, w_euc)
    found = search_corners(*asked, *start, *goal, *weights)
    assert [tuple(cell) for cell in found.tolist()] == plain_corners(*asked, start, goal, *weights)


def test_free_space_is_crossed_in_one_line_short_of_the_goal():
    path = ThetaStarPlanner().plan(metre_map(np.zeros((40, 40))), Pose(5.5, 5.5), Pose(30.2, 15.9, 1.0))
    assert path[0].tolist() == [5.5, 5.5, 0.0]
    assert path[-1, 2] == 1.0
    assert np.hypot(*(path[-1, :2] - (30.5, 15.5))) < 2.0
    steps = np.hypot(*np.diff(path[:, :2], axis=0).T)
    assert steps.max() < 2.0
    assert np.median(steps) == pytest.approx(1.0)
    # The start's traversal cost makes every cell on the way cost the same, so the way is nearly straight.
    assert steps.sum() <= 1.02 * np.hypot(*(path[-1, :2] - path[0, :2]))


@pytest.mark.parametrize("goal", [2.5, 6.5])
def test_a_passage_one_cell_wide_without_another_open_cell_has_no_path(goal):
    costs = np.full((3, 8), 254)
    costs[1, 1:7] = 0
    start, goal = Pose(1.5, 1.5), Pose(goal, 1.5)
    with pytest.raises(NoPathError):
        ThetaStarPlanner().plan(metre_map(costs), start, goal)
    costs[2, 1] = 0  # beside the start, farther from the goal: it stays open
    assert len(ThetaStarPlanner().plan(metre_map(costs), start, goal)) == int(goal.x - start.x)


def test_dear_cells_are_worth_a_detour():
    costs = np.zeros((30, 60))
    costs[5:, 25:35] = 200
    start, goal = Pose(10.5, 15.5), Pose(50.5, 15.5)
    careful = ThetaStarPlanner(ThetaStarParams(w_traversal_cost=5.0)).plan(metre_map(costs), start, goal)
    hasty = ThetaStarPlanner(ThetaStarParams(w_traversal_cost=0.0)).plan(metre_map(costs), start, goal)
    assert careful[:, 1].min() < 5
    assert np.ptp(hasty[:, 1]) == 0


def test_four_corners_go_around_a_diagonal_gap():
    costs = np.zeros((6, 6), np.uint8)
    costs[:3, 3:] = costs[3:, :3] = 254
    start, goal = Pose(1.5, 1.5), Pose(4.5, 4.5)
    assert len(ThetaStarPlanner().plan(metre_map(costs), start, goal)) > 2
    with pytest.raises(NoPathError, match="not connected"):
        ThetaStarPlanner(ThetaStarParams(how_many_corners=4)).plan(metre_map(costs), start, goal)


@pytest.mark.parametrize(
    ("cost", "at_start", "at_goal"),
    [(253, UnsafeEndpointError, UnsafeEndpointError), (254, UnsafeEndpointError, EndpointError)],
)
def test_start_and_goal_must_be_safe(cost, at_start, at_goal):
    costs = np.zeros((6, 6))
    costs[1, 1] = cost
    unsafe, safe = Pose(1.5, 1.5), Pose(4.5, 4.5)
    for ends, kind in (((unsafe, safe), at_start), ((safe, unsafe), at_goal)):
        with pytest.raises(kind, match="start or goal is in an obstacle"):
            ThetaStarPlanner().plan(metre_map(costs), *ends)


@pytest.mark.parametrize("release", RELEASES)
def test_a_second_plan_from_a_cell_on_an_obstacle_begins_since_jazzy(release):
    """Each plan first frees the cell from which the plan before it began, and the costmap's corner at first."""
    costs = np.zeros((8, 12), np.uint8)
    costs[3, 3] = costs[6, 6] = costs[0, 0] = 253
    costmap, goal = metre_map(costs), Pose(10.5, 3.5)
    planner = ThetaStarPlanner(ThetaStarParams(release=release))
    corner, first, other = Pose(0.5, 0.5), Pose(3.5, 3.5), Pose(6.5, 6.5)

    def begins(start):
        try:
            return len(planner.plan(costmap, start, goal)) > 0
        except UnsafeEndpointError:
            return False

    begun = [begins(start) for start in (corner, first, first, other, first, first)]
    assert begun == ([True, False, True, False, False, True] if release != "humble" else [False] * 6)
    assert costmap.costs[3, 3] == 253, "the costmap itself stays"
    with pytest.raises(EndpointError):
        planner.plan(metre_map(np.full((8, 12), 254)), other, goal)
    assert begins(first) == (release != "humble"), "a plan to an occupied goal leaves all as it is"


def test_unknown_cells_are_crossed_if_allowed():
    costs = np.zeros((9, 30))
    costs[:, 12:15] = 255
    start, goal = Pose(2.5, 4.5), Pose(25.5, 4.5)
    assert len(ThetaStarPlanner().plan(metre_map(costs), start, goal)) > 20
    with pytest.raises(NoPathError, match="not connected"):
        ThetaStarPlanner(ThetaStarParams(allow_unknown=False)).plan(metre_map(costs), start, goal)
