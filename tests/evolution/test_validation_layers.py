"""``mapbench validate`` on recorded layers: what it counts, and what it refuses."""

from __future__ import annotations

import json

import numpy as np
import pytest

from evolution.cli import main
from evolution.validation import LayersOracle, layer_measures

OPTIONS = {
    "scan_sets": {"n0": {"range_max_m": 3.5}},
    "conditions": {"exact_n0": {"scans": "n0"}},
    "range_unit_m": 0.001,
    "beams": 4,
    "range_min_m": 0.12,
    "sensor_z_m": 0.132,
    "local": {"width": 3, "height": 3, "resolution": 0.05, "rolling_window": True, "plugins": ["voxel_layer"]},
    "global": {"track_unknown_space": True, "plugins": ["static_layer", "obstacle_layer"]},
    "scan": {"clearing": True, "marking": True, "observation_persistence": 0.0},
    "inflation": {"inflation_radius": 0.55},
    "robot_radius": 0.001,
    "footprint_padding": 0.0,
    "sequences": [{"map": 3, "file": "map_03.npz"}],
}


def recording():
    """Three updates of a robot that stands still and sees one thing 1 m ahead; worked out by hand."""
    arrays = {
        "occupied": np.zeros((80, 80), bool),
        "ranges_n0": np.tile(np.array([1000, 65535, 65535, 65535], np.uint16), (3, 1)),
        "sample": np.array([0, 2]),
        "gsample": np.array([0, 2]),
        "gmaster_sample": np.array([2]),
    }
    for which, rows in (("local", 60), ("global", 80)):
        arrays[f"exact_n0.{which}_pose"] = np.tile([2.025, 2.025, 0.0], (3, 1))
        arrays[f"exact_n0.{which}_sensor"] = np.tile([2.025, 2.025], (3, 1))
        arrays[f"exact_n0.{which}_layer"] = np.zeros((2, rows, rows), np.uint8)
    arrays["exact_n0.local_layer"][:, 30, 50] = 254
    arrays["exact_n0.local_master"] = arrays["exact_n0.local_layer"].copy()
    arrays["exact_n0.global_layer"][:] = 255
    arrays["exact_n0.global_layer"][:, 40, 40:60] = 0
    arrays["exact_n0.global_layer"][:, 40, 60] = 254
    arrays["exact_n0.global_master"] = np.zeros((1, 80, 80), np.uint8)
    arrays["exact_n0.global_master"][0, 40, 60] = 254
    return arrays


def write(directory, arrays, **changes):
    (directory / "config.json").write_text(json.dumps({**OPTIONS, **changes}))
    np.savez(directory / "map_03.npz", **arrays)
    return directory


def test_what_is_recorded_alike_is_identical(tmp_path, capsys):
    assert main(["validate", str(write(tmp_path, recording())), "--format", "json"]) == 0
    document = json.loads(capsys.readouterr().out)
    counts = {key: entry["count"] for key, entry in document.items() if key != "disagreements"}
    assert counts == {
        "local_layer_identical": 2,
        "local_costmap_identical": 2,
        "global_layer_identical": 2,
        "global_costmap_identical": 1,
        "local_cells_differ_mean": 2,
        "global_cells_differ_mean": 1,
    }
    assert {entry["value"] for key, entry in document.items() if key.endswith("_identical")} == {1.0}
    assert {entry["value"] for key, entry in document.items() if key.endswith("_mean")} == {0.0}


def test_what_differs_is_counted_and_named(tmp_path):
    arrays = recording()
    arrays["exact_n0.local_layer"][1, :2, :5] = 254
    arrays["exact_n0.local_master"][0, 0, :3] = 7
    arrays["exact_n0.global_master"] = np.zeros((1, 4, 4), np.uint8)
    measures = {measure.key: measure for measure in layer_measures(LayersOracle(write(tmp_path, arrays)))}
    assert (measures["local_layer_identical"].value, measures["local_layer_identical"].count) == (0.5, 2)
    assert measures["local_layer_identical"].worst == "map 3 exact_n0 update 2: 10"
    assert measures["local_cells_differ_mean"].value == 1.5
    assert measures["global_layer_identical"].value == 1.0
    assert measures["global_cells_differ_mean"].value == 80 * 80


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"conditions": {"exact_n0": {"scans": "n7"}}}, "config.json: expected 'n7', found none"),
        ({"conditions": 3}, "config.json: "),
        ({"sequences": [{"map": 3}]}, "config.json: expected 'file', found none"),
        (
            {"sequences": [{"map": 3, "file": "map_04.npz"}]},
            "map_04.npz: expected recorded results, found no such file",
        ),
        ({"local": {**OPTIONS["local"], "plugin": []}}, "did you mean 'plugins'"),
        ({"scan": {"observation_persistence": 2.0}}, "scan.observation_persistence: expected 0, got 2.0"),
        ({"beams": 0}, "config.json: "),
        ({"conditions": {"tb3": {"scans": "n0"}}}, "expected the field 'tb3.local_pose'"),
    ],
)
def test_incomplete_directories_are_refused_in_one_line(tmp_path, capsys, changes, message):
    assert main(["validate", str(write(tmp_path, recording(), **changes))]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("sample", np.arange(3), "map_03.npz: sample: expected 2 updates, one for each grid, got 3"),
        ("occupied", np.zeros(80, bool), "map_03.npz: occupancy: expected"),
        ("ranges_n0", np.zeros((2, 4), np.uint16), "exact_n0: scan: expected shape (3, 4), got (2, 4)"),
        ("exact_n0.local_pose", np.zeros((3, 2)), "exact_n0: pose: expected shape (3, 3), got (3, 2)"),
    ],
)
def test_fields_that_do_not_fit_are_refused_in_one_line(tmp_path, capsys, field, value, message):
    assert main(["validate", str(write(tmp_path, {**recording(), field: value}))]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
