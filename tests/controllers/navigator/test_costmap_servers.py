"""The navigator's costmaps: when they look at scans, what a scan is, and what clearing leaves."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import controllers.navigator.navigator as navigator_module
from controllers.nav2_params import load_preset
from controllers.navigator.costmap_servers import CostmapServer
from controllers.navigator.error_codes import PLANNER_RECOVERY_HELPS
from controllers.navigator.navigator import Navigator
from controllers.navigator.planner_server import PlannerServer
from gym_mapbench.costmap import FREE_SPACE, LETHAL_OBSTACLE, NO_INFORMATION, CostmapParams, LayeredCostmap
from gym_mapbench.errors import ConfigError, EndpointError, NoPathError, UnsafeEndpointError
from gym_mapbench.world.footprint import Footprint
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.lidar import Lidar, LidarSettings
from gym_mapbench.world.scenario import Pose
from gym_mapbench.world.world import World
from tests.controllers.plain_follower import PlainFollower, context

ROOM = GridMap(np.pad(np.zeros((98, 98), bool), 1, constant_values=True))
LIDAR = LidarSettings(beams=4)
POSE = Pose(1.025, 1.025)
NOTHING = np.full(4, 3.5, np.float32)
PARAMS = {"local": CostmapParams.example_local(), "global": CostmapParams.example_global()}


def ahead(distance):
    """Ranges of four beams of which the first one hits something."""
    return np.array([distance, 3.5, 3.5, 3.5], np.float32)


def server(which="global", grid=ROOM, lidar=LIDAR, **changes):
    return CostmapServer(PARAMS[which].replace(**changes), grid, Footprint.from_radius(0.22), lidar)


def observe(costmap_server, pose, ranges, now):
    if ranges is not None:
        costmap_server.observe(pose, ranges)
    costmap_server.advance(now, pose)


def cost_at(costmap_server, x, y=1.025):
    costmap = costmap_server.costmap
    return costmap.costs[costmap.world_to_map(x, y)]


def test_a_costmap_takes_the_newest_scan_when_it_is_updated():
    seen = server()
    for step, ranges in enumerate([ahead(1.0), *(ahead(0.6 + 0.02 * i) for i in range(19)), ahead(2.0), ahead(1.5)]):
        observe(seen, POSE, ranges, step * 0.05)
    assert [cost_at(seen, x) == LETHAL_OBSTACLE for x in (2.03, 3.03, 2.53)] == [False, True, False]


def test_a_scan_that_is_held_stays_where_it_was_taken():
    seen = server("local")
    observe(seen, POSE, ahead(1.0), 0.0)
    observe(seen, Pose(1.325, 1.025), None, 0.2)
    assert cost_at(seen, 2.03) == LETHAL_OBSTACLE
    assert cost_at(seen, 2.33) != LETHAL_OBSTACLE
    observe(seen, Pose(1.325, 1.025), ahead(1.01), 0.4)
    assert cost_at(seen, 2.34) == LETHAL_OBSTACLE


@pytest.mark.parametrize("which", PARAMS)
def test_clearing_forgets_all_but_the_newest_scan_and_the_map(which):
    seen = server(which)
    observe(seen, POSE, ahead(1.0), 0.0)
    observe(seen, POSE, ahead(0.8), 1.0)
    assert cost_at(seen, 1.83) == cost_at(seen, 2.03) == LETHAL_OBSTACLE
    seen.clear()
    observe(seen, POSE, ahead(0.8), 2.0)
    assert cost_at(seen, 1.83) == LETHAL_OBSTACLE
    assert cost_at(seen, 2.03) != LETHAL_OBSTACLE
    seen.clear()
    observe(seen, POSE, NOTHING, 3.0)
    assert cost_at(seen, 1.83) == FREE_SPACE
    if which == "global":
        assert cost_at(seen, 0.025) == LETHAL_OBSTACLE


def test_a_clear_of_named_layers_leaves_the_others_and_nobody_waits():
    # The obstacle layer forgets the first hit. The map stays away until an update writes there again.
    layers = ("static_layer", "obstacle_layer", "inflation_layer")
    seen = server(release="lyrical", plugins=layers)
    observe(seen, POSE, ahead(1.0), 0.0)
    observe(seen, POSE, ahead(0.8), 1.0)
    assert (cost_at(seen, 2.03), cost_at(seen, 4.975, 4.975)) == (LETHAL_OBSTACLE, LETHAL_OBSTACLE)
    seen.clear(("obstacle_layer",))
    assert seen.is_current(1.0)
    observe(seen, POSE, ahead(0.8), 2.0)
    assert (cost_at(seen, 1.83), cost_at(seen, 4.975, 4.975)) == (LETHAL_OBSTACLE, NO_INFORMATION)
    assert cost_at(seen, 2.03) != LETHAL_OBSTACLE
    seen.clear()
    assert not seen.is_current(2.0)
    observe(seen, POSE, ahead(0.8), 3.0)
    assert cost_at(seen, 4.975, 4.975) == LETHAL_OBSTACLE


def test_a_named_voxel_layer_keeps_its_voxels():
    def marked(*plugins):
        seen = server("local", release="lyrical", plugins=("voxel_layer", "inflation_layer"))
        observe(seen, POSE, ahead(1.0), 0.0)
        seen.clear(plugins)
        return seen._layered.layer("voxel_layer")

    assert (marked("voxel_layer").costs != LETHAL_OBSTACLE).all()
    assert (marked("voxel_layer").columns != marked().columns).any()


@pytest.mark.parametrize(
    ("release", "changes", "message"),
    [
        ("jazzy", {"local_clear_plugins": ["voxel_layer"]}, "bt.local_clear_plugins: clears of Nav2 Jazzy name no"),
        ("lyrical", {"global_clear_plugins": ["static_layer"]}, "expected obstacle_layer, got 'static_layer'"),
        ("lyrical", {"local_clear_plugins": ["obstacle_layer"]}, "expected voxel_layer, got 'obstacle_layer'"),
    ],
)
def test_a_clear_that_fails_in_nav2_is_refused(release, changes, message):
    preset = load_preset(release)
    with pytest.raises(ConfigError, match=message):
        preset.replace(bt=preset.bt.replace(**changes))


def test_the_trees_clears_name_their_layers():
    preset = load_preset("lyrical")
    preset = preset.replace(bt=preset.bt.replace(global_clear_plugins=["obstacle_layer"]))
    assert (preset.bt.plugins_to_clear("local"), preset.bt.plugins_to_clear("global")) == ((), ("obstacle_layer",))


def test_a_cleared_costmap_is_not_current_until_its_next_regular_update():
    seen = server()
    observe(seen, POSE, NOTHING, 0.0)
    assert seen.is_current(0.0)
    seen.clear()
    observe(seen, POSE, ahead(1.0), 0.5)
    assert (seen.is_current(0.5), seen.next_update, cost_at(seen, 2.03)) == (False, 1.0, FREE_SPACE)
    observe(seen, POSE, ahead(1.0), 1.0)
    assert cost_at(seen, 2.03) == LETHAL_OBSTACLE
    assert (seen.is_current(1.0), seen.is_current(0.9)) == (True, False)


@pytest.mark.parametrize(
    ("publish_frequency", "times"), [(2.0, [0.0, 0.6, 1.2, 1.8]), (5.0, [0.0, 0.4, 0.8, 1.2, 1.6])]
)
def test_a_costmap_is_published_after_more_than_its_period(publish_frequency, times):
    seen = server("local", publish_frequency=publish_frequency)
    published = []
    for step in range(40):
        observe(seen, POSE, ahead(1.0 + 0.01 * step), step * 0.05)
        if not published or seen.published() is not published[-1][1]:
            published.append((pytest.approx(step * 0.05), seen.published()))
    assert times == [time for time, _ in published]


def test_a_costmap_that_is_not_published_does_not_exist_for_others():
    seen = server("local", publish_frequency=0.0)
    observe(seen, POSE, ahead(1.0), 0.0)
    assert seen.published() is None


@given(st.integers(0, 10**6), st.sampled_from([0.0, -300.0]))
@settings(max_examples=20, deadline=None)
def test_exact_hits_mark_the_walls_own_cells(seed, origin):
    rng = np.random.default_rng(seed)
    occupied = np.kron(rng.random((20, 20)) < 0.1, np.ones((5, 5))).astype(bool)
    occupied[[0, -1]] = occupied[:, [0, -1]] = True
    occupied[40:60, 40:60] = False
    grid, lidar = GridMap(occupied, origin=(origin, origin)), LidarSettings()
    seen = server(
        grid=grid, lidar=lidar, plugins=("obstacle_layer",), width=5, height=5, origin_x=origin, origin_y=origin
    )
    pose = Pose(*(origin + rng.uniform(2.2, 2.8, 2)), rng.uniform(-3, 3))
    observe(seen, pose, Lidar(lidar, World(grid)).scan(pose), 0.0)
    marked = seen.costmap.costs == LETHAL_OBSTACLE
    assert marked.sum() > 20
    # Hits within a hair of a corner may lie in the next cell.
    assert grid.occupancy[marked].mean() > 0.95


def test_without_obstacle_layers_nothing_is_computed_again():
    seen = server(plugins=("static_layer", "inflation_layer"))
    observe(seen, POSE, None, 0.0)
    first = seen.costmap
    observe(seen, POSE, None, 1.0)
    assert seen.costmap is first
    seen.clear()
    observe(seen, POSE, None, 2.0)
    assert (seen.costmap.costs == first.costs).all()


class DistrustfulPlanner:
    """Finds a way unless something stands 1 m ahead; writes down whether it did."""

    def __init__(self):
        self.blocked = []

    def plan(self, costmap, start, goal):
        self.blocked.append(bool(costmap.costs[costmap.world_to_map(2.03, 1.025)] == LETHAL_OBSTACLE))
        if self.blocked[-1]:
            raise NoPathError("something stands there")
        return np.array([start, goal])


def test_the_planner_sees_what_the_lidar_saw_until_the_costmap_is_cleared(monkeypatch):
    planner = DistrustfulPlanner()
    monkeypatch.setattr(navigator_module, "make_planner", lambda name, **params: planner)
    preset = load_preset("thesis")
    often = preset.replace(global_costmap=preset.global_costmap.replace(update_frequency=2.0))
    navigator = Navigator(PlainFollower(), often, "plain")
    navigator.reset(dataclasses.replace(context(ROOM, POSE, Pose(4.0, 1.025)), lidar=LIDAR))
    observation = {"pose": np.array(POSE), "odom": np.array(POSE), "velocity": np.zeros(2)}
    # Something is seen at 0.5 s; then all beams come back with nothing, which clears nothing.
    for step in range(32):
        navigator.act({**observation, "scan": ahead(1.0) if step == 10 else NOTHING})
    assert planner.blocked == [False, True, False]
    kinds = [(event.time, event.kind) for event in navigator.events]
    assert kinds == [(0.0, "replan"), (1.0, "replan_failure"), (1.0, "clear_global"), (1.5, "replan")]


@pytest.mark.parametrize(
    ("error", "code", "helps"),
    [(EndpointError, 204, False), (UnsafeEndpointError, 201, True), (NoPathError, 209, True)],
)
def test_the_error_of_a_planner_decides_whether_recoveries_are_tried(error, code, helps):
    class Refusing:
        def plan(self, costmap, start, goal):
            raise error("no path")

    seen = server()
    observe(seen, POSE, None, 0.0)
    planner = PlannerServer(Refusing(), SimpleNamespace(pose=POSE), seen)
    planner.begin(Pose(4.0, 1.025), 0.0)
    assert planner.step(0.0) is None
    assert planner.step(0.0).code == code
    assert (code in PLANNER_RECOVERY_HELPS) == helps


def plain_clear(costs, window, x, y, side, outside):
    """Nav2's loop over all cells of a layer; cells on the lower border of the square are outside of it."""
    plain = costs.copy()
    rows, cols = costs.shape

    def cell(value, origin, count):
        if value < origin:
            return 0
        return min(int((value - origin) / window.resolution), count - 1)

    start_x, end_x = (cell(x + sign * side / 2, window.origin_x, cols) for sign in (-1, 1))
    start_y, end_y = (cell(y + sign * side / 2, window.origin_y, rows) for sign in (-1, 1))
    for row in range(rows):
        for col in range(cols):
            inside = start_x < col < end_x and start_y < row < end_y
            if inside != outside:
                plain[row, col] = NO_INFORMATION
    return plain


