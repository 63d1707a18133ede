"""Cost values of the map and around obstacles, against Nav2's worked examples and slow twins of the kernels."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy.ndimage import distance_transform_edt

from gym_mapbench.costmap import (
    FREE_SPACE,
    INSCRIBED_INFLATED_OBSTACLE,
    LETHAL_OBSTACLE,
    NO_INFORMATION,
    CostmapParams,
    InflationLayer,
    ObservationSource,
    build_static_costmap,
    inflation_costs,
)
from gym_mapbench.costmap.inflation_layer import Inflation
from gym_mapbench.costmap.layer import LayerContext, Window
from gym_mapbench.errors import ConfigError
from gym_mapbench.kernels.inflation import brushfire
from gym_mapbench.world.footprint import Footprint
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.robot import make_robot

DISC = Footprint.from_radius(0.22)
GRIDS = hnp.arrays(bool, hnp.array_shapes(min_dims=2, max_dims=2, min_side=1, max_side=14))


def plain_brushfire(sources, reach):
    """Nav2's lists, one after the other, with every offer kept."""
    lists = {q: [] for q in range(reach * reach + 1)}
    lists[0] = [(cell, cell) for cell in zip(*np.nonzero(sources), strict=True)]
    beyond = reach * reach + 1
    squared = np.full(sources.shape, beyond)
    for q, waiting in lists.items():
        for (row, col), (from_row, from_col) in waiting:
            if squared[row, col] != beyond:
                continue
            squared[row, col] = (row - from_row) ** 2 + (col - from_col) ** 2
            for near in ((row, col - 1), (row - 1, col), (row, col + 1), (row + 1, col)):
                d = (near[0] - from_row) ** 2 + (near[1] - from_col) ** 2
                inside = 0 <= near[0] < sources.shape[0] and 0 <= near[1] < sources.shape[1]
                if inside and q <= d <= reach * reach and squared[near] == beyond:
                    lists[d].append((near, (from_row, from_col)))
    return squared


def test_footprint_radii_of_the_worked_example():
    assert DISC.inscribed_radius == pytest.approx(0.225498, abs=1e-6)
    assert DISC.circumscribed_radius == pytest.approx(0.234142, abs=1e-6)
    box = Footprint.from_corners([(-0.15, -0.25), (0.35, -0.25), (0.35, 0.25), (-0.15, 0.25)])
    assert box.inscribed_radius == pytest.approx(0.16, abs=1e-6)
    assert box.circumscribed_radius == pytest.approx(0.444072, abs=1e-6)


def test_a_corner_that_stands_twice_changes_no_radius():
    corners = [(-0.15, -0.25), (0.35, -0.25), (0.35, 0.25), (-0.15, 0.25)]
    once, closed = Footprint.from_corners(corners), Footprint.from_corners([*corners, corners[0]])
    assert closed.inscribed_radius == once.inscribed_radius
    assert closed.circumscribed_radius == once.circumscribed_radius


def test_costs_along_an_axis():
    costs = inflation_costs(InflationLayer(cost_scaling_factor=3.0), 11, 0.05, DISC.inscribed_radius)
    assert costs[np.arange(12) ** 2].tolist() == [254, 253, 253, 253, 253, 234, 201, 173, 149, 128, 110, 95]
    assert costs[[18, 32, 50, 113]].tolist() == [253, 212, 171, 100]
    steep = inflation_costs(InflationLayer(), 11, 0.05, DISC.inscribed_radius)
    assert steep[np.arange(5, 12) ** 2].tolist() == [197, 119, 72, 44, 26, 16, 9]


def test_reach_of_the_inflation():
    grid = GridMap(np.eye(20, dtype=bool)[:1].repeat(20, axis=0) & (np.arange(20) == 0)[:, None])
    costs = build_static_costmap(grid, CostmapParams.example_global(), DISC).costs
    assert costs[8, 7] == costs[7, 8] == 100
    assert costs[8, 8] == FREE_SPACE
    assert costs[0, 11] == 95
    assert costs[0, 12] == FREE_SPACE


