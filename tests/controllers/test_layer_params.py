"""Options of the costmap layers, read from a parameter file and written back."""

from __future__ import annotations

import dataclasses
import sys
import types

import pytest

from controllers.nav2_params import load_preset
from controllers.nav2_params.parsing import parse_nav2_params
from controllers.nav2_params.plugins import COSTMAP_LAYERS
from controllers.nav2_params.writing import write_nav2_params
from gym_mapbench.costmap import LAYERS, DenoiseLayer, ObservationSource, VoxelLayer
from gym_mapbench.errors import ConfigError
from gym_mapbench.releases import RELEASES
from gym_mapbench.ros_params import since

UNSEEN = ObservationSource(marking=False, clearing=False)
"""The lidar of a layer without one."""


def local_costmap_of(layer, release="humble"):
    """What is read of a file whose local costmap has one voxel layer."""
    costmap = {"plugins": ["voxel_layer"], "voxel_layer": {"plugin": "nav2_costmap_2d::VoxelLayer", **layer}}
    return parse_nav2_params(
        {"local_costmap": {"local_costmap": {"ros__parameters": costmap}}}, release=release
    ).navigation.local_costmap


def test_voxels_and_heights_are_read_where_nav2_has_them():
    scan = {"clearing": True, "max_obstacle_height": 2.0, "min_obstacle_height": 0.1}
    layer = {"z_voxels": 12, "z_resolution": 0.1, "origin_z": -0.05, "mark_threshold": 1, "max_obstacle_height": 1.5}
    read = local_costmap_of({**layer, "unknown_threshold": 9, "observation_sources": "scan", "scan": scan})
    # The robots' lidar lies in the plane of their base, so nothing it sees may be too low.
    expected = ObservationSource(clearing=True, max_obstacle_height=2.0, min_obstacle_height=0.0)
    assert read.voxel_layer == VoxelLayer(**layer, unknown_threshold=9, scan=expected)


def test_numbers_that_are_too_high_for_the_voxel_layer_are_lowered():
    # From its height of 0 the lidar would mark voxels that begin above it, but never clear them.
    high = {"z_voxels": 20, "mark_threshold": 17, "unknown_threshold": 99, "origin_z": 0.1}
    assert local_costmap_of(high).voxel_layer == VoxelLayer(
        z_voxels=16, mark_threshold=16, unknown_threshold=16, origin_z=0.0, scan=UNSEEN
    )


def test_a_combination_method_that_there_is_not_is_1_since_jazzy():
    assert local_costmap_of({"combination_method": 99}, "jazzy").voxel_layer.combination_method == 1
    assert local_costmap_of({"combination_method": 2}, "jazzy").voxel_layer.combination_method == 2
    with pytest.raises(ConfigError, match="combination_method"):
        local_costmap_of({"combination_method": 99})  # of which Humble would write nothing


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


def denoising(costmap, **layer):
    """A file whose costmap has a denoise layer under a name of the user's own."""
    group = {"plugin": "nav2_costmap_2d::DenoiseLayer", **layer}
    usual = {f"{name}_layer.plugin": f"nav2_costmap_2d::{name.capitalize()}Layer" for name in ("static", "inflation")}
    parameters = {"plugins": ["static_layer", "salt", "inflation_layer"], "salt": group, **usual}
    return {costmap: {costmap: {"ros__parameters": parameters}}}


@pytest.mark.parametrize("release", RELEASES)
@pytest.mark.parametrize("costmap", ["local_costmap", "global_costmap"])
def test_the_denoise_layer_is_read_and_written_back(costmap, release):
    document = denoising(costmap, minimal_group_size=3, group_connectivity_type=4, enabled=True)
    read = parse_nav2_params(document, release=release)
    params = getattr(read.navigation, costmap)
    assert params.plugins == ("static_layer", "denoise_layer", "inflation_layer")
    assert params.layers["denoise_layer"] == DenoiseLayer(minimal_group_size=3, group_connectivity_type=4)
    assert {finding.kind for finding in read.findings} <= {"ros_only"}
    written = write_nav2_params(read.navigation)
    group = written[costmap][costmap]["ros__parameters"]["denoise_layer"]
    assert group == {
        "plugin": "nav2_costmap_2d::DenoiseLayer",
        "enabled": True,
        "minimal_group_size": 3,
        "group_connectivity_type": 4,
    }
    again = parse_nav2_params(written, release=release).navigation
    assert getattr(again, costmap).layers["denoise_layer"] == params.layers["denoise_layer"]


