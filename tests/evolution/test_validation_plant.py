"""The plant against recordings: a recording made by hand is read and replayed, and the shared one is met."""

from __future__ import annotations

import json

import numpy as np
import pytest

from evolution.cli import main
from evolution.validation import PlantOracle, plant_measures
from tests.oracle_data import PLANT_ORACLE, needs_plant_oracle

COLUMNS = 17


def states_of(poses):
    """Recorded states ``(n, 17)`` with these x, y and yaw."""
    states = np.zeros((len(poses), COLUMNS))
    states[:, [0, 1, 5]] = poses
    return states


@pytest.fixture
def recording(tmp_path):
    """One sequence at 0.26 m/s from rest: 2.5 m/s^2 in steps of 1 ms, late by one step."""
    speeds = np.minimum(2.5e-3 * np.arange(200), 0.26)
    x = np.cumsum(1e-3 * speeds)[49::50]
    np.savez(
        tmp_path / "bundle_shared.npz",
        names=["go"],
        **{
            "go/start": np.zeros(16),
            "go/commands": np.tile([0.26, 0.0], (4, 1)),
            "go/states": states_of(np.stack([x, 0 * x, 0 * x], axis=1)),
        },
    )
    return tmp_path


def test_a_recording_is_replayed_by_each_plant(recording):
    measures = {one.key: one for one in plant_measures(PlantOracle(recording))}
    assert measures["plant_fortress_position_rms_mm"].value < 1e-9
    assert measures["plant_ideal_position_rms_mm"].value == pytest.approx(1.2, abs=0.4)
    assert measures["plant_fortress_position_rms_mm"].count == 1
    assert measures["plant_fortress_position_rms_mm_waffle"].count == 0


def test_the_command_knows_such_a_directory(recording, capsys):
    assert main(["validate", str(recording), "--format", "json"]) == 0
    assert json.loads(capsys.readouterr().out)["plant_fortress_heading_rms_deg"]["value"] == 0.0


def test_a_file_without_its_fields_is_named(recording, capsys):
    np.savez(recording / "bundle_shared.npz", names=["go"])
    assert main(["validate", str(recording)]) == 2
    assert "bundle_shared.npz: expected the field 'go/start'" in capsys.readouterr().err


@needs_plant_oracle
def test_the_shared_recordings_are_met():
    measures = {one.key: one for one in plant_measures(PlantOracle(PLANT_ORACLE))}
    assert not [one for one in measures.values() if one.missed]
    assert measures["plant_fortress_position_rms_mm"].value < 0.3
    assert measures["contact_headon_0.26_mm"].value < 1.0
