"""What scans do to the obstacle and the voxel layer: Nav2's worked examples, heights, thresholds, both releases."""

from __future__ import annotations

import math

import numpy as np
import pytest

from gym_mapbench.costmap import (
    FREE_SPACE,
    LETHAL_OBSTACLE,
    NO_INFORMATION,
    CostmapParams,
    LaserScan,
    LayeredCostmap,
    ObservationSource,
    ObstacleLayer,
    VoxelLayer,
)
from gym_mapbench.world.footprint import Footprint
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.scenario import Pose

DISC = Footprint.from_radius(0.22)
POINT = Footprint.from_radius(0.001, 0.0)
ROOM = GridMap(np.zeros((150, 150), bool))
BEAM = ObservationSource(clearing=True, max_obstacle_height=2.0)
KINDS = {"obstacle_layer": ObstacleLayer, "voxel_layer": VoxelLayer}


def window(name, footprint=POINT, release="humble", source=BEAM, track_unknown_space=False, **options):
    """A rolling window of 3 m with one layer and nothing else."""
    layer = KINDS[name](scan=source, **options)
    return LayeredCostmap(
        CostmapParams.example_local(
            plugins=(name,), release=release, track_unknown_space=track_unknown_space, **{name: layer}
        ),
        ROOM,
        footprint,
    )


def on_map(release="humble"):
    """The obstacle layer alone, over the whole map."""
    layer = ObstacleLayer(scan=BEAM)
    params = CostmapParams.example_global(
        rolling_window=False, width=8, height=8, plugins=("obstacle_layer",), obstacle_layer=layer, release=release
    )
    return LayeredCostmap(params, ROOM, POINT)


def see(costmap, pose, ranges, height=0.132, angle=0.0, range_min=0.12):
    """Update with a scan of beams that are spread evenly, or of one beam at an angle."""
    scan = LaserScan(np.atleast_1d(ranges), angle, 2 * math.pi / np.size(ranges), range_min, 20.0)
    costmap.observe(scan, pose, height)
    return costmap.update(pose)


def marked(costmap):
    """Lower x of the marked cells in the row of the sensor, m."""
    row, _ = costmap.world_to_map(1.0 if costmap.origin_x < 0 else costmap.origin_x, 1.025)
    return lethal_in(costmap, row)


def lethal_in(costmap, row):
    columns = np.flatnonzero(costmap.costs[row] == LETHAL_OBSTACLE)
    return [round(costmap.origin_x + col * costmap.resolution, 3) for col in columns]


class TestPhantom:
    """Worked example A: a wall at 2.0 m, one beam along +x from (1.025, 1.025)."""

    POSE = Pose(1.025, 1.025)
    READINGS = (
        (0.976, [2.0], [2.0]),
        (0.971, [1.95, 2.0], [1.95, 2.0]),
        (0.976, [1.95, 2.0], [2.0]),
        (0.976, [1.95, 2.0], [2.0]),
        (0.976, [1.95, 2.0], [2.0]),
        (math.inf, [1.95, 2.0], [2.0]),
        (1.1, [2.1], [2.1]),
    )

    @pytest.mark.parametrize(("name", "column"), [("voxel_layer", 1), ("obstacle_layer", 2)])
    def test_readings_one_after_the_other(self, name, column):
        costmap = window(name)
        for reading in self.READINGS:
            seen = see(costmap, self.POSE, reading[0])
            assert (seen.origin_x, seen.origin_y) == pytest.approx((-0.45, -0.45))
            assert marked(seen) == reading[column]

    @pytest.mark.parametrize(("distance", "stays"), [(1.066, True), (1.076, False)])
    def test_a_voxel_ray_clears_what_it_passes_by_two_cells(self, distance, stays):
        costmap = window("voxel_layer")
        see(costmap, self.POSE, 0.976)
        assert (2.0 in marked(see(costmap, self.POSE, distance))) == stays

    @pytest.mark.parametrize(("name", "last"), [("voxel_layer", 1.9), ("obstacle_layer", 2.0)])
    def test_how_far_a_ray_clears(self, name, last):
        source = BEAM.replace(marking=False)
        unknown = window(name, source=source, track_unknown_space=True, z_voxels=16) if name == "voxel_layer" else None
        costmap = unknown or window(name, source=source, track_unknown_space=True)
        seen = see(costmap, self.POSE, 0.976)
        row, col = seen.world_to_map(1.025, 1.025)
        free = np.flatnonzero(seen.costs[row] == FREE_SPACE)
        assert free[-1] == round((last - seen.origin_x) / 0.05)
        assert (seen.costs[row, col : free[-1] + 1] == FREE_SPACE).all()


def test_voxels_move_with_the_window():
    # Marked at 0.08 m; the window rolls by two cells, and a ray at 0.02 m leaves the mark above it.
    costmap = window("voxel_layer", z_voxels=16, z_resolution=0.05)
    assert marked(see(costmap, Pose(1.025, 1.025), 0.976, height=0.08)) == [2.0]
    assert marked(see(costmap, Pose(1.125, 1.025), 1.3, height=0.02)) == [2.0, 2.4]


