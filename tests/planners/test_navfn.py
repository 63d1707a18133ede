"""NavFn against the worked examples of the reference, and against a plain twin of its wave."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from gym_mapbench.costmap import Costmap
from gym_mapbench.errors import EndpointError, NoPathError
from gym_mapbench.kernels.wavefront import LIST_CELLS, cell_potential, spread
from gym_mapbench.planners.navfn import NavfnParams, NavfnPlanner, navfn_cell, navfn_costs
from gym_mapbench.world.scenario import Pose

POT_HIGH = np.float32(1e10)


def cells_as_metres(costs):
    """A costmap of 1 m cells at the origin, so that whole metres are NavFn's cells."""
    return Costmap(np.asarray(costs, np.uint8), 1.0, 0.0, 0.0)


FREE = cells_as_metres(np.zeros((21, 21)))
COSTS = hnp.arrays(
    np.uint8,
    hnp.array_shapes(min_dims=2, max_dims=2, min_side=3, max_side=12),
    elements=st.sampled_from([0, 40, 252, 254, 255]),
)


class PlainNavfn:
    """NavFn's wave, written as the reference tells it, counting cycles and cell updates."""

    def __init__(self, costs, start, goal, allow_unknown=True, use_astar=False, list_cells=LIST_CELLS):
        self.cost = [[self.cell_cost(int(c), allow_unknown) for c in row] for row in costs]
        self.cost[start[0]][start[1]] = 50
        self.rows, self.cols = len(costs), len(costs[0])
        for row in range(self.rows):
            for col in range(self.cols):
                if row in (0, self.rows - 1) or col in (0, self.cols - 1):
                    self.cost[row][col] = 254
        self.goal, self.use_astar, self.list_cells = goal, use_astar, list_cells
        self.potential = np.full((self.rows, self.cols), POT_HIGH)
        self.potential[start] = 0
        self.pending, self.lists = set(), {"cur": [], "next": [], "over": []}
        for d_row, d_col in ((0, 1), (0, -1), (-1, 0), (1, 0)):
            self.push("cur", (start[0] + d_row, start[1] + d_col))
        self.threshold = np.float32(254 + self.extra(start))
        self.cycles = self.updates = 0
        self.spread()

    @staticmethod
    def cell_cost(cost, allow_unknown):
        if cost < 253:
            return int(50 + 0.8 * cost)
        return 253 if cost == 255 and allow_unknown else 254

    def extra(self, cell):
        return np.float32(math.dist(cell, self.goal) * 50) if self.use_astar else np.float32(0)

    def push(self, name, cell):
        inside = 0 <= cell[0] < self.rows and 0 <= cell[1] < self.cols
        fits = len(self.lists[name]) < self.list_cells
        if inside and fits and cell not in self.pending and self.cost[cell[0]][cell[1]] < 254:
            self.pending.add(cell)
            self.lists[name].append(cell)

    def spread(self):
        for _ in range(max(self.rows * self.cols // 20, self.rows + self.cols)):
            if not self.lists["cur"]:
                return
            self.cycles += 1
            self.pending -= set(self.lists["cur"])
            for cell in self.lists["cur"]:
                self.update(cell)
            self.lists["cur"], self.lists["next"] = self.lists["next"], []
            if not self.lists["cur"]:
                self.threshold += np.float32(100)
                self.lists["cur"], self.lists["over"] = self.lists["over"], []
            if self.potential[self.goal] < POT_HIGH:
                return

    def update(self, cell):
        self.updates += 1
        near = [(cell[0], cell[1] - 1), (cell[0], cell[1] + 1), (cell[0] - 1, cell[1]), (cell[0] + 1, cell[1])]
        left, right, down, up = (self.potential[n] for n in near)
        tx, ty, h = min(left, right), min(down, up), np.float32(self.cost[cell[0]][cell[1]])
        low, dc = min(tx, ty), abs(tx - ty)
        q = float(dc / h)
        pot = low + h if dc >= h else low + h * np.float32(-0.2301 * q * q + 0.5307 * q + 0.7040)
        if pot >= self.potential[cell]:
            return
        self.potential[cell] = pot
        pot = pot + self.extra(cell)
        for n in near:
            if self.potential[n] > pot + np.float32(0.707106781 * self.cost[n[0]][n[1]]):
                self.push("next" if pot < self.threshold else "over", n)


def test_costs_of_the_worked_example():
    assert navfn_costs(True)[[0, 1, 50, 100, 200, 252, 253, 254, 255]].tolist() == [
        50, 50, 90, 130, 210, 251, 254, 254, 253,
    ]  # fmt: skip
    assert navfn_costs(False)[255] == 254


@pytest.mark.parametrize(
    ("across", "along", "cost", "expected"),
    [
        (50, 50, 50, 85.2),
        (50, 85.2, 50, 98.1786),
        (100, 120, 90, 172.9513),
        (100, 189, 90, 190.3409),
        (0, 1e10, 50, 50),
    ],
)
def test_update_of_the_worked_example(across, along, cost, expected):
    for fused in (False, True):
        assert cell_potential(*np.float32([across, along, cost]), fused) == pytest.approx(expected, abs=1e-4)


def test_straight_path_of_the_worked_example():
    planner, start, goal = NavfnPlanner(), Pose(5, 10), Pose(15, 10, 1.0)
    potential = planner.potential(FREE, start, goal)
    assert potential[10, 5:16].tolist() == [50.0 * k for k in range(11)]
    assert [potential[10 + k, 5 + k] for k in (1, 2, 3)] == pytest.approx([85.2, 162.446, 237.558], abs=1e-3)
    assert potential[11, 7] == potential[12, 6] == pytest.approx(127.246, abs=1e-3)
    path = planner.plan(FREE, start, goal)
    # The walk has 18 points; the goal is appended to them, for it is where the walk began.
    assert len(path) == 19
    assert path[[0, 1, 2, 14, 15, 16, 17, 18], 0].tolist() == [5, 6, 6.5, 12.5, 13, 14, 15, 15]
    assert (path[:, 1] == 10).all()
    assert path[:, 2].tolist() == [0.0] * 18 + [1.0]


@pytest.mark.parametrize(("use_astar", "at_goal", "updates"), [(False, 647.441, 310), (True, 647.069, 175)])
def test_slanting_path_of_the_worked_example(use_astar, at_goal, updates):
    planner, start, goal = NavfnPlanner(NavfnParams(use_astar=use_astar)), Pose(5, 5), Pose(15, 12)
    assert planner.potential(FREE, start, goal)[12, 15] == pytest.approx(at_goal, abs=1e-3)
    twin = PlainNavfn(FREE.costs, (5, 5), (12, 15), use_astar=use_astar)
    assert twin.updates == updates
    assert use_astar or twin.cycles == 18
    path = planner.plan(FREE, start, goal)
    assert len(path) == 24
    assert path[-4:-1, :2] == pytest.approx(np.array([[13.60, 10.71], [14, 11], [15, 12]]), abs=0.01)


def test_cells_are_rounded():
    costmap = Costmap(np.zeros((60, 60), np.uint8), 0.05, -1.2, -1.2)
    assert [costmap.world_to_map(w, w)[0] for w in (0.024, 0.026)] == [24, 24]
    assert [navfn_cell(costmap, w, w)[0] for w in (0.024, 0.026)] == [24, 25]
    assert navfn_cell(costmap, -1.21, 0) is None
    assert navfn_cell(costmap, 0, 1.79) is None


@given(COSTS, st.data(), st.booleans(), st.booleans())
@settings(max_examples=60, deadline=None)
def test_wave_equals_its_plain_twin(costs, data, allow_unknown, use_astar):
    rows, cols = costs.shape
    start, goal = (data.draw(st.tuples(st.integers(0, rows - 1), st.integers(0, cols - 1))) for _ in range(2))
    planner = NavfnPlanner(NavfnParams(allow_unknown=allow_unknown, use_astar=use_astar))
    potential = planner.potential(cells_as_metres(costs), Pose(start[1], start[0]), Pose(goal[1], goal[0]))
    expected = PlainNavfn(costs.tolist(), start, goal, allow_unknown, use_astar).potential
    assert np.array_equal(np.where(np.isinf(potential), POT_HIGH, potential), expected)


@pytest.mark.parametrize("list_cells", [4, 6, 9])
def test_cells_beyond_a_full_list_are_lost(list_cells):
    rng, start, goal, losses = np.random.default_rng(4), (6, 7), (1, 1), 0
    for use_astar in (False, True) * 5:
        costs = rng.choice([0, 40, 252, 254], (12, 14), p=[0.4, 0.3, 0.2, 0.1]).astype(np.uint8)
        ends = start[0] * 14 + start[1], goal[0] * 14 + goal[1]
        potential, whole = (
            spread(costs, navfn_costs(True), *ends, use_astar, False, most) for most in (list_cells, LIST_CELLS)
        )
        twin = PlainNavfn(costs.tolist(), start, goal, use_astar=use_astar, list_cells=list_cells)
        assert np.array_equal(potential, twin.potential)
        losses += not np.array_equal(potential, whole)
    assert losses


def test_an_unreachable_goal_is_approached_within_the_tolerance():
    costs = np.zeros((21, 21))
    costs[:, 14:] = 254
    costmap = cells_as_metres(costs)
    path = NavfnPlanner(NavfnParams(tolerance=3.0)).plan(costmap, Pose(4, 10), Pose(15, 10, 1.0))
    assert path[-1].tolist() == [13, 10, 1.0]
    with pytest.raises(NoPathError, match="not connected"):
        NavfnPlanner(NavfnParams(tolerance=1.0)).plan(costmap, Pose(4, 10), Pose(15, 10))


def test_the_start_counts_as_free_and_the_costmap_stays_as_it_is():
    costs = np.zeros((21, 21), np.uint8)
    costs[5, 5] = 254
    before = costs.copy()
    path = NavfnPlanner().plan(cells_as_metres(costs), Pose(5, 5), Pose(12, 5))
    assert path[0].tolist() == [5, 5, 0]
    assert np.array_equal(costs, before)


def test_final_orientation_can_follow_the_approach():
    planner = NavfnPlanner(NavfnParams(use_final_approach_orientation=True))
    assert planner.plan(FREE, Pose(5, 10), Pose(15, 10, 2.0))[-1, 2] == 0.0
    assert planner.plan(FREE, Pose(10, 5), Pose(10, 15, 2.0))[-1, 2] == pytest.approx(math.pi / 2)
    assert planner.plan(FREE, Pose(5, 10, 0.3), Pose(5, 10, 2.0)).tolist() == [[5, 10, 0.3]]


@pytest.mark.parametrize(("beyond", "more"), [(5e-4, 0), (2e-3, 1)])
def test_jazzy_does_not_append_a_goal_where_the_path_ends_already(beyond, more):
    costmap = Costmap(np.zeros((40, 40), np.uint8), 0.05, 0.0, 0.0)
    goal = Pose(1.5 + beyond, 1.0, 0.7)
    lengths = {}
    for release in ("humble", "jazzy"):
        path = NavfnPlanner(NavfnParams(release=release)).plan(costmap, Pose(0.5, 1.0), goal)
        assert path[-1].tolist() == list(goal)
        lengths[release] = len(path)
    assert lengths["humble"] - lengths["jazzy"] == 1 - more


def test_jazzys_endpoints():
    costmap = Costmap(np.full((20, 20), 254, np.uint8), 0.05, 0.0, 0.0)
    jazzy = NavfnPlanner(NavfnParams(release="jazzy", tolerance=0.0))
    tolerant = NavfnPlanner(NavfnParams(release="jazzy"))
    assert len(tolerant.plan(costmap, Pose(0.5, 0.5, 0.0), Pose(0.5, 0.5, 1.0))) == 1
    with pytest.raises(EndpointError, match="the goal is in an obstacle"):
        jazzy.plan(costmap, Pose(0.5, 0.5), Pose(0.7, 0.5))
    with pytest.raises(EndpointError, match="the goal is off the map"):
        jazzy.plan(costmap, Pose(0.5, 0.5), Pose(1.2, 0.5))
    with pytest.raises(NoPathError, match="stands on an obstacle"):
        NavfnPlanner().plan(costmap, Pose(0.5, 0.5, 0.0), Pose(0.5, 0.5, 1.0))


def test_start_at_the_goal():
    assert NavfnPlanner().plan(FREE, Pose(5, 10, 0.3), Pose(5, 10, 2.0)).tolist() == [[5, 10, 2.0]]
    with pytest.raises(NoPathError, match="stands on an obstacle"):
        NavfnPlanner().plan(cells_as_metres(np.full((9, 9), 254)), Pose(4, 4), Pose(4, 4))


@pytest.mark.parametrize(("start", "goal", "which"), [((-1, 5), (5, 5), "start"), ((5, 5), (5, 21), "goal")])
def test_points_off_the_map_are_refused(start, goal, which):
    with pytest.raises(NoPathError, match=f"the {which} is off the map"):
        NavfnPlanner().plan(FREE, Pose(*start), Pose(*goal))


@settings(max_examples=60, deadline=None)
@given(COSTS, st.data())
def test_a_kept_potential_is_that_of_a_new_planner(costs, data):
    other = costs.copy()
    other[1, 1] = data.draw(st.sampled_from([0, 252, 254]))
    planner, maps = NavfnPlanner(), [cells_as_metres(one) for one in (costs, other, costs.T.copy())]
    pose = st.builds(Pose, st.integers(0, 2), st.integers(0, 2), st.just(0.0))
    for costmap, start, goal in data.draw(st.lists(st.tuples(st.sampled_from(maps), pose, pose), max_size=12)):
        expected = NavfnPlanner().potential(costmap, start, goal)
        for _ in range(2):
            np.testing.assert_array_equal(planner.potential(costmap, start, goal), expected)
