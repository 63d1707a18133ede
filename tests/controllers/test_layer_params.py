"""Heights and voxels of the observing layers, read from a parameter file and written back."""

from __future__ import annotations

from controllers.nav2_params import load_preset
from controllers.nav2_params.parsing import parse_nav2_params
from controllers.nav2_params.writing import write_nav2_params
from gym_mapbench.costmap import ObservationSource, VoxelLayer


def local_costmap_of(layer):
    """What is read of a file whose local costmap has one voxel layer."""
    costmap = {"plugins": ["voxel_layer"], "voxel_layer": {"plugin": "nav2_costmap_2d::VoxelLayer", **layer}}
    return parse_nav2_params(
        {"local_costmap": {"local_costmap": {"ros__parameters": costmap}}}
    ).navigation.local_costmap


def test_voxels_and_heights_are_read_where_nav2_has_them():
    scan = {"clearing": True, "max_obstacle_height": 2.0, "min_obstacle_height": 0.1}
    layer = {"z_voxels": 12, "z_resolution": 0.1, "origin_z": 0.05, "mark_threshold": 1, "max_obstacle_height": 1.5}
    read = local_costmap_of({**layer, "unknown_threshold": 9, "observation_sources": "scan", "scan": scan})
    # The robots' lidar lies in the plane of their base, so nothing it sees may be too low.
    expected = ObservationSource(clearing=True, max_obstacle_height=2.0, min_obstacle_height=0.0)
    assert read.voxel_layer == VoxelLayer(**layer, unknown_threshold=9, scan=expected)


def test_nav2s_own_defaults_hold_where_a_file_is_silent():
    read = local_costmap_of({"observation_sources": "scan", "scan": {}}).voxel_layer
    assert (read.z_voxels, read.z_resolution, read.max_obstacle_height) == (10, 0.2, 2.0)
    assert (read.scan.max_obstacle_height, read.scan.clearing) == (0.0, False)


def test_a_written_file_has_them_in_their_groups_and_no_release():
    document = write_nav2_params(load_preset("thesis"))
    costmap = document["local_costmap"]["local_costmap"]["ros__parameters"]
    assert "release" not in costmap
    assert costmap["voxel_layer"]["z_voxels"] == 16
    assert costmap["voxel_layer"]["scan"]["max_obstacle_height"] == 2.0
    assert "scan" not in costmap["inflation_layer"]
