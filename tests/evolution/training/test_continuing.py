"""Trainings that were interrupted or killed: what they go on from, and what they say."""

from __future__ import annotations

import os
from signal import SIGINT, raise_signal

import numpy as np
import pytest

from controllers.learned import read_card
from evolution import load, train
from evolution.training import directory, learning
from evolution.training.algorithms import Blank, make_model
from evolution.training.continuing import (
    continued_model,
    load_experience,
    load_statistics,
    save_experience,
    save_statistics,
)
from evolution.training.directory import TrainingDir
from evolution.training.evaluation import Judgement
from evolution.training.learning import make_levels
from evolution.training.levels import RandomLevels
from evolution.training.record import Recorder
from evolution.training.settings import train_settings
from gym_mapbench.errors import RunError
from tests.evolution.training.test_learning import SMALL, rooms, small

pytest.importorskip("stable_baselines3")

from evolution.training.vec_env import TrainingWorlds


def interrupted(path, algorithm="ppo", at=160, **changes):
    """Leave a training as Ctrl-C leaves it."""

    def interrupt(progress):
        if progress.steps >= at:
            raise_signal(SIGINT)

    with pytest.raises(KeyboardInterrupt):
        train(algorithm, config=small(algorithm, **changes), out=path, on_progress=interrupt)
    return load(path)


def test_a_continued_curriculum_goes_on_where_it_stood(tmp_path, monkeypatch):
    stopped = interrupted(tmp_path / "run")
    seen, draw = [], RandomLevels._draw

    def noted(levels, progress):
        seen.append(progress)
        return draw(levels, progress)

    monkeypatch.setattr(RandomLevels, "_draw", noted)
    train(resume=tmp_path / "run")
    assert min(seen) >= stopped.state["steps"] / 320


def test_a_continued_training_has_other_samples_of_exploration_and_noise(tmp_path):
    import torch

    stopped = interrupted(tmp_path / "run")
    settings = train_settings("ppo", small(world={**SMALL["world"], "noise": "nominal"}))
    samples, noises, level = [], [], rooms(1)
    for done in (0, stopped.state["steps"], stopped.state["steps"]):
        worlds = TrainingWorlds(settings, make_levels(settings, level, []), done)
        if done:
            continued_model(settings, tmp_path / "run" / "model.zip", worlds, None)
        else:
            make_model(settings, worlds, None)
        samples.append(float(torch.rand(1)))
        noises.append(worlds.reset().tolist())
    for first, continued, again in (samples, noises):
        assert first != continued == again


class Killed(BaseException):
    """Stands for ``kill -9``: nothing of the training handles it."""


def die(*_):
    """Stand for a function in which the training is killed."""
    raise Killed


@pytest.mark.slow
@pytest.mark.parametrize(
    ("owner", "writing"),
    [
        (TrainingDir, "write_curve"),
        (Recorder, "_save_latest"),
        (Recorder, "_follow"),
        (Recorder, "_write_state"),
    ],
)
@pytest.mark.parametrize("goals", [(5, 9, 2, 2), (5, 9, 7, 2), (9, 5, 2, 7)])
def test_a_kill_between_two_files_leaves_a_record_that_fits_together(owner, writing, goals, tmp_path, monkeypatch):
    left = [Judgement({"goal": count, "timeout": 10 - count}, 1.0) for count in goals]
    monkeypatch.setattr(learning, "judge", lambda *_: left.pop(0))
    write, calls = getattr(owner, writing), []

    def killed(*given):
        calls.append(given)
        if len(calls) == 2:
            raise Killed
        write(*given)

    with monkeypatch.context() as patch:
        patch.setattr(owner, writing, killed)
        with pytest.raises(Killed):
            train("ppo", config=small(), out=tmp_path / "run")
    done = train(resume=tmp_path / "run")
    steps = [row["steps"] for row in done.curve]
    assert steps == sorted(set(steps))
    best = max(done.curve, key=lambda row: row["success"])
    card = read_card(done.best)
    assert (card.training["steps"], card.training["success"]) == (best["steps"], best["success"])
    assert done.state["best"] == best["success"]
    assert steps[-1] == done.state["steps"] >= 320