def test_lyricals_legacy_layer_is_jazzys_and_its_new_layer_is_exact():
    """The brushfire gives some cells another obstacle than the nearest, and costs at the distance itself."""
    occupied = np.random.default_rng(3).random((60, 60)) < 0.01
    costs = {}
    for release, options in (("jazzy", {}), ("lyrical", {"brushfire": True}), ("lyrical", {})):
        layer = InflationLayer(inflation_radius=1.0, cost_scaling_factor=3.0, **options)
        params = CostmapParams(inflation_layer=layer, release=release)
        costs[release, bool(options)] = build_static_costmap(GridMap(occupied), params, DISC).costs
    assert np.array_equal(costs["jazzy", False], costs["lyrical", True])
    differences = (costs["lyrical", True] != costs["lyrical", False]).sum()
    assert 0 < differences < 0.1 * occupied.size


def test_unknown_cells_take_inscribed_costs_only():
    unknown = np.zeros((1, 12), bool)
    unknown[0, 4:6] = True
    grid = GridMap(np.arange(12)[None] == 0, unknown=unknown)
    tracked = build_static_costmap(grid, CostmapParams.example_global(), DISC).costs[0]
    assert tracked[[4, 5]].tolist() == [INSCRIBED_INFLATED_OBSTACLE, NO_INFORMATION]
    layer = InflationLayer(cost_scaling_factor=3.0, inflate_unknown=True)
    eager = build_static_costmap(grid, CostmapParams.example_global(inflation_layer=layer), DISC).costs[0]
    assert eager[5] == 234
    free = build_static_costmap(grid, CostmapParams.example_global(track_unknown_space=False), DISC).costs[0]
    assert free[5] == 234


def test_unknown_cells_can_be_inflated_like_obstacles():
    grid = GridMap(np.zeros((1, 9), bool), unknown=np.arange(9)[None] == 0)
    layer = InflationLayer(cost_scaling_factor=3.0, inflate_around_unknown=True)
    costs = build_static_costmap(grid, CostmapParams.example_global(inflation_layer=layer), DISC).costs[0]
    assert costs[[0, 1, 5]].tolist() == [LETHAL_OBSTACLE, INSCRIBED_INFLATED_OBSTACLE, 234]


def test_static_values_follow_the_thresholds():
    grid = GridMap.from_rows(["#.?"])
    plain = {"plugins": ("static_layer",), "track_unknown_space": True}
    for changes, expected in (
        ({}, [254, 0, 255]),
        ({"track_unknown_space": False}, [254, 0, 0]),
        ({"unknown_cost_value": 100}, [255, 0, 254]),
        ({"unknown_cost_value": 7, "trinary_costmap": False}, [254, 0, 254]),
    ):
        params = CostmapParams(**{**plain, **changes})
        assert build_static_costmap(grid, params, DISC).costs[0].tolist() == expected


def test_layers_that_are_off_do_not_write():
    grid = GridMap.from_rows(["#.."])
    bare = build_static_costmap(grid, CostmapParams(plugins=()), DISC)
    assert bare.costs.tolist() == [[0, 0, 0]]
    off = CostmapParams(inflation_layer=InflationLayer(enabled=False))
    assert build_static_costmap(grid, off, DISC).costs.tolist() == [[254, 0, 0]]


@given(GRIDS, st.integers(0, 9))
@settings(max_examples=60, deadline=None)
def test_brushfire_equals_its_plain_twin(sources, reach):
    assert np.array_equal(brushfire(sources, reach), plain_brushfire(sources, reach))


@given(hnp.arrays(bool, (20, 20), fill=st.just(False)), st.integers(0, 12))
@settings(max_examples=40, deadline=None)
def test_inflation_invariants(occupancy, reach):
    grid = GridMap(occupancy)
    layer = InflationLayer(inflation_radius=max(reach - 0.5, 0.0) * 0.05, cost_scaling_factor=3.0)
    costs = build_static_costmap(grid, CostmapParams.example_global(inflation_layer=layer), DISC).costs
    assert np.array_equal(costs == LETHAL_OBSTACLE, occupancy)
    distance = distance_transform_edt(~occupancy) if occupancy.any() else np.full((20, 20), np.inf)
    assert not costs[distance > reach].any()
    # The brushfire may miss the nearest obstacle by a fraction of a cell, never report one nearer than it is.
    exact = inflation_costs(layer, 40, 0.05, DISC.inscribed_radius)
    near = distance <= reach
    assert (costs[near] <= exact[np.rint(distance[near] ** 2).astype(int)]).all()


