"""Directories that somebody sent: whatever they name, no command runs code of theirs, and what needs none is shown."""

from __future__ import annotations

import base64
import json
import os
import pickle
import shutil
import zipfile

import pytest

from evolution import load, study
from evolution.api import compose
from evolution.cli import main
from evolution.driving import Evaluator, Resources, RunResult
from evolution.report import write_report
from evolution.runs import RunDir
from evolution.search import evolve, experiment_of
from evolution.studies import StudySettings, load_results, run_study
from gym_mapbench.errors import UntrustedError
from tests.evolution.fake_runs import IN_PROCESS
from tests.evolution.fake_study import part_of
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
    with Evaluator(drive, executor=IN_PROCESS) as evaluator:
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
def test_a_report_shows_all_but_the_replays(recorded, folder, blank_figures, capsys, change):
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


@pytest.fixture(scope="module")
def real_study(tmp_path_factory):
    """The directory of a study with the package's worlds and controllers, whose runs were not driven."""
    settings = StudySettings.from_mapping(STUDY, "study")
    path = tmp_path_factory.mktemp("real") / "study"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("evolution.studies.running.run_study_job", drive)
        patch.setattr("evolution.runs.exclusive.preparation_of", lambda _: None)
        run_study(settings, path, resources=Resources(executor=IN_PROCESS))
    return path


STUDY = {
    "name": "received",
    "runs": 1,
    "budget": 6,
    "experiment": {"search": {"pop_size": 6}, "controllers": ["dwb", "rpp"], "run": WORLD},
    "configurations": [{"name": "gini"}, {"name": "random", "method": "random"}],
    "reevaluation": {"seeds": 2},
}


def receive_study(real_study, folder, change):
    """Copy a study with changed options, in its own file and in those of its runs, and a model that runs code."""
    path = shutil.copytree(real_study, folder / "got")
    change_json(path / "study.json", lambda study: change(study["study"]["experiment"]))
    for config in path.glob("runs/*/*/config.json"):
        change_json(config, change)
    write_model(path / "model.zip")
    return path


def change_json(path, change):
    document = json.loads(path.read_text())
    change(document)
    path.write_text(json.dumps(document))


def use_model(document):
    named = isinstance(document["controllers"][1], dict)
    document["controllers"][1] = (
        {"name": "rpp", "kind": "got/model.zip", "params": {}} if named else "rpp=got/model.zip"
    )


IN_STUDIES = [
    use_model,
    lambda document: document["run"]["environment"].update(noise="bait:x"),
    lambda document: document["run"].update(navigation={"planner": {"name": "bait:x"}}),
]


@pytest.mark.parametrize("change", IN_STUDIES)
def test_a_report_of_a_study_shows_all_but_the_replays(real_study, folder, blank_figures, capsys, change):
    receive_study(real_study, folder, change)
    assert main(["report", "got", "--out", "page.html"]) == 0
    said = [line for line in capsys.readouterr().err.splitlines() if "no replays" in line]
    assert len(said) == 1
    assert "There are no replays of gini, random: got/runs/gini/seed-0000/config.json: " in said[0]
    assert "would run code" in said[0]
    assert "--allow-code" in said[0]
    page = (folder / "page.html").read_text()
    for shown in (
        "There are no replays of gini, random",
        "Held-out minus reported fitness",
        "Best set of gini",
        "Lorenz curves",
    ):
        assert shown in page
    assert len(load("got").runs) == 2


@pytest.mark.parametrize("change", IN_STUDIES)
@pytest.mark.parametrize("command", ["report got --gif film.gif", "study got --resume"])
def test_a_study_that_names_code_is_not_driven(real_study, folder, capsys, command, change):
    receive_study(real_study, folder, change)
    assert main(command.split()) == 2
    assert "would run code" in capsys.readouterr().err


@pytest.mark.parametrize("resume", [study, lambda path, resume: run_study(load(path).settings, path, resume=resume)])
@pytest.mark.parametrize("change", IN_STUDIES)
def test_a_study_that_names_code_is_not_driven_from_python(real_study, folder, change, resume):
    receive_study(real_study, folder, change)
    with pytest.raises(UntrustedError, match="would run code"):
        resume("got", resume=True)


@pytest.mark.parametrize("option", [{"fitness": "bait:x"}, {"metric": "bait:x"}, {"families": ["bait:x"]}])
def test_a_study_whose_search_names_code_is_not_even_read(real_study, folder, capsys, option):
    receive_study(real_study, folder, lambda document: document["search"].update(option))
    with pytest.raises(UntrustedError, match=r"study\.json: study\.experiment\.search\..* would run code"):
        load("got")
    assert main(["report", "got"]) == 2
    assert "would run code" in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.usefixtures("fake_driving")
def test_a_run_inside_a_study_that_names_code_is_shown_without_replays(study_path, folder):
    path = part_of(study_path, folder / "got", ["gini_6"])
    config = path / "runs" / "gini_6" / "seed-0000" / "config.json"
    config.write_text(config.read_text().replace('"kind": ""', '"kind": "bait:x"', 1))
    page = write_report(path, folder / "page.html").read_text()
    seeds = [run.seed for run in load_results(path).runs if run.configuration.name == "gini_6"]
    assert seeds == [0, 1]
    assert "There are no replays of gini_6: " in page or "gini_6 (seed 1" in page  # the better of the two is shown
