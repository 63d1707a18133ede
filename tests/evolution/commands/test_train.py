"""``mapbench train`` as a user meets it."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import gymnasium
import pytest

import gym_mapbench  # noqa: F401, registers the env
from evolution import train
from evolution.cli import main
from gym_mapbench.errors import ConfigError
from tests.evolution.commands.test_cli import OFFICE, refused
from tests.evolution.training.test_learning import small

pytest.importorskip("stable_baselines3")

EARLIER_RUN = Path(__file__).parents[1] / "earlier_run"


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    """A directory of a short training."""
    folder = tmp_path_factory.mktemp("training")
    (folder / "small.yaml").write_text(json.dumps(small()))
    assert main(["train", "--config", str(folder / "small.yaml"), "--seed", "3", "--out", str(folder / "run")]) == 0
    return folder / "run"


def test_it_says_how_well_the_model_drives_and_where_it_is(tmp_path, capsys):
    (tmp_path / "small.yaml").write_text(json.dumps(small(steps=80)))
    assert (
        main(["train", "--algo", "ppo", "--config", str(tmp_path / "small.yaml"), "--out", str(tmp_path / "run")]) == 0
    )
    output = capsys.readouterr().out
    assert "Success on held-out maps, ppo" in output
    assert "random_2" in output
    assert "best_model.zip" in output


def test_that_no_map_is_held_out_is_said(tmp_path, capsys, caplog):
    (tmp_path / "small.yaml").write_text(json.dumps(small(steps=80)))
    argv = ["train", "--config", str(tmp_path / "small.yaml"), "--maps", OFFICE, "--out", str(tmp_path / "run")]
    assert main(argv) == 0
    assert "maps: fewer than 5, so none is held out: success is that on the training maps" in caplog.text
    assert "Success on held-out maps, ppo (maps: not held out)" in capsys.readouterr().out


@pytest.mark.slow
def test_the_model_drives_beside_others_and_what_differs_is_said(trained, capsys):
    argv = ["bench", OFFICE, "--controllers", f"learned={trained / 'best_model.zip'}", "--time-limit", "1"]
    assert main([*argv, "--noise", "nominal", "--workers", "1", "--format", "json"]) == 0
    output = capsys.readouterr()
    assert json.loads(output.out)
    assert "learned: sees with its own 8 beams to 3.5 m instead of 360 to 3.5 m" in output.err
    assert "learned: trained with other noise" in output.err


@pytest.mark.slow
def test_what_is_assumed_of_a_model_without_a_card_is_said(tmp_path, capsys):
    from stable_baselines3 import PPO

    env = gymnasium.make("MapBench-v0", observation=["goal", "people"], people={"nearest": 2})
    PPO("MultiInputPolicy", env, n_steps=8, batch_size=8, device="cpu").save(tmp_path / "bare.zip")
    argv = ["bench", OFFICE, "--controllers", f"bare={tmp_path / 'bare.zip'}", "--time-limit", "1", "--workers", "1"]
    assert main(argv) == 0
    assert "bare: has no card, so it decides at the world's control_hz and sees with" in capsys.readouterr().err


def test_a_finished_training_is_continued_to_itself(trained, capsys):
    before = (trained / "curve.csv").read_text()
    assert main(["train", "--resume", str(trained)]) == 0
    assert (trained / "curve.csv").read_text() == before


@pytest.mark.parametrize(
    ("argv", "expected"),
    [
        (["train", "--steps", "0"], "--steps: expected a whole number of at least 1, got '0'"),
        (["train", "--steps", "-5"], "--steps: expected a whole number of at least 1, got '-5'"),
        (["train", "--algo", "pop"], "unknown algorithm 'pop'; did you mean 'ppo'?"),
        (["train", "--maps", "nowhere.yaml"], "nowhere.yaml"),
        (["train", "--curriculum", "nowhere.yaml"], "nowhere.yaml"),
        (["train", "--config", "nowhere.yaml"], "nowhere.yaml: cannot be read"),
        (["train", "--resume", "nowhere"], "nowhere: not a training directory"),
        (["train", "--resume", "nowhere", "--steps", "5"], "resume: expected no other option, got steps"),
    ],
)
def test_one_line_for_every_mistake(argv, expected, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert expected in refused(capsys, *argv)
    assert not list(tmp_path.iterdir())


def test_a_curriculum_without_a_solved_map_is_refused(capsys, tmp_path):
    shutil.copytree(EARLIER_RUN, tmp_path / "unsolved")
    runs = (tmp_path / "unsolved" / "runs.csv").read_text()
    (tmp_path / "unsolved" / "runs.csv").write_text(runs.replace(",goal,", ",timeout,"))
    message = refused(capsys, "train", "--curriculum", tmp_path / "unsolved", "--out", tmp_path / "run")
    assert "unsolved: expected a run with a map on which a controller reached the goal, got none" in message
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize("given", ["maps", "curriculum"])
def test_no_map_at_all_is_refused(given, tmp_path):
    with pytest.raises(ConfigError, match=f"^{given}: expected at least one map, got none"):
        train("ppo", config=small(), out=tmp_path / "run", **{given: []})
    assert not (tmp_path / "run").exists()


def test_the_directory_of_something_else(trained, capsys):
    assert "already holds a training" in refused(capsys, "train", "--out", trained)
    assert "expected maps or the directory of a run, got the directory of a training" in refused(
        capsys, "bench", trained
    )


def test_a_rate_that_the_model_cannot_keep_is_refused_before_anything_is_driven(trained, tmp_path, capsys):
    (tmp_path / "experiment.yaml").write_text(
        json.dumps(
            {
                "controllers": ["rpp", f"learned={trained / 'best_model.zip'}"],
                "run": {"environment": {"control_hz": 26.0, "physics_hz": 104.0}, "navigation": "thesis"},
            }
        )
    )
    named = ("--config", tmp_path / "experiment.yaml", "--allow-code")
    message = refused(capsys, "evolve", *named, "--out", tmp_path / "run")
    assert "learned: control_hz: expected a multiple of 5" in message
    assert not (tmp_path / "run").exists()
