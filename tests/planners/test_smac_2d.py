"""Smac 2D: the cheapest path over eight neighbours, its tolerance, limits and smoother."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra

from gym_mapbench.costmap import Costmap, CostmapParams, build_static_costmap
from gym_mapbench.errors import ConfigError, EndpointError, NoPathError, UnsafeEndpointError
from gym_mapbench.kernels.smoothing import smooth
from gym_mapbench.planners.smac_2d import Smac2DParams, Smac2DPlanner, SmootherParams, downsampled
from gym_mapbench.releases import RELEASES
from gym_mapbench.world.footprint import Footprint
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.scenario import Pose

ROUGH = SmootherParams(max_iterations=0)
COSTS = hnp.arrays(
    np.uint8,
    hnp.array_shapes(min_dims=2, max_dims=2, min_side=2, max_side=12),
    elements=st.sampled_from([0, 0, 0, 60, 130, 252, 253, 254, 255]),
)


def metre_map(costs):
    return Costmap(np.ascontiguousarray(costs, np.uint8), 1.0, 0.0, 0.0)


def centre(cell, yaw=0.0):
    return Pose(cell[1] + 0.5, cell[0] + 0.5, yaw)


def cells_on(path):
    return np.floor(path[:, 1::-1]).astype(int)


def step_cost(cost, multiplier, allow_unknown):
    blocked = cost in (253, 254) or (cost == 255 and not allow_unknown)
    return np.inf if blocked else 1 + multiplier * int(cost) / 252


def cheapest(costs, start, goal, multiplier, allow_unknown):
    """Cost of the cheapest 8-connected path, by SciPy."""
    rows, cols = costs.shape
    edges = []
    for row, col in np.ndindex(rows, cols):
        for d_row, d_col in ((0, 1), (0, -1), (1, 0), (-1, 0), (1, 1), (1, -1), (-1, 1), (-1, -1)):
            r, c = row + d_row, col + d_col
            if 0 <= r < rows and 0 <= c < cols:
                cost = step_cost(costs[r, c], multiplier, allow_unknown) * np.hypot(d_row, d_col)
                edges.append((row * cols + col, r * cols + c, cost))
    tails, heads, weights = np.array([edge for edge in edges if np.isfinite(edge[2])]).reshape(-1, 3).T
    graph = coo_matrix((weights, (tails.astype(int), heads.astype(int))), shape=(rows * cols, rows * cols))
    return dijkstra(graph.tocsr(), indices=start[0] * cols + start[1])[goal[0] * cols + goal[1]]


@given(COSTS, st.data(), st.booleans(), st.sampled_from([0.0, 1.0, 3.0]))
@settings(max_examples=60)
def test_the_path_is_the_cheapest(costs, data, allow_unknown, multiplier):
    start, goal = (tuple(data.draw(st.integers(0, side - 1)) for side in costs.shape) for _ in range(2))
    assume(start != goal)
    planner = Smac2DPlanner(
        Smac2DParams(tolerance=0.0, allow_unknown=allow_unknown, cost_travel_multiplier=multiplier, smoother=ROUGH)
    )
    expected = cheapest(costs, start, goal, multiplier, allow_unknown)
    if np.isinf(expected) or np.isinf(step_cost(costs[start], multiplier, allow_unknown)):
        with pytest.raises(NoPathError, match=r"not connected|the start is in an obstacle"):
            planner.plan(metre_map(costs), centre(start), centre(goal))
        return
    cells = cells_on(planner.plan(metre_map(costs), centre(start), centre(goal)))
    assert [tuple(cells[0]), tuple(cells[-1])] == [start, goal]
    lengths = np.hypot(*np.diff(cells, axis=0).T)
    assert set(lengths.round(3)) <= {1.0, 1.414}
    paid = sum(
        length * step_cost(costs[tuple(cell)], multiplier, allow_unknown)
        for length, cell in zip(lengths, cells[1:], strict=True)
    )
    assert paid == pytest.approx(expected, rel=1e-9)


def test_a_straight_path_keeps_to_cell_centres_and_turns_at_the_goal():
    path = Smac2DPlanner().plan(metre_map(np.zeros((5, 30))), Pose(1.2, 2.7), Pose(21.9, 2.1, 1.0))
    assert path[:, 0] == pytest.approx(np.arange(1.5, 22), abs=1e-9)
    assert path[:, 1] == pytest.approx(2.5)
    assert path[:, 2].tolist() == [0.0] * 20 + [1.0]


def test_a_blocked_goal_is_approached_within_the_tolerance():
    costs = np.zeros((9, 30), np.uint8)
    costs[:, 20:] = 254
    near = Smac2DPlanner(Smac2DParams(tolerance=2.5, smoother=ROUGH))
    path = near.plan(metre_map(costs), Pose(2.5, 4.5), Pose(21.5, 4.5, 0.5))
    assert path[-1].tolist() == [19.5, 4.5, 0.5]
    with pytest.raises(NoPathError, match="not connected"):
        Smac2DPlanner(Smac2DParams(tolerance=2.0)).plan(metre_map(costs), Pose(2.5, 4.5), Pose(21.5, 4.5))


def test_the_search_can_be_limited():
    costmap, start, goal = metre_map(np.zeros((9, 30))), Pose(2.5, 4.5), Pose(25.5, 4.5)
    with pytest.raises(NoPathError, match="cut off"):
        Smac2DPlanner(Smac2DParams(max_iterations=10)).plan(costmap, start, goal)
    unlimited = Smac2DPlanner(Smac2DParams(max_iterations=0, smoother=ROUGH)).plan(costmap, start, goal)
    hasty = Smac2DParams(tolerance=5.0, max_on_approach_iterations=1, smoother=ROUGH)
    assert len(unlimited) == 24
    assert 24 - 5 <= len(Smac2DPlanner(hasty).plan(costmap, start, goal)) < 24


def test_smoothing_is_that_of_the_formula_and_stays_out_of_walls():
    costs = np.zeros((8, 20), np.uint8)
    zigzag = np.column_stack([np.arange(12) + 4.5, 4.0 + np.arange(12) % 2])
    once, at_rest = smooth(zigzag, costs, 1.0, 0.0, 0.0, 0.2, 0.3, 1e-10, 2)
    assert not at_rest
    # The first inner point: 5 + 0.2 (5 - 5) + 0.3 (4 + 4 - 10) = 4.4; the second uses it: 4 + 0.3 (4.4 + 5 - 8).
    assert once[1:3, 1] == pytest.approx([4.4, 4.42])
    smoothed, at_rest = smooth(zigzag, costs, 1.0, 0.0, 0.0, 0.2, 0.3, 1e-10, 1000)
    assert at_rest
    inner = slice(1, -1)
    pull = 0.2 * (zigzag - smoothed)[inner] + 0.3 * (smoothed[2:] + smoothed[:-2] - 2 * smoothed[inner])
    assert np.abs(pull).max() < 1e-9
    assert (smoothed[[0, -1]] == zigzag[[0, -1]]).all()
    costs[4, 5] = 253
    blocked, at_rest = smooth(zigzag, costs, 1.0, 0.0, 0.0, 0.2, 0.3, 1e-10, 1000)
    assert not at_rest
    assert (blocked == zigzag).all()


def test_smoothing_rounds_a_corner():
    grid = GridMap.from_rows(["." * 60] * 30 + ["." * 20 + "#" * 40] * 30)
    costmap = build_static_costmap(grid, CostmapParams.example_global(), Footprint.from_radius(0.1))
    start, goal = Pose(0.5, 0.3), Pose(2.8, 2.5)
    rough = Smac2DPlanner(Smac2DParams(smoother=ROUGH)).plan(costmap, start, goal)
    smoothed = Smac2DPlanner().plan(costmap, start, goal)
    turns = [np.abs(np.diff(np.unwrap(path[:-1, 2]))).max() for path in (rough, smoothed)]
    assert turns[1] < turns[0] / 2
    assert (smoothed[[0, -1], :2] == rough[[0, -1], :2]).all()


def test_downsampling_keeps_the_dearest_cost():
    costs = np.zeros((5, 7), np.uint8)
    costs[4, 6], costs[0, 1] = 254, 90
    coarse = downsampled(metre_map(costs), 2)
    assert coarse.costs.tolist() == [[90, 0, 0, 0], [0, 0, 0, 0], [0, 0, 0, 254]]
    assert coarse.resolution == 2.0
    params = Smac2DParams(downsample_costmap=True, downsampling_factor=2, smoother=ROUGH)
    path = Smac2DPlanner(params).plan(metre_map(np.zeros((8, 20))), Pose(1, 1), Pose(15, 1))
    assert path[:, 0].tolist() == [1, 3, 5, 7, 9, 11, 13, 15]


def test_clock_limits_are_refused():
    with pytest.raises(ConfigError, match="max_planning_time"):
        Smac2DParams(max_planning_time=2.0)


def of(release, **params):
    return Smac2DPlanner(Smac2DParams(release=release, smoother=ROUGH, **params))


@pytest.mark.parametrize("release", RELEASES)
def test_a_start_on_an_obstacle(release):
    """Humble refuses it; later releases drive off it, unless all cells around are blocked."""
    costs = np.zeros((9, 20), np.uint8)
    costs[4, 3] = 253
    start, goal = Pose(3.5, 4.5), Pose(15.5, 4.5)
    if release == "humble":
        with pytest.raises(UnsafeEndpointError, match="the start is in an obstacle"):
            of(release).plan(metre_map(costs), start, goal)
    else:
        assert len(of(release).plan(metre_map(costs), start, goal)) == 13
    costs[3:6, 2:5] = 254
    kind = UnsafeEndpointError if release == "humble" else EndpointError
    with pytest.raises(kind, match="the start is in" if release == "humble" else "all cells around the start are"):
        of(release).plan(metre_map(costs), start, goal)


@pytest.mark.parametrize("release", RELEASES)
def test_a_free_start_between_obstacles_and_the_edge_of_the_map(release):
    """Only since Jazzy has the failure after a single iteration a name of its own."""
    costs = np.zeros((6, 20), np.uint8)
    costs[:2, :2] = 254
    costs[0, 0] = 0
    with pytest.raises(NoPathError) as error:
        of(release).plan(metre_map(costs), Pose(0.5, 0.5), Pose(15.5, 4.5))
    assert isinstance(error.value, EndpointError) == (release != "humble")


@pytest.mark.parametrize(
    ("release", "tolerance", "blocked", "refused"),
    [
        ("humble", 0.0, 1, False),
        ("jazzy", 0.0, 1, True),
        ("jazzy", 0.1, 1, False),
        ("jazzy", 0.1, 5, False),
        ("lyrical", 0.0, 1, True),
        ("lyrical", 0.9, 1, True),
        ("lyrical", 1.5, 1, False),
        ("lyrical", 1.5, 5, True),
        ("lyrical", 4.0, 5, False),
    ],
)
def test_an_occupied_goal(release, tolerance, blocked, refused):
    """Jazzy refuses it without a tolerance; Lyrical with one of less than a cell, or no free cell within it."""
    costs, around = np.zeros((11, 30), np.uint8), blocked // 2
    costs[5 - around : 6 + around, 20 - around : 21 + around] = 254
    planner, ends = of(release, tolerance=tolerance), (Pose(2.5, 5.5), Pose(20.5, 5.5))
    if tolerance > blocked / 2 and not refused:
        assert len(planner.plan(metre_map(costs), *ends))
        return
    with pytest.raises(NoPathError, match="the goal is in an obstacle" if refused else "not connected") as error:
        planner.plan(metre_map(costs), *ends)
    assert isinstance(error.value, EndpointError) == refused


@pytest.mark.parametrize("release", RELEASES)
def test_lyricals_path_ends_at_the_goals_position(release):
    costs, start, goal = np.zeros((5, 30), np.uint8), Pose(1.2, 2.7), Pose(21.9, 2.1, 1.0)
    path = of(release).plan(metre_map(costs), start, goal)
    assert path[-1].tolist() == ([21.9, 2.1, 1.0] if release == "lyrical" else [21.5, 2.5, 1.0])
    approach = of(release, use_final_approach_orientation=True).plan(metre_map(costs), start, goal)
    assert approach[-1, 2] == pytest.approx(np.arctan2(-0.4, 1.4) if release == "lyrical" else 0.0)
    near = of(release, tolerance=2.5)
    costs[:, 20:] = 254
    costs[:, 22] = 0
    assert near.plan(metre_map(costs), start, Pose(21.1, 2.5))[-1, :2].tolist() == [19.5, 2.5]


@pytest.mark.parametrize("release", RELEASES)
def test_a_plan_from_the_goals_own_cell(release):
    costs, start, goal = np.full((3, 3), 254, np.uint8), Pose(1.2, 1.7, 0.5), Pose(1.9, 1.1, 1.0)
    if release == "humble":
        with pytest.raises(EndpointError, match="the robot stands on an obstacle"):
            of(release).plan(metre_map(costs), start, goal)
        costs[:] = 0
    (pose,) = of(release).plan(metre_map(costs), start, goal).tolist()
    assert pose == ([1.9, 1.1, 1.0] if release == "lyrical" else [1.2, 1.7, 1.0])
