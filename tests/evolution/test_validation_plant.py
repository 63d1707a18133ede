"""The plant against recordings: a recording made by hand is read and replayed, and the shared one is met."""

from __future__ import annotations

import json

import numpy as np
import pytest

from evolution.cli import main
from evolution.driving import RunResult
from evolution.validation import PlantOracle, PlantRuns, plant_measures, plant_run_measures
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


def ends_of(variant, times):
    """Recorded runs of one variant on one map; a time below 0 is a failure."""
    return [
        {
            "variant": variant,
            "map": "m",
            "controller": name,
            "outcome": "goal" if t > 0 else "timeout",
            "time_s": abs(t),
        }
        for name, t in zip(("dwb", "mppi", "rpp"), times, strict=True)
    ]


@pytest.fixture
def runs(tmp_path):
    """Runs of three controllers, without noise and with two seeds of noise."""
    recorded = [
        *ends_of("fort:none:0", (20.0, 30.0, 44.0)),
        *ends_of("fort:nominal:2", (20.0, 30.0, 40.0)),
        *ends_of("fortwaffle:none:0", (24.0, 36.0, -48.0)),
        *ends_of("ours:none:0", (10.0, 20.0, 30.0)),
        *ends_of("eps:none:0", (11.0, 40.0, 30.0)),
        *ends_of("ours:nominal:2", (10.0, 20.0, 30.0)),
        *ends_of("ours:nominal:5", (10.0, 20.0, -5.0)),
    ]
    (tmp_path / "closed_loop.json").write_text(json.dumps({"runs": recorded}))
    arrays = {"m/occupancy": np.zeros((60, 60), bool), "m/start_goal": [[0.5, 0.5, 0.0], [2.5, 2.5, 1.5]]}
    np.savez(tmp_path / "closed_loop_maps.npz", **arrays)
    return PlantRuns(tmp_path)


def drive_alike(jobs):
    """20, 30 and 40 s, whatever the world."""
    times = {"dwb": 20.0, "mppi": 30.0, "rpp": 40.0}
    return [RunResult("goal", times[job.controller.name], 1.0) for job in jobs]


def test_whole_runs_and_controls_are_compared_with_the_recorded_ones(runs):
    values = {one.key: one.value for one in plant_run_measures(runs, drive_alike)}
    assert values["runs_fortress_none_outcomes_equal"] == values["runs_fortress_none_ranks_kept"] == 1.0
    assert values["runs_fortress_none_time_ratio_median"] == 1.0
    assert values["runs_ideal_none_time_ratio_p95"] == pytest.approx(1.09)
    assert values["runs_fortress_none_waffle_outcomes_equal"] == pytest.approx(2 / 3)
    assert values["runs_fortress_none_waffle_time_ratio_median"] == pytest.approx(1.2)
    assert values["control_none_start_shifted_time_ratio_median"] == pytest.approx(1.1)
    assert values["control_none_start_shifted_ranks_kept"] == 0.0
    assert values["control_nominal_other_seed_outcomes_equal"] == pytest.approx(2 / 3)
    assert values["control_nominal_other_seed_ranks_kept"] == 1.0


def test_recorded_runs_are_repeated_with_their_world_and_seed(runs):
    jobs = []
    plant_run_measures(runs, lambda asked: jobs.extend(asked) or drive_alike(asked))
    worlds = [(job.settings.environment.plant, job.settings.robot.name, job.settings.environment.noise) for job in jobs]
    assert [(plant, robot) for plant, robot, _ in worlds[::3]] == [
        ("ideal", "turtlebot3_waffle"),
        ("fortress", "turtlebot3_waffle"),
        ("ideal", "turtlebot3_waffle"),
        ("fortress", "turtlebot3_waffle"),
        ("fortress", "turtlebot3_waffle_gz"),
    ]
    seeds = [job.seed for job in jobs[::3]]
    assert len(set(seeds)) == 2, "the plant does not change the seed"
    assert [job.controller.name for job in jobs[:3]] == ["dwb", "mppi", "rpp"]


def test_runs_without_their_fields_are_named(runs, recording, capsys):
    (recording / "closed_loop.json").write_text(json.dumps({"runs": [{"variant": "ours:none:0"}]}))
    assert main(["validate", str(recording), "--workers", "1"]) == 2
    assert "closed_loop.json: not a table of runs ('map')" in capsys.readouterr().err
    assert main(["validate", str(recording), "--units-only"]) == 0


@needs_plant_oracle
def test_the_shared_recordings_are_met():
    measures = {one.key: one for one in plant_measures(PlantOracle(PLANT_ORACLE))}
    assert not [one for one in measures.values() if one.missed]
    assert measures["plant_fortress_position_rms_mm"].value < 0.3
    assert measures["contact_headon_0.26_mm"].value < 1.0