@pytest.mark.parametrize(("threshold", "frees"), [(0, False), (1, True)])
def test_voxels_that_a_short_column_lacks_are_not_counted_against_it(threshold, frees):
    # The ray clears the lower of two voxels: the upper one remains unknown.
    column = {"z_voxels": 2, "z_resolution": 0.2, "unknown_threshold": threshold, "footprint_clearing_enabled": False}
    costmap = window("voxel_layer", source=BEAM.replace(marking=False), track_unknown_space=True, **column)
    assert (see(costmap, Pose(1.025, 1.025), 0.976).costs == FREE_SPACE).any() == frees


class TestRanges:
    """Worked example B: the sensor at (3.525, 3.525), one beam along +x."""

    POSE = Pose(3.525, 3.525)

    @pytest.mark.parametrize(("distance", "flat", "voxel"), [(2.499, 1, 0), (2.51, 1, 0), (2.53, 0, 0)])
    def test_what_is_marked(self, distance, flat, voxel):
        seen = see(on_map(), self.POSE, distance)
        assert (seen.costs == LETHAL_OBSTACLE).sum() == flat
        # The window ends before 2.5 m.
        assert (see(window("voxel_layer"), self.POSE, distance).costs == LETHAL_OBSTACLE).sum() == voxel

    @pytest.mark.parametrize(("distance", "marks"), [(2.499, 1), (2.51, 0), (2.53, 0)])
    def test_voxels_are_marked_by_metres(self, distance, marks):
        params = CostmapParams(width=8, height=8, resolution=0.05, plugins=("voxel_layer",), voxel_layer={"scan": BEAM})
        seen = see(LayeredCostmap(params, ROOM, POINT), self.POSE, distance)
        assert (seen.costs == LETHAL_OBSTACLE).sum() == marks

    @pytest.mark.parametrize(("distance", "last"), [(2.51, 119), (2.53, 121), (3.2, 130)])
    def test_how_far_the_obstacle_layer_clears(self, distance, last):
        seen = see(on_map(), self.POSE, distance)
        assert np.flatnonzero(seen.costs[70] == FREE_SPACE).tolist() == list(range(70, last + 1))

    def test_a_wall_between_the_two_ranges_is_erased_from_the_layer_but_not_from_the_map(self):
        grid = GridMap(np.zeros((150, 150), bool) | (np.arange(150) == 121))
        params = CostmapParams.example_global(plugins=("static_layer", "obstacle_layer"))
        costmap = LayeredCostmap(params, grid, POINT)
        seen = see(costmap, self.POSE, 2.53)
        assert costmap.layer("obstacle_layer").costs[70, 121] == FREE_SPACE
        assert seen.costs[70, 121] == LETHAL_OBSTACLE

    def test_jazzys_obstacle_layer_marks_by_metres_and_by_cells(self):
        seen = {distance: see(on_map("jazzy"), self.POSE, distance).costs for distance in (2.499, 2.51)}
        assert {key: (costs == LETHAL_OBSTACLE).sum() for key, costs in seen.items()} == {2.499: 1, 2.51: 0}

    def test_what_is_nearer_than_range_min_is_no_reading(self):
        costmap = window("obstacle_layer")
        assert marked(see(costmap, TestPhantom.POSE, 0.119)) == []
        assert marked(see(costmap, TestPhantom.POSE, 0.12)) == [1.1]


class TestRolling:
    """Worked example C."""

    def test_origin_follows_by_whole_cells(self):
        costmap = window("voxel_layer")
        origins = [costmap.update(Pose(x, 1.0)).origin_x for x in (1.0, 1.06, 1.11, 0.99)]
        assert origins == pytest.approx([-0.45, -0.45, -0.40, -0.45])

    def test_the_footprint_frees_what_was_marked(self):
        costmap = window("voxel_layer", DISC)
        seen = see(costmap, Pose(1.025, 1.025), 0.3)
        assert (seen.costs == LETHAL_OBSTACLE).sum() == 1
        seen = see(costmap, Pose(1.1, 1.025), math.inf)
        assert not (seen.costs == LETHAL_OBSTACLE).any()

    def test_the_footprint_frees_the_cells_but_not_the_voxels(self):
        costmap = window("voxel_layer", DISC)
        see(costmap, Pose(1.025, 1.025), 0.3)
        see(costmap, Pose(1.1, 1.025), math.inf)
        assert (costmap.layer("voxel_layer").columns >> 16).any()

    def test_the_sensor_may_be_off_the_centre(self):
        costmap = window("voxel_layer")
        costmap.observe(LaserScan(np.array([0.5]), 0.0, 0.1, 0.12, 20.0), Pose(1.025, 1.225, math.pi / 2))
        seen = costmap.update(Pose(1.025, 1.025))
        assert seen.costs[seen.world_to_map(1.025, 1.725)] == LETHAL_OBSTACLE
        assert (seen.costs == LETHAL_OBSTACLE).sum() == 1

    def test_cells_outside_the_box_keep_what_they_had(self):
        costmap = window("voxel_layer")
        see(costmap, Pose(1.025, 1.025), 1.2)
        costmap.layer("voxel_layer").reset()
        seen = see(costmap, Pose(1.025, 1.025), math.inf)
        assert costmap.layer("voxel_layer").costs.max() == FREE_SPACE
        assert marked(seen) == [2.2]


