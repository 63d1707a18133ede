"""Sweeps: worlds compared map by map, continued after an interruption, refused in one line."""

from __future__ import annotations

import shutil
from dataclasses import replace

import numpy as np
import pytest

from evolution.cli import main
from evolution.studies import SweepSettings, load_definition, load_sweep, run_sweep
from evolution.studies.sweep.effects import effect_rows
from gym_mapbench.errors import ConfigError, RunError
from gym_mapbench.world.noise import NOISES, NoiseSettings
from tests.evolution import fake_runs


@pytest.fixture(scope="module", autouse=True)
def noisy_runs():
    """Runs without a robot."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("evolution.studies.sweep.running.run_job", fake_runs.noisy)
        patch.setattr("evolution.runs.exclusive.preparation_of", lambda _: None)
        yield


SMALL = {
    "name": "small",
    "maps": 6,
    "controllers": ["rpp", {"name": "far", "kind": "rpp"}],
    "worlds": {"none": {"environment": {"noise": "none"}}, "nominal": {"environment": {"noise": "nominal"}}},
}


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    return run_sweep(SweepSettings(**SMALL), tmp_path_factory.mktemp("sweep") / "small")


def row(world, name, outcome, time=10.0, recoveries=0.0):
    return {
        "world": world,
        "controller": "rpp",
        "map": name,
        "repeat": 0,
        "outcome": outcome,
        "time_s": time,
        "n_recoveries": recoveries,
    }


def test_the_file_of_a_finished_sweep_describes_it(done):
    assert load_definition(done.path / "sweep.json") == SweepSettings(**SMALL)


def test_effects_by_hand():
    rows = [row("none", "a", "goal"), row("none", "b", "goal"), row("none", "c", "timeout"), row("none", "d", "goal")]
    rows += [row("noisy", "a", "goal", 12.0, 1.0), row("noisy", "b", "timeout"), row("noisy", "c", "goal")]
    rows += [row("noisy", "d", "goal", 15.0, 3.0)]
    _, noisy = effect_rows(rows, ["none", "noisy"], ["rpp"])
    assert (noisy["n"], noisy["success"], noisy["gained"], noisy["changed"]) == (4, 0.75, 0.0, 0.5)
    assert (noisy["solved_in_both"], noisy["time_ratio"], noisy["recoveries"]) == (2, 1.35, 1.0)
    assert noisy["success_low"] == pytest.approx(0.3006, abs=1e-4)  # Wilson's formula, by hand
    assert noisy["gained_low"] < -0.3 < 0.3 < noisy["gained_high"]  # four maps tell little


def test_repeats_on_a_map_count_once_in_the_intervals_of_effects():
    """The noise fails one of eight maps; twenty runs on each map tell no more about other maps than a few runs."""

    def intervals(repeats):
        outcomes = {"none": "goal", "noisy": "timeout"}
        rows = [
            {**row(world, str(name), outcomes[world] if name == 0 else "goal"), "repeat": repeat}
            for world in outcomes
            for name in range(8)
            for repeat in range(repeats)
        ]
        return effect_rows(rows, list(outcomes), ["rpp"])[1]

    few, many = intervals(2), intervals(20)
    for end in ("success_low", "success_high", "gained_low", "gained_high"):
        assert many[end] == pytest.approx(few[end], abs=0.02)


def test_copies_of_a_run_count_once_where_runs_are_the_units():
    """Without noise, ten repeats on each of three maps are three runs."""
    rows = [{**row("none", name, "goal"), "repeat": repeat} for name in "abc" for repeat in range(10)]
    (found,) = effect_rows(rows, ["none"], ["rpp"])
    assert (found["n"], found["success"]) == (30, 1.0)
    assert found["success_low"] == pytest.approx(0.4385, abs=1e-4)  # Wilson's formula with 3 of 3, by hand
    assert (found["gained_low"], found["gained_high"]) == (0.0, 0.0)  # a world differs from itself by nothing


def test_the_first_world_is_compared_with_itself(done):
    first = [row for row in done.table() if row["world"] == "none"]
    assert [row["gained"] for row in first] == [0.0, 0.0]
    assert [row["time_ratio"] for row in first] == [1.0, 1.0]
    assert len(done.table("runs")) == 6 * 2 * 2


def test_maps_and_seeds_are_the_same_in_all_worlds(done):
    seeds = {
        world: [(row["map"], row["controller"], row["seed"]) for row in done.runs if row["world"] == world]
        for world in ("none", "nominal")
    }
    assert seeds["none"] == seeds["nominal"]
    fewer = SweepSettings(**{**SMALL, "maps": 2}).scenarios()
    assert [one.digest for one in fewer] == [one.digest for one in SweepSettings(**SMALL).scenarios()[:2]]


def test_files_are_the_same_after_an_interruption(done, tmp_path):
    settings = SweepSettings(**SMALL)
    run_sweep(settings, tmp_path / "s", maps=3)
    run_sweep(settings, tmp_path / "s", resume=True)
    for name in ("sweep.json", "runs.csv", "effects.csv", "figures/effects.svg"):
        assert (tmp_path / "s" / name).read_bytes() == (done.path / name).read_bytes()
    again = load_sweep(tmp_path / "s")
    np.testing.assert_equal(list(again.table()), list(done.table()))


def test_part_of_a_sweep_keeps_the_other_runs_in_its_tables(done, tmp_path):
    shutil.copytree(done.path, tmp_path / "s")
    part = run_sweep(SweepSettings(**SMALL), tmp_path / "s", resume=True, only=["none"], maps=2)
    assert part.runs == done.runs
    assert (tmp_path / "s" / "effects.csv").read_bytes() == (done.path / "effects.csv").read_bytes()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"worlds": {"none": {}}}, "expected two worlds or more"),
        ({"worlds": {"a": {}, "b": {"environment": {"noise": "loud"}}}}, "small: b: .*noise"),
        ({"worlds": {"a": {}, "b": {"environment": {"robot": {"radius": 3.0}}}}}, "small: b: .*room"),
        ({"controllers": ["mpi"]}, "did you mean 'mppi'"),
        ({"maps": 0}, "maps"),
    ],
)
def test_bad_sweeps_are_one_line(changes, message, tmp_path):
    with pytest.raises(ConfigError, match=message) as caught:
        run_sweep(SweepSettings.from_mapping({**SMALL, **changes}, "file"), tmp_path / "s")
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "s").exists()


def test_other_sweeps_and_damage_are_refused(done, tmp_path):
    copy = tmp_path / "copy"
    shutil.copytree(done.path, copy)
    with pytest.raises(ConfigError, match="seed was 0 when the sweep began, got 1"):
        run_sweep(SweepSettings(**{**SMALL, "seed": 1}), copy, resume=True)
    with pytest.raises(ConfigError, match="already holds a sweep"):
        run_sweep(SweepSettings(**SMALL), copy)
    (copy / "runs.csv").unlink()
    with pytest.raises(RunError, match="nothing was finished"):
        load_sweep(copy)


def test_the_command_finds_sweeps_like_studies(done, capsys, monkeypatch):
    assert isinstance(load_definition("noise"), SweepSettings)
    monkeypatch.setattr("evolution.api.searches.run_sweep", lambda settings, path, **options: done)
    assert main(["study", str(done.path), "--resume"]) == 0
    assert "nominal" in capsys.readouterr().out


def test_a_sweep_of_errors_alone_has_not_succeeded(done, capsys, monkeypatch):
    """It would say that no robot reaches a goal; three maps are said to be few."""
    rows = tuple({**one, "outcome": "error", "reason": "no answer"} for one in done.runs if one["map"] < "random_003")
    failed = replace(done, runs=rows)
    monkeypatch.setattr("evolution.api.searches.run_sweep", lambda settings, path, **options: failed)
    assert main(["study", str(done.path), "--resume"]) == 2
    said = capsys.readouterr()
    assert "about these maps only" in said.out
    assert "nan" not in said.out
    assert "every run ended in an error, the first because: no answer" in said.err


def test_the_components_of_noise_are_those_of_the_nominal_level():
    worlds = load_definition("noise").worlds
    components = [document["environment"]["noise"] for name, document in worlds.items() if name not in NOISES]
    together = {key: value for component in components for key, value in component.items()}
    assert len(together) == sum(map(len, components))
    assert NoiseSettings(**together) == NOISES["nominal"]
