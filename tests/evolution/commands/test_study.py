"""``mapbench study`` and ``mapbench report`` with real robots, on small maps."""

from __future__ import annotations

import csv
import re

import pytest
import yaml

from evolution.cli import main
from evolution.commands.study import duration
from evolution.studies import load_study
from evolution.studies.directory import StudyDir

STUDY = {
    "name": "tiny",
    "runs": 2,
    "budget": 4,
    "experiment": {
        "search": {
            "pop_size": 2,
            "maps_per_set": 2,
            "shapes": {
                "size": 60,
                "n_obstacles": [2, 4],
                "circle_radius": [2, 3],
                "square_side": [3, 4],
                "wall_length": [5, 10],
                "task_distance": 6,
                "cleared_distance": 8,
            },
        },
        "controllers": ["dwb", "rpp"],
        "run": {"environment": {"robot": "turtlebot3_burger", "time_limit": 40.0, "collision_ends_episode": False}},
    },
    "configurations": [
        {"name": "ga"},
        {"name": "long", "method": "path_length"},
    ],
    "reevaluation": {"seeds": 2},
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("command")
    (path / "tiny.yaml").write_text(yaml.safe_dump(STUDY))
    StudyDir.create(path / "s", load_study(path / "tiny.yaml"))  # begun, and interrupted at once
    misspelt = {**STUDY, "experiment": {**STUDY["experiment"], "controllers": ["dwp"]}}
    (path / "misspelt.yaml").write_text(yaml.safe_dump(misspelt))
    return path


def run(folder, capsys, command):
    code = main(command.format(folder=folder).split())
    said = capsys.readouterr()
    return code, " ".join(said.out.split()), said.err


@pytest.mark.slow
def test_a_study_from_begin_to_page(folder, capsys):
    code, out, error = run(folder, capsys, "study {folder}/s --resume --workers 1 --runs 1")
    assert code == 0
    assert error == "re-running the best map set of 2 configurations for the replays\n"
    assert "missing: ga: 1 of 2 searches was not begun (seed 1)" in out
    assert "Gini fitness" in out
    assert re.search(r"100 % of the work done, \d+\.\d runs/s, 0 s left", out)
    with (folder / "s" / "tables" / "reevaluation.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 2 * 2 * 2 * 2
    assert {row["controller"] for row in rows} == {"dwb", "rpp"}
    assert all(float(row["spl"]) <= 1.0 for row in rows)
    page = folder / "s" / "report.html"
    assert 100_000 < page.stat().st_size < 5_000_000
    assert len(list((folder / "s" / "figures").glob("*.svg"))) >= 9


@pytest.mark.slow
def test_runs_that_cannot_be_made_do_not_keep_the_others_from_the_page(folder, capsys):
    hopeless = {"search": {"fitness": "cluster"}, "run": {"environment": {"time_limit": 0.5}}}
    configurations = [{"name": "hopeless", "experiment": hopeless}, {"name": "ga"}]
    (folder / "two.yaml").write_text(yaml.safe_dump({**STUDY, "runs": 1, "configurations": configurations}))
    code, out, error = run(folder, capsys, "study {folder}/two.yaml --out {folder}/two --workers 1")
    assert code == 2
    assert "missing: hopeless, seed 0: judging.cluster_scale: cannot be calibrated" in out
    assert "Look at " in out
    assert error.splitlines()[-1] == ("mapbench study: 1 run failed (see missing, above); --resume repeats them")
    assert "hopeless, seed 0: judging.cluster_scale" in (folder / "two" / "report.html").read_text()


@pytest.mark.slow
def test_a_replay_becomes_a_film(folder, capsys):
    command = "report {folder}/s --configuration long --map 2 --controller rpp --gif {folder}/rpp.gif"
    assert run(folder, capsys, command)[0] == 0
    assert (folder / "rpp.gif").read_bytes().startswith(b"GIF8")
    assert "exists already" in run(folder, capsys, command)[2]
    for extra, message in (
        ("--map 3", "--map: expected 1 to 2, got 3"),
        ("--controller mppi", "expected one of dwb, rpp"),
    ):
        assert message in run(folder, capsys, f"report {{folder}}/s --gif {{folder}}/x.gif {extra}")[2]


@pytest.mark.parametrize(
    ("command", "message"),
    [
        ("study thesos", "unknown study 'thesos'; did you mean 'thesis'?"),
        ("study {folder}/tiny.yaml --out {folder}/s", "already holds a study; continue it with --resume"),
        ("study {folder}/tiny.yaml --out {folder}/none --resume", "not a study directory (no study.json)"),
        ("study {folder}/s --resume --out {folder}/t", "out: expected none beside the study directory"),
        ("study quick --out {folder}/s --resume", "name was tiny when the study began, got quick"),
        ("study {folder}/tiny.yaml --only gaa --out {folder}/t", "unknown configuration 'gaa'; did you mean 'ga'?"),
        ("study {folder}/misspelt.yaml --out {folder}/t", "tiny: ga: unknown controller 'dwp'; did you mean 'dwb'?"),
        ("study {folder}/tiny.yaml --runs 0", "expected a whole number of at least 1, got '0'"),
    ],
)
def test_wrong_commands_are_one_line(folder, capsys, command, message):
    try:
        code, _, error = run(folder, capsys, command)
    except SystemExit as exit_:
        code, error = exit_.code, capsys.readouterr().err
    assert code == 2
    assert message in error
    assert error.count("\n") == 1


def test_durations_as_a_reader_wants_them():
    assert [duration(seconds) for seconds in (0.2, 61, 150, 5400)] == ["0 s", "61 s", "2 min", "1 h 30 min"]
