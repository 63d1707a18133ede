"""What holds for every registered planner."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy.ndimage import label

from controllers.nav2_params import NavigationParams, PlannerPlugin, load_preset, write_nav2_params
from gym_mapbench.costmap import Costmap, CostmapParams, build_static_costmap
from gym_mapbench.errors import ConfigError, NoPathError, PluginError
from gym_mapbench.planners import PLANNERS, PlannerEntry, make_planner
from gym_mapbench.planners.theta_star import ThetaStarPlanner
from gym_mapbench.settings import Settings
from gym_mapbench.world.footprint import Footprint
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.scenario import Pose
from tests.planners.test_theta_star import plain_corners

NAMES = sorted(PLANNERS)
ALL_EIGHT = np.ones((3, 3))
WALLS = hnp.arrays(bool, (14, 14), elements=st.sampled_from([False, False, False, True]))
INNER = st.tuples(st.integers(1, 12), st.integers(1, 12))
NO_TOLERANCE = {"navfn": {"tolerance": 0.0}, "smac_2d": {"tolerance": 0.0}, "theta_star": {}}


def metre_map(costs):
    return Costmap(np.ascontiguousarray(costs, np.uint8), 1.0, 0.0, 0.0)


def in_cell(cell):
    """A pose that NavFn, which rounds, and the others, which truncate, see in the same cell."""
    return Pose(cell[1] + 0.25, cell[0] + 0.25)


def finds(name, costmap, start, goal):
    try:
        return make_planner(name, **NO_TOLERANCE[name]).plan(costmap, in_cell(start), in_cell(goal))
    except NoPathError:
        return None


@pytest.mark.parametrize("name", NAMES)
@given(WALLS, INNER, INNER)
@settings(max_examples=40)
def test_a_path_is_found_exactly_where_there_is_one(name, walls, start, goal):
    walls[[0, -1]] = walls[:, [0, -1]] = True
    walls[start] = walls[goal] = False
    assume(start != goal)
    parts, _ = label(~walls, None if name == "navfn" else ALL_EIGHT)
    costs = np.where(walls, 254, 0)
    path, is_way = finds(name, metre_map(costs), start, goal), parts[start] == parts[goal]
    if name == "theta_star":  # it misses a way where the last open cell is the goal or the only way on
        found = plain_corners(costs, *ThetaStarPlanner()._traversal_costs(), start, goal, 8, 1.0, 1.0)
        assert is_way or not found
        is_way = bool(found)
    assert (path is not None) == is_way
    if path is not None:
        assert np.abs(path[0, :2] - in_cell(start)[:2]).max() <= 0.25
        assert np.abs(path[-1, :2] - in_cell(goal)[:2]).max() <= 2.0
        assert np.hypot(*np.diff(path[:, :2], axis=0).T).max(initial=0) <= 2.0


@pytest.mark.parametrize("name", NAMES)
@given(st.integers(0, 10**6))
@settings(max_examples=15)
def test_paths_avoid_inflated_obstacles(name, seed):
    rng = np.random.default_rng(seed)
    occupied = np.zeros((60, 60), bool)
    for row, col in rng.integers(5, 55, (8, 2)):
        occupied[row : row + rng.integers(1, 8), col : col + rng.integers(1, 8)] = True
    grid = GridMap(occupied)
    costmap = build_static_costmap(grid, CostmapParams.example_global(), Footprint.from_radius(0.12))
    start, goal = Pose(0.11, 0.11), Pose(2.81, 2.81, 1.0)
    before = costmap.costs.copy()
    try:
        path = make_planner(name).plan(costmap, start, goal)
    except NoPathError:
        return
    assert np.array_equal(costmap.costs, before)
    assert np.isfinite(path).all()
    assert path.dtype == np.float64
    assert path.shape[1] == 3
    assert path[-1, 2] == 1.0
    # NavFn's cells lie half a cell beside the costmap's.
    shift = 0.025 if name == "navfn" else 0.0
    cells = ((path[:-1, 1::-1] + shift) / 0.05).astype(int)
    assert costmap.costs[tuple(cells.T)].max() <= 252
    assert not occupied[tuple((path[:, 1::-1] / 0.05).astype(int).T)].any()


@pytest.mark.parametrize("name", NAMES)
def test_the_same_question_has_the_same_answer(name):
    rng = np.random.default_rng(5)
    costs = np.where(rng.random((50, 50)) < 0.2, 254, rng.integers(0, 200, (50, 50)))
    costs[2, 2] = costs[40, 44] = 0
    costmap = metre_map(costs)
    first, second = (finds(name, costmap, (2, 2), (40, 44)) for _ in range(2))
    assert first is not None
    assert np.array_equal(first, second)


@pytest.mark.parametrize("name", NAMES)
def test_origin_and_resolution_only_move_and_scale_the_path(name):
    rng = np.random.default_rng(6)
    costs = np.where(rng.random((40, 40)) < 0.1, 254, 0).astype(np.uint8)
    plain = make_planner(name).plan(Costmap(costs, 0.5, 0.0, 0.0), Pose(1.1, 1.1), Pose(17.1, 16.1))
    moved = make_planner(name).plan(Costmap(costs, 0.5, -7.0, 3.0), Pose(-5.9, 4.1), Pose(10.1, 19.1))
    assert np.allclose(moved[:, :2] - (-7.0, 3.0), plain[:, :2], atol=1e-9)


@pytest.mark.parametrize("name", NAMES)
def test_a_start_at_the_goal_needs_no_way(name):
    planner, costmap = make_planner(name), metre_map(np.zeros((9, 9)))
    assert planner.plan(costmap, Pose(4.2, 4.2, 0.1), Pose(4.2, 4.2, 0.7)).tolist() == [[4.2, 4.2, 0.7]]


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize(("start", "goal", "which"), [((-1, 5), (5, 5), "start"), ((5, 5), (5, 21), "goal")])
def test_points_off_the_map_are_refused(name, start, goal, which):
    with pytest.raises(NoPathError, match=f"the {which} is off the map"):
        make_planner(name).plan(metre_map(np.zeros((21, 21))), Pose(*start), Pose(*goal))


@pytest.mark.parametrize(
    ("name", "params", "message"),
    [
        ("smac2d", {}, "unknown planner 'smac2d'; did you mean 'smac_2d'"),
        ("navfn", {"tolerence": 1}, "navfn: unknown key 'tolerence'; did you mean 'tolerance'"),
        ("smac_2d", {"smoother": {"w_smoth": 1}}, "did you mean 'w_smooth'"),
        ("theta_star", {"how_many_corners": 6}, "theta_star: how_many_corners: expected 4 or 8, got 6"),
    ],
)
def test_unknown_names_and_bad_values_are_refused(name, params, message):
    with pytest.raises(ConfigError, match=r"^[^\n]*$") as error:
        make_planner(name, **params)
    assert message in str(error.value)


class Nowhere:
    """A planner without options."""

    def plan(self, costmap, start, goal):
        raise NoPathError("nowhere to go")


class Ending(Settings):
    rows: int = 2


class Made:
    def __init__(self, options):
        self.rows = options.rows

    def plan(self, costmap, start, goal):
        return np.zeros((self.rows, 3))


class Eraser:
    def plan(self, costmap, start, goal):
        costmap.costs[:] = 0
        return np.zeros((1, 3))


class Lost:
    def plan(self, costmap, start, goal):
        raise LookupError("where?")


made, unlike = PlannerEntry(Ending, Made), PlannerEntry(dict, Made)
HERE = "tests.planners.test_planners"


def plan_with(name, costmap=None, **params):
    return make_planner(name, **params).plan(costmap or metre_map(np.zeros((3, 3))), Pose(0.5, 0.5), Pose(2.5, 2.5))


def test_planners_of_others():
    assert len(plan_with(f"{HERE}:made", rows=5)) == 5
    with pytest.raises(NoPathError):
        plan_with(f"{HERE}:Nowhere")
    with pytest.raises(ConfigError, match="unknown key 'row'; did you mean 'rows'"):
        make_planner(f"{HERE}:made", row=5)
    with pytest.raises(ConfigError, match="unknown key 'rows'"):
        make_planner(f"{HERE}:Nowhere", rows=5)
    with pytest.raises(ConfigError, match="expected one with 'plan', got a dict"):
        make_planner("builtins:dict")
    with pytest.raises(ConfigError, match=r"unlike': expected a subclass of .*Settings, got <class"):
        make_planner(f"{HERE}:unlike")


def test_planners_of_others_cannot_change_the_costmap():
    costmap = metre_map(np.full((3, 3), 7))
    assert plan_with(f"{HERE}:Eraser", costmap).shape == (1, 3)
    assert (costmap.costs == 7).all()


def test_a_planner_of_others_that_fails_is_one_line_with_its_name():
    with pytest.raises(PluginError, match=rf"^planner '{HERE}:Lost': LookupError: where\?, test_planners.py line \d+$"):
        plan_with(f"{HERE}:Lost")


class Returning:
    """Returns whatever it is told to."""

    answer: object = None

    def plan(self, costmap, start, goal):
        return self.answer


@pytest.mark.parametrize("path", [None, "path", [], np.zeros((2, 2)), np.full((2, 3), np.nan)])
def test_a_planner_of_others_that_returns_no_path_is_told_what_is_expected_by_name(path, monkeypatch):
    monkeypatch.setattr(Returning, "answer", path)
    with pytest.raises(PluginError, match=rf"^planner '{HERE}:Returning': expected a path of \(n, 3\) finite numbers"):
        plan_with(f"{HERE}:Returning")


def test_a_planner_of_others_keeps_no_hold_of_its_path(monkeypatch):
    monkeypatch.setattr(Returning, "answer", np.zeros((2, 3)))
    path = plan_with(f"{HERE}:Returning")
    Returning.answer[:] = 1.0
    assert not path.any()


def test_the_navigator_takes_them_by_name():
    plugin = PlannerPlugin(name=f"{HERE}:made", params={"rows": 4})
    assert PlannerPlugin(name=f"{HERE}:made").params == {"rows": 2}
    navigation = load_preset("thesis").replace(planner=plugin)
    assert NavigationParams(**navigation.model_dump(mode="json")) == navigation
    with pytest.raises(ConfigError, match=r"planner\.name: expected one that ROS has"):
        write_nav2_params(navigation)
    with pytest.raises(ConfigError, match="unknown planner 'navfm'; did you mean 'navfn'"):
        PlannerPlugin(name="navfm")