@settings(max_examples=30, deadline=None)
@given(st.floats(-1.0, 6.0), st.floats(-1.0, 6.0), st.floats(-0.5, 8.0), st.booleans())
def test_a_square_is_cleared_as_nav2_loops_over_the_cells(x, y, side, outside):
    layered = LayeredCostmap(PARAMS["global"], ROOM, Footprint.from_radius(0.22))
    layer = layered.layer("obstacle_layer")
    layer.costs = np.random.default_rng(1).choice([0, 254, 255], size=layer.costs.shape).astype(np.uint8)
    expected = plain_clear(layer.costs, layered._window, x, y, side, outside)
    assert layered.clear_square(x, y, side, outside=outside)
    np.testing.assert_array_equal(layer.costs, expected)


@pytest.mark.parametrize("which", ["local", "global"])
@pytest.mark.parametrize(("outside", "left"), [(False, [False, True]), (True, [True, False])])
def test_a_clear_of_a_square_forgets_marks_in_it_or_around_it_and_leaves_walls(which, outside, left):
    seen = server(which)
    places = (1.03, 1.53), (2.23, 1.03)
    observe(seen, POSE, np.array([1.2, 0.5, 3.5, 3.5], np.float32), 0.0)
    assert [cost_at(seen, *place) == LETHAL_OBSTACLE for place in places] == [True, True]
    seen.clear_square(POSE, 1.5, outside=outside)
    assert not seen.is_current(0.01)
    observe(seen, POSE, np.full(4, 0.1, np.float32), 1.0)
    assert seen.is_current(1.0)
    assert [cost_at(seen, *place) == LETHAL_OBSTACLE for place in places] == left
    assert which == "local" or cost_at(seen, 0.02) == LETHAL_OBSTACLE


def test_without_a_layer_that_looks_at_scans_nobody_waits_after_a_clear_of_a_square():
    seen = server("global", plugins=("static_layer", "inflation_layer"))
    seen.advance(0.0, POSE)
    before = seen.costmap.costs.copy()
    seen.clear_square(POSE, 1.0, outside=True)
    assert seen.is_current(0.01)
    seen.advance(1.0, POSE)
    np.testing.assert_array_equal(seen.costmap.costs, before)
