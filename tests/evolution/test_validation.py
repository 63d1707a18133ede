"""``mapbench validate``: what it refuses, what it counts, and that it says so when something is off."""

from __future__ import annotations

import json
import math
import shutil
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from evolution.cli import main
from evolution.driving import EXECUTORS
from evolution.validation.closed_loop import DrivenRun, RunTask, closed_loop_measures, drive_again, drive_recorded
from evolution.validation.measures import Cases, Measure
from evolution.validation.mppi_units import mppi_measures
from evolution.validation.oracle import Oracle
from evolution.validation.units import costmap_measures, dwb_measures, navfn_measures, other_measures, rpp_measures
from gym_mapbench.errors import MapFormatError, RunError
from tests.oracle_data import JAZZY_ORACLE, ORACLE, needs_jazzy_oracle, needs_oracle


def run_of(
    *, ours: float, recorded: float, success=True, controller="RPP", clearance=0.1, deviation=math.nan, number=0
) -> DrivenRun:
    record = {
        "map": number,
        "controller": controller,
        "variant": "default",
        "local_costmap": "full",
        "strict_success": True,
        "time": recorded,
        "min_clearance": clearance,
        "reason": "goal",
    }
    return DrivenRun(record, "A", success, ours, "goal", deviation)


def by_key(measures):
    return {measure.key: measure for measure in measures}


def test_cases_name_the_worst():
    cases = Cases("error", "0")
    for error, name in ((0.1, "a"), (0.4, "b"), (0.2, "c")):
        cases.add(error, name)
    assert cases.largest().value == 0.4
    assert cases.median().value == 0.2
    assert cases.agreement().value == pytest.approx(1 - 0.7 / 3)
    assert cases.share_within(0.2, "share", "").value == pytest.approx(2 / 3)
    assert cases.largest().worst == "b: 0.4"
    assert Cases("none", "").largest().count == 0


def test_runs_near_contact_are_counted_apart():
    driven = [
        run_of(ours=10, recorded=10),
        run_of(ours=12, recorded=10),
        run_of(ours=5, recorded=10, success=False),
        run_of(ours=5, recorded=10, success=False, clearance=-0.004),
    ]
    measures = by_key(closed_loop_measures(driven))
    assert measures["outcome_agreement"].value == pytest.approx(2 / 3)
    assert measures["outcome_agreement"].count == 3
    assert measures["outcome_agreement_near_contact"].value == 0
    assert measures["time_err_median_rpp"].value == pytest.approx(0.1)
    assert measures["time_err_median_dwb"].count == 0


def test_mppi_is_judged_by_the_median_of_its_seeds():
    driven = [run_of(ours=t, recorded=10, controller="MPPI") for t in (9, 10, 30)]
    assert by_key(closed_loop_measures(driven))["time_err_median_mppi"].value == 0


def test_trajectories_and_the_tail_of_the_times():
    driven = [run_of(ours=10, recorded=10, deviation=2e-6, number=number) for number in range(18)]
    driven += [
        run_of(ours=11, recorded=10, deviation=3e-5, number=18),
        run_of(ours=5, recorded=9, success=False, deviation=4e-6),
    ]
    driven += [run_of(ours=10, recorded=10, controller="MPPI", deviation=d) for d in (0.001, 0.002, 0.9)]
    driven += [run_of(ours=10, recorded=10, number=19)]
    measures = by_key(closed_loop_measures(driven))
    assert measures["trajectory_err_max_rpp"].value == 3e-5
    assert measures["trajectory_err_max_rpp"].count == 20
    assert measures["trajectory_err_max_rpp"].missed
    assert measures["trajectory_err_median_mppi"].value == 0.002
    assert not measures["trajectory_err_median_mppi"].missed
    assert measures["time_err_median_rpp"].value == 0.0
    assert measures["time_err_p95_rpp"].value == pytest.approx(0.005)
    assert measures["time_err_p95_rpp"].missed
    assert not measures["trajectory_err_max_dwb"].missed


@pytest.mark.parametrize(
    ("value", "count", "target", "missed"),
    [
        (0.99, 3, ">= 0.99", False),
        (0.98, 3, ">= 0.99", True),
        (1e-6, 3, "< 1e-6", True),
        (1e-6, 3, "<= 1e-6", False),
        (math.nan, 3, "<= 1e-6", True),
        (math.nan, 0, "<= 1e-6", False),
        (0.7, 3, "undefined read", False),
        (0.7, 3, "", False),
    ],
)
def test_a_target_is_missed_by_its_bound(value, count, target, missed):
    assert Measure("one", value, count, target=target).missed is missed


def test_directories_of_another_kind_are_refused(tmp_path, capsys):
    with pytest.raises(MapFormatError, match="no such file"):
        Oracle(tmp_path)
    (tmp_path / "config.json").write_text("[]")
    with pytest.raises(MapFormatError, match="expected a JSON dict"):
        Oracle(tmp_path)
    (tmp_path / "config.json").write_text("{}")
    assert main(["validate", str(tmp_path)]) == 2
    assert "'presets'" in capsys.readouterr().err


@pytest.fixture
def spoilt(tmp_path):
    """A copy of the recorded results that a test may damage."""
    return shutil.copytree(ORACLE, tmp_path / "oracle")


@needs_oracle
@pytest.mark.parametrize(
    ("name", "first"),
    [
        ("maps.npz", [costmap_measures]),
        ("plans_A.npz", [costmap_measures]),
        ("units_B.npz", [rpp_measures]),
        ("mppi_noise.npz", [mppi_measures]),
        ("runs_A.json", []),
    ],
)
def test_missing_and_torn_files_are_one_line(spoilt, name, first, capsys, monkeypatch):
    """Whichever measure opens the file first; those before it are left out."""
    monkeypatch.setattr("evolution.commands.validate.UNIT_MEASURES", first)
    file = spoilt / name
    file.chmod(0o644)
    file.write_bytes(file.read_bytes()[:100])
    assert main(["validate", str(spoilt)]) == 2
    error = capsys.readouterr().err
    assert name in error
    assert error.count("\n") == 1
    spoilt.chmod(0o755)
    file.unlink()
    assert main(["validate", str(spoilt)]) == 2
    assert name in capsys.readouterr().err


