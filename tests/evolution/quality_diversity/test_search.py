"""The search of an atlas without a robot: determinism, continuing, the budget, and the re-evaluation."""

from __future__ import annotations

import json
import sys
from contextlib import suppress

import numpy as np
import pytest

from evolution import load
from evolution.cli import main
from evolution.driving import Evaluator, RunResult, resources
from evolution.quality_diversity import ELITES, Atlas, AtlasSettings, run_atlas, search_atlas
from evolution.quality_diversity.elites import boundary_length
from evolution.search import EvolveSettings, Experiment
from gym_mapbench.errors import ConfigError, RunError
from gym_mapbench.mapio import load_map_set
from tests.evolution import fake_runs

EXPERIMENT = Experiment(
    EvolveSettings(seed=3, shapes=fake_runs.SMALL, maps_per_set=2), fake_runs.CONTROLLERS, fake_runs.WORLD
)
SETTINGS = AtlasSettings(runs=120, cells=7, repeats=2, held_out_seeds=3, batch=4)


def executor_of(workers):
    return fake_runs.IN_PROCESS if workers == 1 else "processes"


def search(settings=SETTINGS, drive=fake_runs.drive, workers=1, on_run=None):
    with Evaluator(drive, workers=workers, executor=executor_of(workers), on_run=on_run) as evaluator:
        return search_atlas(EXPERIMENT, settings, evaluator)


def fill(path, workers=1, on_run=None, resume=False):
    there = resources.Resources(workers=workers, executor=executor_of(workers))
    return run_atlas(EXPERIMENT, SETTINGS, path, resources=there, on_run=on_run, resume=resume)


@pytest.fixture
def no_robot(monkeypatch):
    monkeypatch.setattr("evolution.quality_diversity.running.run_job", fake_runs.drive)
    monkeypatch.setattr("evolution.runs.exclusive.preparation_of", lambda *_: None)


def test_the_search_fills_cells_within_its_runs():
    found = search()
    assert 100 < found.runs <= SETTINGS.runs
    assert found.elites
    assert found.searched.cells == found.held_out.cells + found.dropped + found.displaced
    assert found.held_out.cells == len(found.elites) == len({one.cell for one in found.elites})
    assert found.held_out.coverage == pytest.approx(len(found.elites) / 49)
    assert found.held_out.qd_score == pytest.approx(sum(one.quality for one in found.elites))
    covered = [row["coverage"] for row in found.history]
    assert covered == sorted(covered)


def test_every_elite_is_solved_on_held_out_seeds_and_stands_where_they_say():
    for one in search().elites:
        assert all(len(runs) == SETTINGS.held_out_seeds and all(run.success for run in runs) for runs in one.results)
        dwb, mppi, rpp = np.log([[run.time_s for run in runs] for runs in one.results])
        assert np.exp([(mppi - dwb).mean(), (rpp - dwb).mean()]) == pytest.approx(one.ratios)


def test_workers_change_nothing():
    assert search(workers=2) == search()


def fails_later(job):
    """Reach the goal on the seeds of the search only."""
    return RunResult("goal" if job.repeat < SETTINGS.repeats else "timeout", 10.0 + job.repeat, 5.0, seed=job.seed)


def test_maps_that_fail_on_held_out_seeds_are_dropped():
    found = search(drive=fails_later)
    assert found.searched.cells == found.dropped == 1
    assert found.elites == ()
    assert found.held_out.qd_score == 0.0


def test_an_atlas_without_maps_says_who_failed():
    def fails(job):
        return RunResult("timeout" if job.controller.name == "rpp" else "goal", 10.0, 5.0, seed=job.seed)

    found = search(drive=fails)
    maps = found.history[-1]["maps"]
    assert (found.unsolved, found.failures) == ({"rpp": maps}, {"timeout": maps})
    atlas = Atlas(EXPERIMENT, SETTINGS, found)
    assert (
        f"Maps without a cell because a controller failed: {maps} of {maps}. The first to fail: rpp on {maps}. "
        f"How: timeout on {maps}."
    ) in atlas.sentences()
    too_few = "none: best set: expected at least 2 maps, got 0"
    assert {row["maps"] for row in atlas.table("sets") if row["fitness"] != "roles"} == {too_few}


def moves(job):
    """Each MPPI run of the held-out seeds takes twice the time."""
    slow = job.controller.name == "mppi" and job.repeat >= SETTINGS.repeats
    return RunResult("goal", 20.0 if slow else 10.0, 5.0, seed=job.seed)


def test_maps_move_to_the_cell_of_the_held_out_seeds():
    (one,) = search(drive=moves).elites
    assert one.found_in == (3, 3)
    assert one.cell == (5, 3)  # log 2 is 1.75 cells of log(16) / 7 beside the centre
    assert one.ratios == pytest.approx((2.0, 1.0))
    assert one.moved


def same_time(job):
    """Every controller takes ten seconds on every map."""
    return RunResult("goal", 10.0, 5.0, seed=job.seed)


def test_the_simplest_map_stays():
    """All maps are in one cell: of all evaluated maps the one with the shortest boundary is the elite."""
    seen = {}
    found = search(drive=same_time, on_run=lambda job, *_: seen.setdefault(job.scenario.world_digest, job.scenario.map))
    (one,) = found.elites
    assert len(seen) > 10
    assert boundary_length(one.scenario.map) == min(map(boundary_length, seen.values()))


