"""Costmaps that are updated on the way: rolling window, obstacle layers, their combination."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import binary_dilation

from gym_mapbench.costmap import (
    LETHAL_OBSTACLE,
    NO_INFORMATION,
    CostmapParams,
    InflationLayer,
    LaserScan,
    LayeredCostmap,
    ObservationSource,
    ObstacleLayer,
    StaticLayer,
    VoxelLayer,
    build_static_costmap,
)
from gym_mapbench.costmap.layer import Window
from gym_mapbench.errors import ConfigError
from gym_mapbench.world.footprint import Footprint
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.lidar import Lidar, LidarSettings
from gym_mapbench.world.scenario import Pose
from gym_mapbench.world.world import World

DISC = Footprint.from_radius(0.22)
POINT = Footprint.from_radius(0.001, 0.0)
ROOM = GridMap(np.pad(np.zeros((98, 98), bool), 1, constant_values=True))
SENSOR = LidarSettings()


def see(window, pose, ranges):
    """Update with a scan of beams that are spread evenly over a full turn, or of one beam straight ahead."""
    window.observe(LaserScan(np.atleast_1d(ranges), 0.0, 2 * math.pi / np.size(ranges), 0.0, 3.5), pose)
    return window.update(pose)


def layer_options(name, **scan):
    """Options of a layer of that name whose lidar clears."""
    kind = VoxelLayer if name == "voxel_layer" else ObstacleLayer
    return kind(scan=ObservationSource(**{"clearing": True, **scan}))


def only(layer, **changes):
    """Options of a rolling 3 m window with one obstacle layer and nothing else."""
    return CostmapParams.example_local(plugins=(layer,), **changes)


@pytest.mark.parametrize(("release", "origin"), [("humble", -1.45), ("jazzy", -1.45), ("lyrical", -1.5)])
def test_the_window_is_centred_by_its_size_in_the_release(release, origin):
    costmap = LayeredCostmap(only("voxel_layer", release=release), ROOM, POINT).update(Pose(0.0, 0.0))
    assert (costmap.origin_x, costmap.origin_y) == pytest.approx((origin, origin))


@pytest.mark.parametrize(("release", "end"), [("humble", 2.975), ("jazzy", 2.975), ("lyrical", 3.0)])
def test_voxel_rays_are_cut_at_the_size_of_the_window_in_the_release(release, end):
    options = only("voxel_layer", release=release, voxel_layer=layer_options("voxel_layer", raytrace_max_range=9.0))
    layer, pose = LayeredCostmap(options, ROOM, POINT).layer("voxel_layer"), Pose(1.5, 1.5)
    for heading, side in ((0.0, 2), (math.pi / 2, 3)):
        layer.observe(LaserScan(np.array([3.0]), heading, 1.0, 0.0, 3.5), pose, 0.0)
        box = np.array([math.inf, math.inf, -math.inf, -math.inf])
        layer.update_bounds(Window((60, 60), 0.05, 0.0, 0.0, release=release), pose, box)
        assert box[side] == pytest.approx(end, abs=1e-4)


def test_window_of_the_worked_example_rolls_by_whole_cells():
    window = LayeredCostmap(CostmapParams.example_local(), ROOM, DISC)
    origins = [window.update(Pose(x, 0.0)).origin_x for x in (0.0, 0.03, 0.10)]
    assert origins == pytest.approx([-1.45, -1.45, -1.40])
    assert window.update(Pose(0.0, 0.0)).costs.shape == (60, 60)


def test_rolling_static_layer_shows_the_map_and_nothing_beyond():
    params = CostmapParams.example_local(plugins=("static_layer",))
    window = LayeredCostmap(params, ROOM, DISC).update(Pose(0.7, 2.5))
    col = round(-window.origin_x / 0.05)
    assert not window.costs[:, :col].any()
    assert (window.costs[:, col] == LETHAL_OBSTACLE).all()
    assert not window.costs[:, col + 1 :].any()


def test_a_rolling_static_layer_follows_its_frame():
    params, moved = CostmapParams.example_local(plugins=("static_layer",)), Pose(0.5, 0.0, 0.3)
    window, fresh = (LayeredCostmap(params, ROOM, DISC) for _ in range(2))
    before = window.update(Pose(1.0, 1.0)).costs.copy()
    after = window.update(Pose(1.0, 1.0), moved).costs
    assert np.array_equal(after, fresh.update(Pose(1.0, 1.0), moved).costs)
    assert not np.array_equal(after, before)


def test_rolling_window_far_from_the_map_is_free():
    params = CostmapParams.example_local(plugins=("static_layer", "inflation_layer"))
    assert not LayeredCostmap(params, ROOM, DISC).update(Pose(50.0, 50.0)).costs.any()


@given(st.floats(0, 5), st.floats(0, 5))
@settings(max_examples=25)
def test_rolling_inflated_map_equals_the_whole_one_away_from_the_windows_border(x, y):
    rng = np.random.default_rng(int(x * 1000))
    grid = GridMap(rng.random((100, 100)) < 0.02)
    params = CostmapParams.example_local(plugins=("static_layer", "inflation_layer"))
    window = LayeredCostmap(params, grid, DISC).update(Pose(x, y))
    whole = np.zeros((300, 300), np.uint8)
    whole[100:200, 100:200] = build_static_costmap(grid, params, DISC).costs
    row, col = round(window.origin_y / 0.05) + 100, round(window.origin_x / 0.05) + 100
    inner = slice(12, -12)
    on_map = np.zeros((300, 300), bool)
    on_map[100:200, 100:200] = True
    same = window.costs == whole[row : row + 60, col : col + 60]
    assert (same | ~on_map[row : row + 60, col : col + 60])[inner, inner].mean() > 0.99


def test_map_and_window_may_differ_in_resolution():
    grid = GridMap.from_rows(["##", ".."], resolution=0.5)
    params = CostmapParams.example_local(width=1, height=1, plugins=("static_layer",))
    window = LayeredCostmap(params, grid, DISC)
    costmap = window.update(Pose(0.51, 0.51))
    assert (costmap.origin_x, costmap.origin_y) == (0.0, 0.0)
    assert (costmap.costs[:10] == 0).all()
    assert (costmap.costs[10:] == LETHAL_OBSTACLE).all()


@pytest.mark.parametrize("layer", ["obstacle_layer", "voxel_layer"])
@given(st.integers(0, 10**6))
@settings(max_examples=25)
def test_a_scan_marks_walls_and_nothing_else(layer, seed):
    rng = np.random.default_rng(seed)
    occupied = rng.random((60, 60)) < 0.1
    occupied[[0, -1]] = occupied[:, [0, -1]] = True
    occupied[25:35, 25:35] = False
    grid, pose = GridMap(occupied), Pose(*rng.uniform(1.3, 1.7, 2), rng.uniform(-3, 3))
    # A hair farther than the walls' faces, where rounding would decide the cell.
    hits = Lidar(SENSOR, World(grid)).scan(pose) + np.float32(1e-4)
    window = see(LayeredCostmap(only(layer), grid, POINT), pose, hits)
    marked = np.argwhere(window.costs == LETHAL_OBSTACLE)
    x, y = window.origin_x + (marked[:, 1] + 0.5) * 0.05, window.origin_y + (marked[:, 0] + 0.5) * 0.05
    assert len(marked) > 10
    cells = (y / 0.05).astype(int), (x / 0.05).astype(int)
    # A beam that ends within a hair of a wall's corner may mark the cell next to it.
    assert np.count_nonzero(~grid.occupancy[cells]) <= 1 + 0.03 * len(marked)
    assert binary_dilation(grid.occupancy, np.ones((3, 3)))[cells].all()
    assert np.hypot(x - pose.x, y - pose.y).max() <= min(2.5, hits.max()) + 0.08


def lethal_columns(costmap, y=1.025):
    row, _ = costmap.world_to_map(costmap.origin_x, y)
    columns = np.flatnonzero(costmap.costs[row] == LETHAL_OBSTACLE)
    return [round(costmap.origin_x + (col + 0.5) * 0.05, 3) for col in columns]


def test_marks_stay_until_seen_through_left_behind_or_cleared():
    window = LayeredCostmap(only("voxel_layer", voxel_layer=layer_options("voxel_layer")), ROOM, POINT)
    pose = Pose(1.025, 1.025)
    assert lethal_columns(see(window, pose, 1.0)) == [2.025]
    assert lethal_columns(window.update(pose)) == [2.025]
    assert lethal_columns(window.update(Pose(1.725, 1.025))) == [2.025]
    assert lethal_columns(see(window, pose, 0.5)) == [1.525, 2.025]
    assert lethal_columns(see(window, pose, 1.3)) == [2.325]
    assert lethal_columns(see(window, pose, math.inf)) == [2.325]
    window.update(Pose(4.5, 1.025))
    assert lethal_columns(window.update(pose)) == []


def test_the_newest_scan_counts_until_there_is_a_newer_one():
    window = LayeredCostmap(only("voxel_layer", voxel_layer=layer_options("voxel_layer")), ROOM, POINT)
    pose = Pose(1.025, 1.025)
    see(window, pose, 1.0)
    window.update(Pose(4.5, 1.025))
    assert lethal_columns(window.update(pose)) == [2.025]
    window.clear()
    assert lethal_columns(window.update(pose)) == [2.025]
    see(window, pose, math.inf)
    window.clear()
    assert lethal_columns(window.update(pose)) == []
    see(window, pose, 1.0)
    window.reset(pose)
    assert lethal_columns(window.update(pose)) == []


def test_voxel_rays_end_two_cells_short_and_obstacle_rays_do_not():
    pose = Pose(1.025, 1.025)
    for name, expected in (("voxel_layer", [1.975, 2.025]), ("obstacle_layer", [2.025])):
        window = LayeredCostmap(only(name, **{name: layer_options(name)}), ROOM, POINT)
        see(window, pose, 0.951)
        assert lethal_columns(see(window, pose, 1.0)) == expected


def test_ranges_limit_what_is_marked_and_cleared():
    pose = Pose(1.025, 1.025)
    for name, too_far in (("voxel_layer", 0.501), ("obstacle_layer", 0.56)):
        near = layer_options(name, obstacle_max_range=0.5, obstacle_min_range=0.2)
        window = LayeredCostmap(only(name, **{name: near}), ROOM, POINT)
        assert lethal_columns(see(window, pose, too_far)) == []
        assert lethal_columns(see(window, pose, 0.1)) == []
        assert len(lethal_columns(see(window, pose, 0.45))) == 1
    short = layer_options("obstacle_layer", raytrace_max_range=0.5)
    window = LayeredCostmap(only("obstacle_layer", obstacle_layer=short), ROOM, POINT)
    see(window, pose, 0.9)
    assert lethal_columns(see(window, pose, 1.2)) == [1.925, 2.225]


def test_beams_that_hit_nothing_clear_only_if_told():
    pose = Pose(1.025, 1.025)
    for inf_is_valid, expected in ((False, [1.925]), (True, [])):
        layer = layer_options("voxel_layer", inf_is_valid=inf_is_valid)
        window = LayeredCostmap(only("voxel_layer", voxel_layer=layer), ROOM, POINT)
        see(window, pose, 0.9)
        assert lethal_columns(see(window, pose, math.inf)) == expected
        assert lethal_columns(see(window, pose, 3.5)) == expected


def test_the_robots_own_cells_are_freed():
    box = Footprint.from_corners([(0.2, 0.1), (-0.2, 0.1), (-0.2, -0.1), (0.2, -0.1)], 0.0)
    pose = Pose(1.025, 1.025)
    window = LayeredCostmap(only("voxel_layer"), ROOM, box)
    see(window, pose, 0.3)
    costs = window.update(Pose(1.325, 1.025, math.pi / 2)).costs
    assert not (costs == LETHAL_OBSTACLE).any()
    keep = VoxelLayer(footprint_clearing_enabled=False)
    window = LayeredCostmap(only("voxel_layer", voxel_layer=keep), ROOM, box)
    see(window, pose, 0.3)
    assert lethal_columns(window.update(Pose(1.325, 1.025))) == [1.325]


def test_footprint_clearing_fills_the_polygon():
    unseen = only("voxel_layer", track_unknown_space=True)
    box = Footprint.from_corners([(0.2, 0.1), (-0.2, 0.1), (-0.2, -0.1), (0.2, -0.1)], 0.0)
    costmap = LayeredCostmap(unseen, ROOM, box).update(Pose(1.525, 1.525))
    freed = np.argwhere(costmap.costs != NO_INFORMATION)
    assert len(freed) == 9 * 5
    assert freed.max(axis=0).tolist() == (freed.min(axis=0) + np.array([4, 8])).tolist()


def test_layers_combine_as_told():
    grid = GridMap(ROOM.occupancy | (np.arange(100) == 50))
    pose = Pose(1.0, 1.0)
    for method, keeps in ((1, True), (0, False)):
        layer = ObstacleLayer(combination_method=method, scan=ObservationSource(clearing=True))
        plugins = ("static_layer", "obstacle_layer")
        params = CostmapParams.example_global(plugins=plugins, obstacle_layer=layer)
        costmap = LayeredCostmap(params, grid, POINT)
        # A beam that passes the wall on the map: someone took it away.
        costs = see(costmap, Pose(1.025, 1.025), 2.0).costs
        assert (costs[20, 50] == LETHAL_OBSTACLE) == keeps
        assert costs[20, 60] == LETHAL_OBSTACLE
        assert costs[70, 50] == LETHAL_OBSTACLE
    largest = CostmapParams(plugins=("obstacle_layer", "static_layer"), use_maximum=True)
    costs = see(LayeredCostmap(largest, grid, POINT), pose, 1.0).costs
    assert costs[20, 40] == LETHAL_OBSTACLE


def test_without_obstacle_layers_the_whole_map_is_built_once():
    params = CostmapParams.example_global(plugins=("static_layer", "inflation_layer"))
    costmap = LayeredCostmap(params, ROOM, DISC)
    first = costmap.update(Pose(1, 1))
    assert np.array_equal(first.costs, build_static_costmap(ROOM, params, DISC).costs)
    assert costmap.update(Pose(2, 2)) is first


@pytest.mark.parametrize(("release", "cost"), [("humble", NO_INFORMATION), ("jazzy", LETHAL_OBSTACLE)])
def test_a_clear_forgets_a_costmap_that_never_changes_as_well(release, cost):
    # Humble does not inflate again what no layer reports.
    unknown = {"track_unknown_space": True, "inflation_layer": InflationLayer(inflate_around_unknown=True)}
    params = CostmapParams(width=1, height=1, plugins=("inflation_layer",), release=release, **unknown)
    costmap = LayeredCostmap(params, ROOM, DISC)
    assert (costmap.update(Pose(0, 0)).costs == LETHAL_OBSTACLE).all()
    costmap.clear()
    assert (costmap.update(Pose(0, 0)).costs == cost).all()


def test_a_costmap_neither_rolling_nor_on_the_map_stays_where_it_is_put():
    params = CostmapParams(width=2, height=1, origin_x=-1.0, plugins=("inflation_layer",))
    costmap = LayeredCostmap(params, ROOM, DISC).update(Pose(3, 3))
    assert costmap.costs.shape == (10, 20)
    assert (costmap.origin_x, costmap.origin_y) == (-1.0, 0.0)


@pytest.mark.parametrize("changes", [{}, {"rolling_window": True, "width": 3, "height": 3}])
def test_a_disabled_static_layer_writes_nothing_but_gives_a_costmap_the_size_of_the_map(changes):
    params = CostmapParams.example_global(static_layer=StaticLayer(enabled=False), **changes)
    costmap = LayeredCostmap(params, ROOM, DISC).update(Pose(3, 3))
    assert costmap.costs.shape == ((60, 60) if changes else ROOM.shape)
    assert np.isin(costmap.costs, (0, 255)).all()  # the robot's own cells are freed


def test_every_update_returns_new_costs():
    window = LayeredCostmap(CostmapParams.example_local(), ROOM, DISC)
    first, second = window.update(Pose(1, 1)), window.update(Pose(1, 1))
    assert first.costs is not second.costs


@pytest.mark.parametrize("options", [{"resolution": 4.0}, {"width": 10**9, "height": 10**9}])
def test_absurd_sizes_are_refused(options):
    with pytest.raises(ConfigError, match=r"costmap: expected width x height of 1 to|expected at most 25000000 cells"):
        LayeredCostmap(CostmapParams.example_local(**options), ROOM, DISC)


def test_inflation_sees_what_the_lidar_saw():
    layer = InflationLayer(cost_scaling_factor=3.0)
    window = LayeredCostmap(CostmapParams.example_local(inflation_layer=layer), ROOM, DISC)
    costmap = see(window, Pose(1.025, 1.025), 1.0)
    row, col = costmap.world_to_map(2.025, 1.025)
    assert costmap.costs[row, col - 5 : col + 6].tolist() == [234, 253, 253, 253, 253, 254, 253, 253, 253, 253, 234]
