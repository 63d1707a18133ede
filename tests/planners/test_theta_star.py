"""Theta*: straight pieces, lines of sight, and what a path costs."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gym_mapbench.costmap import Costmap
from gym_mapbench.errors import NoPathError
from gym_mapbench.kernels.theta_star import traversal_on_line
from gym_mapbench.planners.theta_star import ThetaStarParams, ThetaStarPlanner
from gym_mapbench.world.scenario import Pose


def metre_map(costs):
    return Costmap(np.ascontiguousarray(costs, np.uint8), 1.0, 0.0, 0.0)


def passed_cells(first, second):
    """Cells whose inside the line between two centres enters, found by slicing it finely between the crossings."""
    (r0, c0), (r1, c1) = first, second
    cuts = {0.0, 1.0}
    for low, high in ((r0, r1), (c0, c1)):
        span = abs(high - low)
        cuts |= {(k + 0.5) / span for k in range(span)}
    ordered = sorted(cuts)
    middles = [(a + b) / 2 for a, b in itertools.pairwise(ordered) if b - a > 1e-9]
    return {(math.floor(r0 + t * (r1 - r0) + 0.5), math.floor(c0 + t * (c1 - c0) + 0.5)) for t in middles}


@given(*[st.integers(0, 12)] * 4)
@settings(max_examples=200)
def test_a_line_looks_at_every_cell_it_passes(r0, c0, r1, c1):
    width = 13
    weights = np.random.default_rng(1).random(width * width)
    total = traversal_on_line(weights, width, r0 * width + c0, r1 * width + c1, np.inf)
    cells = passed_cells((r0, c0), (r1, c1)) - {(r0, c0)}
    assert total == pytest.approx(sum(weights[r * width + c] for r, c in cells))


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


@pytest.mark.parametrize("cost", [253, 254])
def test_start_and_goal_must_be_safe(cost):
    costs = np.zeros((6, 6))
    costs[1, 1] = cost
    for ends in ((Pose(1.5, 1.5), Pose(4.5, 4.5)), (Pose(4.5, 4.5), Pose(1.5, 1.5))):
        with pytest.raises(NoPathError, match="start or goal is in an obstacle"):
            ThetaStarPlanner().plan(metre_map(costs), *ends)


def test_unknown_cells_are_crossed_if_allowed():
    costs = np.zeros((9, 30))
    costs[:, 12:15] = 255
    start, goal = Pose(2.5, 4.5), Pose(25.5, 4.5)
    assert len(ThetaStarPlanner().plan(metre_map(costs), start, goal)) > 20
    with pytest.raises(NoPathError, match="not connected"):
        ThetaStarPlanner(ThetaStarParams(allow_unknown=False)).plan(metre_map(costs), start, goal)