def test_nav2_takes_8_for_any_other_connectivity():
    read = parse_nav2_params(denoising("local_costmap", group_connectivity_type=6))
    assert read.navigation.local_costmap.layers["denoise_layer"] == DenoiseLayer()
    assert read.named("replaced") == ("local_costmap.local_costmap.salt.group_connectivity_type",)


@pytest.mark.parametrize(
    ("layer", "message"),
    [
        ({"minimal_group_size": 2.5}, r"salt\.minimal_group_size: expected"),
        ({"group_connectivity_type": "eight"}, r"salt\.group_connectivity_type: expected 4 or 8, got 'eight'"),
        ({"enabled": "yes"}, r"salt\.enabled: expected true or false, got 'yes'"),
    ],
)
def test_wrong_values_are_refused_with_their_full_names(layer, message):
    with pytest.raises(ConfigError, match=rf"local_costmap\.local_costmap\.{message}"):
        parse_nav2_params(denoising("local_costmap", **layer))


def test_a_misspelt_option_is_listed_with_the_one_that_is_meant():
    read = parse_nav2_params(denoising("local_costmap", minimum_group_size=3))
    (finding,) = [finding for finding in read.findings if finding.kind == "unknown"]
    assert (finding.name.rpartition(".")[2], finding.why) == (
        "minimum_group_size",
        "did you mean 'minimal_group_size'?",
    )


def test_a_layer_that_the_release_does_not_have_is_refused(monkeypatch):
    newer = dataclasses.replace(COSTMAP_LAYERS["denoise_layer"], names=since("jazzy", "nav2_costmap_2d::DenoiseLayer"))
    monkeypatch.setitem(COSTMAP_LAYERS, "denoise_layer", newer)
    with pytest.raises(ConfigError, match=r"salt\.plugin: Nav2 Humble has no DenoiseLayer; --nav2 jazzy has"):
        parse_nav2_params(denoising("local_costmap"), release="humble")
    assert (
        "denoise_layer"
        in parse_nav2_params(denoising("local_costmap"), release="jazzy").navigation.local_costmap.layers
    )


def test_a_third_partys_layer_cannot_be_written(monkeypatch):
    monkeypatch.setitem(
        sys.modules, "strange", types.SimpleNamespace(layer=dataclasses.replace(LAYERS["static_layer"]))
    )
    thesis = load_preset("thesis")
    changed = thesis.replace(local_costmap=thesis.local_costmap.replace(plugins=("strange:layer",)))
    with pytest.raises(ConfigError, match="expected costmap layers that ROS has, got 'strange:layer'"):
        write_nav2_params(changed)


@pytest.mark.parametrize(
    ("given", "read"),
    [
        ({"lethal_cost_threshold": 253}, {"lethal_cost_threshold": 100}),
        ({"unknown_cost_value": -1}, {"unknown_cost_value": 255}),
        ({"unknown_cost_value": 300, "lethal_cost_threshold": 65}, {"unknown_cost_value": 44}),
    ],
)
def test_map_values_out_of_bounds_are_bounded_as_in_nav2(given, read):
    document = {"global_costmap": {"global_costmap": {"ros__parameters": given}}}
    parsed = parse_nav2_params(document)
    costmap = parsed.navigation.global_costmap
    assert {name: getattr(costmap, name) for name in read} == read
    replaced = {finding.name.rpartition(".")[2] for finding in parsed.findings if finding.kind == "replaced"}
    assert replaced == set(read)
