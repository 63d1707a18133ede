"""Directories of results: every kind is recognised by its file, and a directory of another kind is named."""

from __future__ import annotations

import pytest

from evolution import load
from evolution.cli import main
from evolution.results import KINDS, kind_of, recognise, run_with_maps
from evolution.runs import RUN
from gym_mapbench.errors import ConfigError, RunError
from gym_mapbench.mapio.gazebo_package import RUNNER

NAMES = ("run", "study", "sweep", "training", "tuning", "minimization", "map-atlas", "benchmark")


def test_every_kind_begins_is_recognised_and_continues(tmp_path):
    assert tuple(kind.directory.what for kind in KINDS) == NAMES
    for kind in KINDS:
        path = tmp_path / kind.directory.what
        assert recognise(path) is None
        config = kind.directory.begin_or_resume(path, {"options": {"seed": 3}}, resume=False)
        assert kind_of(path) is kind
        assert kind.directory.open(path) == config
        assert kind.directory.begin_or_resume(path, {"options": {"seed": 3}}, resume=True) == config
        with pytest.raises(ConfigError, match=r"options\.seed was 3 when the"):
            kind.directory.begin_or_resume(path, {"options": {"seed": 4}}, resume=True)


def test_a_damaged_or_later_mark_is_refused_with_what_to_do(tmp_path):
    for kind in KINDS:
        path = tmp_path / kind.directory.what
        kind.directory.begin(path, {})
        mark = path / kind.directory.mark
        mark.write_text(mark.read_text().replace('"format_version": 1', '"format_version": 2'))
        with pytest.raises(RunError, match=r"got .* 2; read it with the version of MapBench that wrote it"):
            kind.directory.open(path)
        mark.write_text("")
        with pytest.raises(RunError, match=f"not a JSON file .*; restore it from a copy, or begin the {path.name}"):
            kind.directory.open(path)


def test_a_path_that_holds_no_results_is_refused(tmp_path):
    with pytest.raises(
        RunError, match=r"expected the directory of a run \(config.json\), .* or benchmark \(benchmark.j"
    ):
        load(tmp_path)


@pytest.mark.parametrize("name", ["tasks.json", "benchmark.json"])
def test_a_ros_2_package_is_no_benchmark(tmp_path, name, capsys):
    for file in (RUNNER, name):
        (tmp_path / file).write_text("{}")
    assert main(["report", str(tmp_path)]) == 2
    assert "expected a directory of results, got a ROS 2 package for Gazebo" in capsys.readouterr().err
    assert run_with_maps(tmp_path) is None


@pytest.mark.parametrize("name", NAMES[1:])
def test_only_a_run_has_maps(tmp_path, name, capsys):
    (kind,) = [kind.directory for kind in KINDS if kind.directory.what == name]
    kind.begin(tmp_path / "results", {})
    assert main(["bench", str(tmp_path / "results")]) == 2
    assert f"expected maps or the directory of a run, got the directory of a {name}" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("name", "where"),
    [
        ("sweep", "effects.csv"),
        ("training", "curve.csv"),
        ("minimization", "report.html"),
        ("map-atlas", "report.html"),
        ("benchmark", "--resume --html FILE"),
    ],
)
def test_results_without_a_page_say_where_they_are_shown(tmp_path, name, where, capsys):
    (kind,) = [kind.directory for kind in KINDS if kind.directory.what == name]
    kind.begin(tmp_path / "results", {})
    assert main(["report", str(tmp_path / "results")]) == 2
    error = capsys.readouterr().err
    assert "expected a run, a study or a tuning" in error
    assert where in error


def test_a_run_is_told_from_a_study(study_path):
    assert kind_of(study_path).directory.what == "study"
    assert kind_of(study_path / "runs" / "gini_6" / "seed-0000").directory == RUN