@needs_oracle
def test_costmaps_and_plans_are_the_recorded_ones():
    oracle = Oracle(ORACLE)
    (costmaps,) = costmap_measures(oracle)
    potentials, paths = navfn_measures(oracle)
    assert (costmaps.value, costmaps.count) == (1.0, 40 * 150 * 150)
    assert potentials.value < 1e-6
    assert paths.value < 1e-3


@needs_oracle
def test_commands_of_rpp_are_the_recorded_ones():
    oracle = Oracle(ORACLE)
    assert other_measures(oracle) == []
    assert by_key(rpp_measures(oracle))["rpp_cmd_abs_err_max"].value < 1e-6


@needs_oracle
def test_a_changed_costmap_is_noticed(spoilt):
    file = spoilt / "plans_A.npz"
    file.chmod(0o644)
    with np.load(file) as archive:
        arrays = dict(archive)
    arrays["costmap"][3, 70, 70] ^= 1
    np.savez(file, **arrays)
    (measure,) = costmap_measures(Oracle(spoilt))
    assert measure.value == pytest.approx(1 - 1 / measure.count)
    assert measure.worst.startswith("preset A map 3")


@needs_oracle
@pytest.mark.parametrize("index", [0, 20, 41])
def test_whole_runs_end_as_recorded(index):
    records = json.loads((ORACLE / "runs_A.json").read_text())
    chosen = [i for i, one in enumerate(records) if one["controller"] in ("DWB", "RPP")][index]
    driven = drive_again(RunTask(ORACLE, "A", chosen))
    assert driven.success == driven.record["strict_success"]
    if driven.success:
        assert driven.time == pytest.approx(driven.record["time"], abs=1e-9)


@needs_oracle
def test_a_missed_target_is_exit_code_1_and_the_other_single_calls_are_the_recorded_ones(spoilt, capsys):
    file = spoilt / "units_A.npz"
    file.chmod(0o644)
    with np.load(file) as archive:
        arrays = dict(archive)
    arrays["rpp_cmd"][5, 0] += 1e-3
    np.savez(file, **arrays)
    assert main(["validate", str(spoilt), "--units-only", "--format", "json"]) == 1
    output = capsys.readouterr()
    assert "missed: rpp_cmd_abs_err_max is 0.001, expected < 1e-6" in output.err
    document = json.loads(output.out)
    assert [key for key, one in document.items() if key != "disagreements" and one["missed"]] == ["rpp_cmd_abs_err_max"]
    assert document["dwb_choice_agreement"]["value"] == 1.0
    assert document["dwb_score_rel_err_max"]["value"] < 1e-6
    assert document["mppi_cost_rel_err_max"]["value"] < 1e-4
    assert document["mppi_cmd_within_1e-4"]["value"] >= 0.95
    assert document["mppi_cmd_abs_err_max"]["value"] < 0.026


@needs_jazzy_oracle
def test_jazzys_single_calls_are_the_recorded_ones():
    oracle = Oracle(JAZZY_ORACLE)
    assert oracle.release == "jazzy"
    takes = (costmap_measures, navfn_measures, rpp_measures, dwb_measures, other_measures, mppi_measures)
    measures = [measure for take in takes for measure in take(oracle)]
    assert len(measures) == 12
    assert {"graceful_cmd_abs_err_max", "shim_cmd_abs_err_max"} <= by_key(measures).keys()
    assert not [measure for measure in measures if measure.missed]


@needs_jazzy_oracle
@pytest.mark.parametrize(
    ("controller", "variant"),
    [
        ("RPP", "default"),
        ("DWB", "default"),
        ("MPPI", "inflation_055"),
        ("Graceful", "default"),
        ("RotationShim", "default"),
    ],
)
def test_jazzys_whole_runs_are_the_recorded_ones(controller, variant):
    records = json.loads((JAZZY_ORACLE / "runs_A.json").read_text())
    of_kind = [i for i, one in enumerate(records) if (one["controller"], one["variant"]) == (controller, variant)]
    driven = drive_again(RunTask(JAZZY_ORACLE, "A", of_kind[2]))
    assert driven.success == driven.record["strict_success"]
    assert driven.deviation < (0.01 if controller == "MPPI" else 1e-5)
    assert driven.time == pytest.approx(driven.record["time"], abs=1e-9)


@needs_oracle
def test_a_release_that_is_not_built_is_refused(spoilt):
    file = spoilt / "config.json"
    file.chmod(0o644)
    file.write_text(file.read_text().replace('"humble"', '"rolling"'))
    with pytest.raises(MapFormatError, match="expected humble or jazzy or lyrical, got 'rolling'"):
        Oracle(spoilt)


def test_a_run_that_takes_too_long_is_named(monkeypatch):
    def late(task):
        raise TimeoutError

    monkeypatch.setitem(EXECUTORS._entries, "processes", lambda setup: ThreadPoolExecutor(setup.workers))
    monkeypatch.setattr("evolution.validation.closed_loop.drive_again", late)
    recorded = SimpleNamespace(
        directory=Path("recorded"),
        presets=[SimpleNamespace(name="A")],
        runs=lambda preset: [{"controller": "RPP"}],
    )
    with pytest.raises(RunError, match="recorded: expected runs of at most 300 s, got one that takes longer"):
        drive_recorded(recorded, 1)
