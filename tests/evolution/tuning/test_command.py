"""``mapbench tune`` and ``evolution.tune``: from files to a page, and every mistake in one line."""

from __future__ import annotations

import re
import shutil
from dataclasses import replace
from pathlib import Path

import pytest
import yaml

import evolution
from evolution.cli import main
from evolution.report import write_report
from evolution.report.tuning_page import report_of_tuning
from evolution.tuning import load_tuning, sampling
from gym_mapbench.errors import ConfigError, RunError
from gym_mapbench.mapio import save_map_set
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.scenario import MapSet, Pose, Scenario
from tests.evolution.fake_runs import IN_PROCESS
from tests.evolution.tuning import fakes

pytestmark = pytest.mark.usefixtures("fake_tuning")
SMALL = ["--robot-radius", "0.07", "--executor", IN_PROCESS, "--workers", "1"]
FILE = "examples/nav2_params.yaml"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Maps and a search space."""
    folder = tmp_path_factory.mktemp("maps")
    save_map_set(MapSet(fakes.maps(8, 1)), folder / "train.json")
    save_map_set(MapSet(fakes.maps(6, 2)), folder / "test.json")
    (folder / "space.yaml").write_text(yaml.safe_dump(fakes.SPACE.model_dump(mode="json", exclude_none=True)))
    return folder


def arguments(folder, *more, controller="rpp", train="train.json", test="test.json"):
    maps = ["--train", str(folder / train), "--test", str(folder / test)]
    return ["tune", controller, *maps, "--trials", "8", *SMALL, *more]


@pytest.fixture(scope="module")
def done(folder, fake_tuning):
    space = ["--space", str(folder / "space.yaml")]
    assert main(arguments(folder, *space, "--out", str(folder / "done"))) == 0
    return folder / "done"


def test_the_page_has_verdict_replays_tables_and_the_file(done):
    page = (done / "report.html").read_text()
    for part in ("Tuning of rpp", "test maps that the search has not seen", "Changed parameters", "History"):
        assert part in page
    assert 'download="nav2_params.yaml"' in page
    assert '"controllers":["own","tuned"]' in page
    assert page == write_report(done).read_text()


def test_the_page_refuses_test_maps_of_another_tuning(folder, done, tmp_path):
    shutil.copytree(done, tmp_path / "mixed")
    save_map_set(MapSet(fakes.maps(6, 9)), tmp_path / "mixed" / "test.json")
    with pytest.raises(RunError, match=r"test.json: expected the test maps of tuning.json, got others; --resume"):
        write_report(tmp_path / "mixed")


def test_a_map_without_a_way_to_the_goal_is_refused_before_anything_is_written(folder, tmp_path, capsys):
    split = Scenario(GridMap.from_rows(["." * 20 + "#" + "." * 20] * 20, 0.1), Pose(1.0, 1.0), Pose(3.0, 1.0), "split")
    save_map_set(MapSet((split,)), tmp_path / "split.json")
    out = tmp_path / "out"
    assert main(arguments(folder, "--out", str(out), train=str(tmp_path / "split.json"))) == 2
    assert "split: expected a map with a way to the goal" in capsys.readouterr().err
    assert not out.exists()


def test_test_maps_that_could_not_be_read_are_refused_before_anything_is_written(folder, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("gym_mapbench.mapio.map_set_file.MAX_JSON_BYTES", 700)
    out = tmp_path / "out"
    assert main(arguments(folder, "--out", str(out))) == 2
    assert "expected fewer cells: the map-set file would have" in capsys.readouterr().err
    assert not out.exists()


def test_own_values_alone_are_not_said_to_be_compared(done):
    report = report_of_tuning(load_tuning(done))
    (compared,) = [one.paragraphs for one in report.sections if one.title == "Test"]
    assert compared[0].startswith("The own values and the tuned values run on the same test maps")
    assert {one.sample for one in report.maps} == {"One of the test maps with the largest difference."}
    tuning = load_tuning(done)
    report = report_of_tuning(replace(tuning, summary=tuning.summary.model_copy(update={"changes": []})))
    (alone,) = [one.paragraphs for one in report.sections if one.title == "Test"]
    assert alone[0].startswith("Only the own values run on the test maps, as no trial is better. The search has used")
    assert {one.sample for one in report.maps} == {""}


def test_it_prints_the_changes_and_the_verdict(folder, done, capsys):
    space = ["--space", str(folder / "space.yaml"), "--resume"]
    assert main(arguments(folder, *space, "--out", str(done))) == 0
    printed = capsys.readouterr().out
    assert "lookahead_dist" in printed
    assert "The own values reach the goal in" in printed
    assert f"look at {done / 'report.html'}" in printed.replace("\n", " ")


@pytest.mark.parametrize("section", ["/**", "/robot_1/controller_server", "/robot_1/**"])
def test_a_controller_of_a_wildcard_or_a_namespace_is_tuned_where_it_stands(folder, tmp_path, section):
    own = tmp_path / "mine.yaml"
    own.write_text(Path(FILE).read_text().replace("\ncontroller_server:", f"\n{section}:"))
    (tmp_path / "ahead.yaml").write_text("parameters: {lookahead_dist: {low: 0.2, high: 1.2}}")
    out = ["--params", str(own), "--out", str(tmp_path / "out")]
    assert main(arguments(folder, *out, "--space", str(tmp_path / "ahead.yaml"), controller="Pursuit")) == 0
    tuned = (tmp_path / "out/nav2_params.yaml").read_text()
    assert f"\n{section}:" in tuned
    assert re.sub(r"lookahead_dist: [\d.]+", "lookahead_dist: 0.5", tuned) == own.read_text()


def test_a_users_file_keeps_its_comments(folder, tmp_path):
    own = tmp_path / "mine.yaml"
    own.write_text(Path(FILE).read_text().replace("lookahead_dist: 0.5", "lookahead_dist: 0.5  # mine"))
    out = ["--params", str(own), "--out", str(tmp_path / "out")]
    assert main(arguments(folder, *out, "--space", str(folder / "ahead.yaml"), controller="Pursuit")) == 2
    (folder / "ahead.yaml").write_text("parameters: {lookahead_dist: {low: 0.2, high: 1.2}}")
    assert main(arguments(folder, *out, "--space", str(folder / "ahead.yaml"), controller="Pursuit")) == 0
    tuned = (tmp_path / "out/nav2_params.yaml").read_text()
    assert re.sub(r"lookahead_dist: [\d.]+  # mine", "lookahead_dist: 0.5  # mine", tuned) == own.read_text()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"test": "train.json"}, "--test: expected maps that are not among the training maps, but map_1_0 is the"),
        ({"controller": "rp"}, "unknown controller 'rp'; did you mean 'rpp'?"),
        ({"controller": "dwb", "params": FILE, "only": "Pursuit"}, "unknown controller 'dwb'"),
        ({"controller": "mppi", "params": FILE}, "expected a file that configures the controller mppi, got"),
        ({"require": "clearance>0.1"}, "requirement: expected a condition like clearance>=0.1, got 'clearance>0.1'"),
        ({"space": "none.yaml"}, "none.yaml"),
    ],
)
def test_mistakes_are_refused_in_one_line(folder, tmp_path, capsys, change, message):
    places = {key: change.pop(key) for key in ("test", "controller") if key in change}
    more = [part for name, value in change.items() for part in (f"--{name}", value)]
    assert main(arguments(folder, *more, "--out", str(tmp_path / "out"), **places)) == 2
    said = capsys.readouterr().err
    assert message in said
    assert "Traceback" not in said
    assert not (tmp_path / "out").exists()


def test_without_the_extra_one_line_says_what_to_install(folder, tmp_path, capsys, monkeypatch):
    def missing(name):
        raise ImportError(name)

    monkeypatch.setattr(sampling.importlib, "import_module", missing)
    assert main(arguments(folder, "--out", str(tmp_path / "out"))) == 2
    assert "tuning needs optuna (pip install 'gym-mapbench[tune]')" in capsys.readouterr().err


def test_from_python(folder, tmp_path):
    result = evolution.tune(
        "rpp",
        fakes.maps(6, 1),
        str(folder / "test.json"),
        out=tmp_path / "out",
        params="thesis",
        space=folder / "space.yaml",
        trials=4,
        robot=fakes.WORLD.robot,
        executor=IN_PROCESS,
        workers=1,
    )
    assert len(result.to_pandas("trials")) == 4
    assert result.config["tuning"]["world"]["environment"]["noise"]["scan"] > 0
    with pytest.raises(ConfigError, match="trails"):
        evolution.tune("rpp", [], [], out=tmp_path / "other", trails=4)