class TestExperience:
    def model(self, steps, filled):
        settings = train_settings("sac", small("sac"))
        model = make_model(settings, Blank(settings), None)
        model.num_timesteps = steps
        spaces = model.observation_space, model.action_space
        for _ in range(filled):
            seen, action = (space.sample()[None] for space in spaces)
            model.replay_buffer.add(seen, seen, action, np.zeros(1), np.zeros(1), [{}])
        return model

    @pytest.mark.parametrize("filled", [200, 10])
    def test_of_the_same_step_is_kept(self, filled, tmp_path, caplog):
        save_experience(self.model(200, filled), tmp_path / "buffer.npz")
        model = self.model(200, 0)
        load_experience(model, tmp_path / "buffer.npz")
        assert model.replay_buffer.size() == filled
        assert model.learning_starts == (40 if filled == 200 else 230)
        assert not caplog.records

    def test_of_another_step_is_lost_with_a_message_and_collected_again(self, tmp_path, caplog):
        save_experience(self.model(160, 160), tmp_path / "buffer.npz")
        model = self.model(200, 0)
        load_experience(model, tmp_path / "buffer.npz")
        assert (model.replay_buffer.size(), model.learning_starts) == (0, 240)
        assert "expected the experience of 200 steps, got that of 160; the training collects 40 steps" in caplog.text

    def test_that_was_never_kept_is_collected_again(self, tmp_path, caplog):
        model = self.model(200, 0)
        load_experience(model, tmp_path / "buffer.npz")
        assert model.learning_starts == 240
        assert "expected the experience of 200 steps, got none; the training collects 40 steps" in caplog.text


def test_a_training_that_was_killed_before_its_maps_were_written_does_not_go_on_with_random_maps(tmp_path, monkeypatch):
    with monkeypatch.context() as patch:
        patch.setattr(directory, "map_set_document", die)
        with pytest.raises(Killed):
            train("ppo", config=small(), maps=rooms(5), out=tmp_path / "run")
    with pytest.raises(RunError, match=r"maps.json: expected the 5 maps .* got 0; begin it again"):
        train(resume=tmp_path / "run")


@pytest.mark.parametrize("left", ["", "steps,seconds,success\n", None])
def test_a_curve_without_the_evaluations_that_chose_the_best_model_is_damaged(tmp_path, left):
    """A continued training would take its next model for the best one."""
    made = TrainingDir.create(tmp_path / "run", train_settings("ppo", small()), rooms(4), [])
    made.write_state({"steps": 20, "seconds": 1.0, "best": -1.0, "finished": False})
    assert load(tmp_path / "run").curve == []
    made.write_state({"steps": 40, "seconds": 1.0, "best": 0.5, "finished": False})
    if left is not None:
        (tmp_path / "run" / "curve.csv").write_text(left)
    with pytest.raises(
        RunError, match=r"curve\.csv: expected the evaluations that chose the best model so far, got none"
    ):
        load(tmp_path / "run")


@pytest.mark.parametrize(("count", "not_held_out"), [(4, ("maps",)), (5, ())])
def test_a_training_whose_maps_were_deleted_is_loaded_and_not_continued(tmp_path, caplog, count, not_held_out):
    made = TrainingDir.create(tmp_path / "run", train_settings("ppo", small()), rooms(count), [])
    made.write_curve([{"steps": 40, "seconds": 1.0, "success": 0.5}])
    made.write_state({"steps": 40, "seconds": 1.0, "best": 0.5, "finished": False})
    (tmp_path / "run" / "maps.json").unlink()
    loaded = load(tmp_path / "run")
    assert (loaded.not_held_out, loaded.finished) == (not_held_out, False)
    assert f"maps.json: was deleted; whether maps were held out follows from their number, {count}" in caplog.text
    with pytest.raises(RunError, match=f"maps.json: expected the {count} maps"):
        train(resume=tmp_path / "run")


def test_a_training_that_was_killed_when_it_had_its_options_only_is_continued(tmp_path, monkeypatch):
    with monkeypatch.context() as patch:
        patch.setattr(TrainingDir, "complete", die)
        with pytest.raises(Killed):
            train("ppo", config=small(), out=tmp_path / "run")
    left = tmp_path / "run" / ".replay_buffer.npz.0123abcd.part"
    left.write_bytes(b"half of it")
    os.utime(left, (0, 0))
    assert train(resume=tmp_path / "run").finished
    assert (tmp_path / "run" / "README.txt").is_file()
    assert not [*(tmp_path / "run").rglob(".*")]


def test_statistics_of_another_step_than_the_model_s_are_reported(tmp_path, caplog):
    from stable_baselines3.common.vec_env import DummyVecEnv, VecNormalize

    settings = train_settings("ppo", small())
    statistics = VecNormalize(DummyVecEnv([lambda: Blank(settings)]))
    save_statistics(statistics, tmp_path / "statistics.npz", 160)
    load_statistics(statistics, tmp_path / "statistics.npz", 160)
    assert not caplog.messages
    load_statistics(statistics, tmp_path / "statistics.npz", 320)
    assert "expected the statistics of 320 steps, got those of 160" in caplog.text
