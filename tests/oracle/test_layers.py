"""Recorded scans make of our layers what they made of Nav2's, cell by cell."""

from __future__ import annotations

import json

import pytest

from evolution.validation import LayersOracle, layer_measures
from tests.oracle_data import LAYERS_ORACLE, needs_layers_oracle


@needs_layers_oracle
@pytest.mark.parametrize("number", [1, 4, 7])
def test_every_recorded_cell_agrees(tmp_path, number):
    config = json.loads((LAYERS_ORACLE / "config.json").read_text())
    config["sequences"] = [entry for entry in config["sequences"] if entry["map"] == number]
    (tmp_path / "config.json").write_text(json.dumps(config))
    name = config["sequences"][0]["file"]
    (tmp_path / name).symlink_to(LAYERS_ORACLE / name)
    measures = {measure.key: measure for measure in layer_measures(LayersOracle(tmp_path))}
    conditions, updates = len(config["conditions"]), config["sequences"][0]["global_updates"]
    assert {key: measure.value for key, measure in measures.items()} == {
        "local_layer_identical": 1.0,
        "local_costmap_identical": 1.0,
        "global_layer_identical": 1.0,
        "global_costmap_identical": 1.0,
        "local_cells_differ_mean": 0.0,
        "global_cells_differ_mean": 0.0,
    }
    assert measures["local_layer_identical"].count == 20 * conditions
    assert measures["global_layer_identical"].count == updates * conditions