class TestHeights:
    POSE = Pose(1.025, 1.025)

    @pytest.mark.parametrize("name", KINDS)
    @pytest.mark.parametrize(("height", "seen"), [(0.0, 1), (0.132, 0)])
    def test_a_source_takes_heights_as_nav2_does_unless_told(self, name, height, seen):
        costmap = see(window(name, source=ObservationSource(clearing=True)), self.POSE, 1.0, height)
        assert len(marked(costmap)) == seen

    @pytest.mark.parametrize(
        ("name", "release", "seen"),
        [("obstacle_layer", "humble", 0), ("voxel_layer", "humble", 1), ("voxel_layer", "jazzy", 0)],
    )
    def test_only_humbles_voxel_layer_does_not_look_at_the_least_height(self, name, release, seen):
        costmap = window(name, release=release, min_obstacle_height=0.2)
        assert len(marked(see(costmap, self.POSE, 1.0))) == seen

    @pytest.mark.parametrize("name", KINDS)
    def test_what_is_too_high_clears_and_does_not_mark(self, name):
        costmap = window(name, max_obstacle_height=0.5)
        see(costmap, self.POSE, 1.0, height=0.4)
        assert marked(see(costmap, self.POSE, 1.3, height=0.4)) == [2.3]
        assert marked(see(costmap, self.POSE, 1.5, height=0.6)) == ([] if name == "obstacle_layer" else [2.3])

    def test_below_the_lowest_voxel_marks_in_it_and_above_the_highest_not_at_all(self):
        options = {"z_voxels": 4, "z_resolution": 0.05, "origin_z": 0.1}
        low, high = (see(window("voxel_layer", **options), self.POSE, 1.0, height) for height in (0.05, 0.31))
        assert (marked(low), marked(high)) == ([2.0], [])

    def test_a_column_needs_more_marks_than_the_threshold(self):
        costmap = window("voxel_layer", mark_threshold=1, z_resolution=0.05)
        assert marked(see(costmap, self.POSE, 1.0, height=0.132)) == []
        assert marked(see(costmap, self.POSE, 1.0, height=0.232)) == [2.0]

    def test_a_column_with_too_many_unknown_voxels_stays_unknown(self):
        options = {"track_unknown_space": True, "z_voxels": 16, "z_resolution": 0.05}
        for threshold, expected in ((15, FREE_SPACE), (14, NO_INFORMATION)):
            costmap = window("voxel_layer", unknown_threshold=threshold, **options)
            seen = see(costmap, self.POSE, 1.0)
            assert seen.costs[seen.world_to_map(1.525, 1.025)] == expected


def test_humble_loses_rays_that_leave_over_the_lower_edge_and_jazzy_does_not():
    pose = Pose(1.025, 1.025)
    kept = {}
    for release in ("humble", "jazzy"):
        costmap = window("voxel_layer", release=release, track_unknown_space=True, z_voxels=16, z_resolution=0.05)
        see(costmap, pose, math.inf)
        kept[release] = []
        for beam in range(200):
            costmap.clear()
            seen = see(costmap, pose, 3.0, angle=math.pi + 0.004 * (beam - 100))
            kept[release].append(bool((seen.costs[:, 3] == FREE_SPACE).any()))
    assert all(kept["jazzy"])
    assert 0.03 < 1.0 - np.mean(kept["humble"]) < 0.4


def test_jazzy_may_combine_without_writing_over_the_unknown():
    grid = GridMap(np.zeros((150, 150), bool), unknown=np.arange(150) > 75 * np.ones((150, 1)))
    plugins = ("static_layer", "obstacle_layer")
    for method, expected in ((1, LETHAL_OBSTACLE), (2, NO_INFORMATION)):
        layer = ObstacleLayer(combination_method=method, scan=BEAM)
        params = CostmapParams.example_global(plugins=plugins, obstacle_layer=layer, release="jazzy")
        seen = see(LayeredCostmap(params, grid, POINT), Pose(3.525, 3.525), [1.0, 1.0])
        assert seen.costs[70, 90] == expected
        assert seen.costs[70, 50] == LETHAL_OBSTACLE


def test_a_window_in_another_frame_looks_the_map_up_where_it_is():
    grid = GridMap(np.arange(150) == 60 * np.ones((150, 1)))
    params = CostmapParams.example_local(plugins=("static_layer",))
    # Seen from a frame at (3.0, 3.0) that is turned to the left, a wall along x = 3.0 lies along its y = 0.
    seen = LayeredCostmap(params, grid, POINT).update(Pose(0.0, 0.0), Pose(3.0, 3.0, math.pi / 2))
    row = round(-seen.origin_y / 0.05) - 1
    assert (seen.costs[row] == LETHAL_OBSTACLE).all()
    assert (seen.costs == LETHAL_OBSTACLE).sum() == 60
