"""Trainings that were interrupted or killed: what they go on from, and what they say."""

from __future__ import annotations

from signal import SIGINT, raise_signal

import pytest

from evolution import load, train
from evolution.training.levels import RandomLevels
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
