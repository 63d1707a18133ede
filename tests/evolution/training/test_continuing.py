"""Trainings that were interrupted or killed: what they go on from, and what they say."""

from __future__ import annotations

from signal import SIGINT, raise_signal

import numpy as np
import pytest

from controllers.learned import read_card
from evolution import load, train
from evolution.training import learning
from evolution.training.algorithms import Blank, make_model
from evolution.training.continuing import load_experience, save_experience
from evolution.training.directory import TrainingDir
from evolution.training.evaluation import Judgement
from evolution.training.levels import RandomLevels
from evolution.training.record import Recorder
from evolution.training.settings import train_settings
from tests.evolution.training.test_learning import small

pytest.importorskip("stable_baselines3")


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


class Killed(BaseException):
    """Stands for ``kill -9``: nothing of the training handles it."""


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
