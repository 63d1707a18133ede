"""Directories that somebody sent: whatever they name, no command runs code of theirs, and what needs none is shown."""

from __future__ import annotations

import base64
import json
import os
import pickle
import shutil
import zipfile

import pytest

from evolution import load
from evolution.api import compose
from evolution.cli import main
from evolution.driving import Evaluator, RunResult
from evolution.runs import RunDir
from evolution.search import evolve, experiment_of
from evolution.studies import load_results
from gym_mapbench.errors import UntrustedError
from tests.evolution.fake_study import ENGINE
from tests.faults.samples import QUICK

WORLD = {"environment": {"time_limit": 20.0}}
RESULTS = "map,controller,repeat,outcome,time_s,path_length_m,contacts\nmap_1,dwb,0,goal,1.0,1.0,0\n"


class Bait:
    """Leaves a mark where it is unpickled."""

    def __reduce__(self):
        return os.system, ("touch mark",)


def write_model(path):
    """Write a model file that leaves a mark if any of its pickles is read."""
    pickled = {":type:": "x", ":serialized:": base64.b64encode(pickle.dumps(Bait())).decode()}
    data = {"policy_class": {"__module__": "stable_baselines3.common.policies", **pickled}, "clip_range": pickled}
    counters = {"num_timesteps": 1, "_n_updates": 1, "_episode_num": 1}
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("data", json.dumps({**data, **counters}))
        archive.writestr("policy.pth", pickle.dumps(Bait()))


def drive(job):
    """Take no time to reach the goal."""
    return RunResult("goal", 10.0 + len(job.controller.name), 5.0, metrics={"min_clearance": 0.2}, seed=job.seed)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """The directory of a search, whose runs were not driven."""
    path = tmp_path_factory.mktemp("recorded") / "run"
    experiment = experiment_of(compose("thesis", {"search": QUICK, "controllers": ["dwb", "rpp"], "run": WORLD}))
    with Evaluator(drive) as evaluator:
        evolve(experiment, evaluator, RunDir.create(path, experiment))
    return path


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Where the commands run; nothing may leave a mark there."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("gym_mapbench.trust._ran", set())
    (tmp_path / "bait.py").write_text("open('mark', 'w').close()\n")
    (tmp_path / "results.csv").write_text(RESULTS)
    yield tmp_path
    assert not (tmp_path / "mark").exists()


def receive(recorded, folder, change):
    """Copy a run with a changed ``config.json``, and a model that runs code."""
    path = shutil.copytree(recorded, folder / "got")
    config = json.loads((path / "config.json").read_text())
    change(config)
    (path / "config.json").write_text(json.dumps(config))
    write_model(path / "model.zip")
    return path


def name_model(config):
    config["controllers"][1]["kind"] = "got/model.zip"


DRIVING = [
    "report got --gif film.gif",
    "evolve --resume got",
    "bench got",
    "bench got --controllers dwb",
    "bench got --controllers dwb --out b",
    "export got --format gazebo --out out",
]
"""Commands that need the world or the controllers of the run."""

READING = [
    "maps convert got copy.json",
    "export got --format map_server --out out",
    "import-results results.csv --ours got",
]
"""Commands that need neither."""


@pytest.mark.parametrize("command", DRIVING)
def test_what_would_be_driven_is_refused(recorded, folder, capsys, command):
    receive(recorded, folder, name_model)
    assert main(command.split()) == 2
    said = capsys.readouterr().err.strip().splitlines()[-1]
    assert "got/config.json: controllers.kind: 'got/model.zip' would run code" in said
    assert "--allow-code" in said


@pytest.mark.parametrize("command", READING)
def test_what_needs_no_code_is_done(recorded, folder, command):
    receive(recorded, folder, name_model)
    assert main(command.split()) == 0


WORLDS = [
    lambda config: config["run"]["environment"].update(noise="bait:x"),
    lambda config: config["run"]["environment"].update(robot="bait:x"),
    lambda config: config["run"]["navigation"].update(planner={"name": "bait:x"}),
    lambda config: config["controllers"][0].update(kind=" bait:x "),
    name_model,
]


@pytest.mark.parametrize("change", WORLDS)
def test_a_report_shows_all_but_the_replays(recorded, folder, capsys, change):
    receive(recorded, folder, change)
    assert main(["report", "got", "--out", "page.html"]) == 0
    assert "There are no replays: got/config.json: " in capsys.readouterr().err
    page = (folder / "page.html").read_text()
    assert "There are no replays: got/config.json: " in page
    assert "would run code" in page
    assert len(load("got").table("runs")) > 0


@pytest.mark.parametrize("option", [{"fitness": "bait:x"}, {"metric": "bait:x"}, {"families": ["bait:x"]}])
def test_a_search_that_names_code_is_not_even_read(recorded, folder, capsys, option):
    receive(recorded, folder, lambda config: config["search"].update(option))
    with pytest.raises(UntrustedError, match=r"config\.json: search\..* would run code"):
        load("got")
    assert main(["report", "got"]) == 2
    assert "would run code" in capsys.readouterr().err


@pytest.mark.parametrize("command", ["report got", "report got --gif film.gif", "study got --resume"])
def test_a_study_that_names_code_is_refused(study_path, folder, capsys, command):
    path = shutil.copytree(study_path, folder / "got")
    study = json.loads((path / "study.json").read_text())
    study["study"]["experiment"]["controllers"] = ["dwb", "a=got/model.zip"]
    (path / "study.json").write_text(json.dumps(study))
    write_model(path / "model.zip")
    assert main(command.split()) == 2
    assert "would run code" in capsys.readouterr().err


def test_a_run_inside_a_study_that_names_code_is_left_out(study_path, folder):
    path = shutil.copytree(study_path, folder / "got")
    config = path / "runs" / "gini_6" / "seed-0000" / "config.json"
    config.write_text(config.read_text().replace('"kind": ""', '"kind": "bait:x"', 1))
    results = load_results(path, ENGINE)
    assert any("gini_6, seed 0" in line and "would run code" in line for line in results.missing)
    assert len(results.runs) > 2