def maps_of(drive, fresh):
    """Return the maps of a search with one seed, in order."""
    seen = {}
    settings = SETTINGS.replace(fresh=fresh, repeats=1, runs=60)
    search(settings, drive, on_run=lambda job, *_: seen.setdefault(job.scenario.world_digest))
    return list(seen)


def test_random_drawing_has_no_parents():
    """With fresh=1 no map depends on what was found."""
    assert maps_of(fake_runs.drive, 1.0)[:15] == maps_of(same_time, 1.0)[:15]
    assert maps_of(fake_runs.drive, 0.0)[:15] != maps_of(same_time, 0.0)[:15]


def test_a_killed_atlas_continues_with_the_same_bytes(no_robot, tmp_path):
    fill(tmp_path / "whole", workers=2)
    count = iter(range(1000))

    def interrupt(*_):
        if next(count) == 50:
            raise KeyboardInterrupt

    with suppress(KeyboardInterrupt):
        fill(tmp_path / "cut", on_run=interrupt)
    fill(tmp_path / "cut", resume=True)
    files = {path.name for path in (tmp_path / "whole").iterdir()} - {"results.sqlite"}
    assert {"maps.json", "summary.json", ELITES, "set_gini.json"} <= files
    for name in files:
        assert (tmp_path / "cut" / name).read_bytes() == (tmp_path / "whole" / name).read_bytes()


def test_a_loaded_atlas_equals_the_written_one(no_robot, tmp_path):
    atlas = fill(tmp_path / "a")
    again = load(tmp_path / "a")
    assert all(list(again.table(name)) == list(atlas.table(name)) for name in atlas.tables)
    assert again.sentences() == atlas.sentences()
    assert [one.name for one in load_map_set(tmp_path / "a" / "maps.json")] == [row["map"] for row in again.table()]
    assert again.best_set("gini") == load_map_set(tmp_path / "a" / "set_gini.json")


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("searched", {"cells": 1, "coverage": "x", "qd_score": 1.0}, "summary.json: searched.coverage: should be"),
        ("history", None, "summary.json: history: should be"),
    ],
)
def test_a_damaged_summary_is_refused_in_one_line(no_robot, tmp_path, key, value, message):
    fill(tmp_path / "a")
    path = tmp_path / "a" / "summary.json"
    document = json.loads(path.read_text())
    path.write_text(json.dumps({**document, key: value}))
    with pytest.raises(RunError, match=message):
        load(tmp_path / "a")
    document["elites"][0]["results"][0][0]["time_s"] = [1.0]
    path.write_text(json.dumps(document))
    with pytest.raises(RunError, match=r"summary.json: elites.0.results.0.0.time_s: should be a valid number"):
        load(tmp_path / "a")


def test_damaged_maps_are_named(no_robot, tmp_path):
    fill(tmp_path / "a")
    (tmp_path / "a" / "maps.json").write_text("")
    with pytest.raises(RunError, match=r"maps.json: not a JSON file .*; --resume makes it again from the stored runs"):
        load(tmp_path / "a")


@pytest.mark.parametrize(("name", "key"), [("maps.json", "maps"), ("summary.json", "elites")])
def test_maps_and_runs_of_two_atlases_are_not_mixed(no_robot, tmp_path, name, key):
    fill(tmp_path / "a")
    path = tmp_path / "a" / name
    document = json.loads(path.read_text())
    path.write_text(json.dumps({**document, key: document[key][::-1]}))
    with pytest.raises(RunError, match=r"summary.json: expected the runs on the maps in maps.json"):
        load(tmp_path / "a")


def test_other_options_do_not_continue_it(no_robot, tmp_path):
    fill(tmp_path / "a")
    with pytest.raises(ConfigError, match="runs was 120 when the map-atlas began, got 90"):
        run_atlas(EXPERIMENT, SETTINGS.replace(runs=90), tmp_path / "a", resume=True)


def test_without_pyribs_one_line_says_what_to_install(monkeypatch, tmp_path, capsys):
    monkeypatch.setitem(sys.modules, "ribs.archives", None)
    assert main(["atlas", "--runs", "30", "--out", str(tmp_path / "a")]) == 2
    assert "an atlas needs pyribs (pip install 'gym-mapbench[qd]')" in capsys.readouterr().err
    assert not (tmp_path / "a").exists()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--runs", "3"], "runs: expected at least 9, which one map needs, got 3"),
        (["--pairs", "mppi"], "pairs: expected two controllers as A/B, got 'mppi'"),
        (["--pairs", "mpi/dwb"], "did you mean 'mppi'"),
        (["--pairs", "mppi/mppi"], "pairs: expected two controllers as A/B"),
        (["--pairs", "mppi/dwb,dwb/mppi"], "pairs: expected different pairs"),
        (["--pairs", "mppi/dwb,rpp/dwb,rpp/mppi"], "pairs: expected one or two"),
        (["--controllers", "rpp"], "expected two or more to compare, got rpp alone"),
        (["--cells", "2"], "cells: expected"),
        (["--largest-ratio", "0.5"], "largest_ratio: expected"),
    ],
)
def test_bad_options_are_refused_before_the_first_run(tmp_path, capsys, options, message):
    assert main(["atlas", "--out", str(tmp_path / "a"), *options]) == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "a").exists()