def test_footprint_of_params_or_robot():
    jackal, waffle = make_robot("jackal"), make_robot("turtlebot3_waffle")
    assert CostmapParams().make_footprint(jackal).corners[0] == pytest.approx((0.22, 0.175))
    assert len(CostmapParams().make_footprint(waffle).corners) == 16
    assert CostmapParams(robot_radius=0.3).make_footprint(jackal).corners[0, 0] == pytest.approx(0.31)
    text = "[[0.1, 0.1], [-0.1, 0.1], [-0.1, -0.1], [0.1, -0.1]]"
    box = CostmapParams(robot_radius=0.3, footprint=text, footprint_padding=0.0).make_footprint(waffle)
    assert box.inscribed_radius == pytest.approx(0.1)
    assert CostmapParams(footprint="[]").footprint is None


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"plugins": ("static_layer", "inflation")}, "unknown costmap layer 'inflation'; did you mean"),
        ({"footprint": "[[0, 0], [1"}, "footprint: expected corners"),
        ({"footprint": [(0, 0), (1, 0)]}, "footprint: expected at least 3 different corners, got 2"),
        ({"inflation_layer": {"inflation_radios": 1}}, "did you mean 'inflation_radius'"),
        ({"voxel_layer": {"combination_method": 7}}, "combination_method: expected 0, 1 or 2, got 7"),
        ({"voxel_layer": {"z_voxels": 17}}, "z_voxels: expected less than or equal to 16, got 17"),
        ({"obstacle_layer": {"scan": {"marking": 1}}}, "marking: expected true or false, got 1"),
        ({"obstacle_layer": {"combination_method": 2}}, "expected 0 or 1 (2 is new in Jazzy), got 2"),
        ({"release": "foxy"}, "release: expected 'humble', 'jazzy' or 'lyrical', got 'foxy'"),
        ({"width": 0}, "width"),
    ],
)
def test_bad_options_are_one_clear_line(options, message):
    with pytest.raises(ConfigError, match=r"^[^\n]*$") as error:
        CostmapParams(**options)
    assert message in str(error.value)


def test_absurd_inflation_is_refused():
    params = CostmapParams(inflation_layer=InflationLayer(inflation_radius=1e6))
    with pytest.raises(ConfigError, match="inflation_radius: expected at most 2000 cells"):
        build_static_costmap(GridMap.from_rows(["#."]), params, DISC)


def test_examples_hold_nav2s_values():
    local, whole = CostmapParams.example_local(), CostmapParams.example_global()
    assert local.rolling_window
    assert (local.width, local.resolution, local.update_frequency) == (3, 0.05, 5.0)
    seen = ObservationSource(clearing=True, max_obstacle_height=2.0)
    assert local.voxel_layer.scan == whole.obstacle_layer.scan == seen
    assert (local.voxel_layer.z_voxels, local.voxel_layer.z_resolution) == (16, 0.05)
    assert whole.track_unknown_space
    assert whole.inflation_layer == local.inflation_layer == InflationLayer(cost_scaling_factor=3.0)
    assert CostmapParams.example_local(width=5).width == 5


BOX = st.tuples(st.integers(0, 5), st.integers(0, 5), st.integers(6, 12), st.integers(6, 12))


@settings(max_examples=60, deadline=None)
@given(hnp.arrays(np.uint8, (3, 12, 12), elements=st.sampled_from([0, 0, 0, 40, 254, 255])), st.data())
def test_kept_inflation_is_that_of_a_new_layer(costs, data):
    options = InflationLayer(inflation_radius=0.15)
    grid = GridMap(np.zeros((12, 12), bool), 0.05)
    context = LayerContext(CostmapParams(), grid, grid.shape, grid.resolution, Footprint.from_radius(0.06))
    window, layer = Window(grid.shape, grid.resolution, *grid.origin), Inflation(options, context)
    for which, cells in data.draw(st.lists(st.tuples(st.integers(0, 2), BOX), max_size=10)):
        for _ in range(2):
            kept, expected = costs[which].copy(), costs[which].copy()
            layer.update_costs(window, kept, cells)
            Inflation(options, context).update_costs(window, expected, cells)
            np.testing.assert_array_equal(kept, expected)
