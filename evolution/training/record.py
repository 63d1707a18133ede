"""Recorder of a training: the learning curve, checkpoints, the best model."""

from __future__ import annotations

import logging
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from controllers.learned import read_card
from evolution.files import Row, write_bytes
from evolution.pictures import learning_figure, save_figure
from evolution.training.algorithms import card_of, save_model
from evolution.training.continuing import save_experience, save_statistics
from evolution.training.directory import (
    BEST,
    BUFFER,
    CHECKPOINTS,
    CURVE_FIGURE,
    FIGURES,
    LATEST,
    NO_SCORE,
    STATISTICS,
    TrainingDir,
)
from evolution.training.evaluation import Judgement
from gym_mapbench.errors import ConfigError

LOG = logging.getLogger(__name__)


@dataclass(frozen=True)
class TrainProgress:
    """Progress of a training.

    Args:
        steps: Steps done.
        total: Steps in all.
        rate: Steps per second, evaluations included.
        success: Success of the latest episodes of the training; None before the first has ended.
        left: Seconds left; None before anything was measured.
        row: The latest line of the learning curve, None before the first.
    """

    steps: int
    total: int
    rate: float
    success: float | None
    left: float | None
    row: Row | None


class Recorder:
    """Writes the directory of a training.

    The step of the latest model is the one from which a training is continued. The learning curve has no later line,
    and its figure and the best model follow from it, wherever the training was killed.

    Args:
        directory: The directory.
        statistics: Its VecNormalize, None without one.
        done: Steps of the latest model; 0 at the beginning.

    Attributes:
        rows: The learning curve.
    """

    def __init__(self, directory: TrainingDir, statistics: Any, done: int) -> None:
        self._directory = directory
        self._settings = directory.settings
        self._statistics = statistics
        self._seconds = float((directory.state or {}).get("seconds", 0.0))
        self._began = time.perf_counter()
        kept = directory.read_curve()
        self.rows = [row for row in kept if row["steps"] <= done]
        if kept:
            self._directory.write_curve(self.rows)
        if self.rows:
            self._follow()

    @property
    def seconds(self) -> float:
        """Wall-clock seconds of the training so far."""
        return self._seconds + time.perf_counter() - self._began

    def evaluated(self, model: Any, found: Mapping[str, Judgement], success: float | None) -> None:
        """Record an evaluation; its model is the best one if no earlier one was as good."""
        score = float(np.mean([judgement.success for judgement in found.values()]))
        earlier = [row for row in self.rows if row["steps"] < model.num_timesteps]
        self.rows = [*earlier, _row(model.num_timesteps, self.seconds, score, found, success)]
        self._save(model, _checkpoint(self.rows[-1]), score)
        self._directory.write_curve(self.rows)
        self._save_latest(model)
        self._follow()
        self._write_state(model)

    def keep(self, model: Any) -> None:
        """Write the latest model, with its replay buffer if it has one, and the state of the training."""
        self._save_latest(model)
        if hasattr(model, "replay_buffer"):
            save_experience(model, self._directory.path / BUFFER)
        self._write_state(model)

    def _follow(self) -> None:
        """Write what follows from the learning curve: its figure, and the first of the best checkpoints."""
        path, best = self._directory.path, max(self.rows, key=_score)
        if best is self.rows[-1] or best["steps"] != _steps_of(path / BEST):
            if (path / _checkpoint(best)).is_file():
                write_bytes(path / BEST, (path / _checkpoint(best)).read_bytes())
            else:
                LOG.warning("%s: expected the best model so far, got none; %s stays", path / _checkpoint(best), BEST)
        groups = [name.removesuffix("_low") for name in self.rows[-1] if name.endswith("_low")]
        save_figure(learning_figure(self.rows, groups), path / FIGURES / CURVE_FIGURE)

    def _save_latest(self, model: Any) -> None:
        self._save(model, LATEST, self.rows[-1]["success"] if self.rows else None)
        if self._statistics is not None:
            save_statistics(self._statistics, self._directory.path / STATISTICS, model.num_timesteps)

    def _write_state(self, model: Any) -> None:
        """Write the state, as the last file: a training that is finished has all others, and its model is evaluated."""
        best = max(map(_score, self.rows), default=NO_SCORE)
        evaluated = bool(self.rows) and self.rows[-1]["steps"] == model.num_timesteps
        finished = evaluated and model.num_timesteps >= self._settings.steps
        state = {"steps": model.num_timesteps, "seconds": self.seconds, "best": best, "finished": finished}
        self._directory.write_state(state)

    def _save(self, model: Any, name: str, score: float | None) -> None:
        statistics = self._statistics if self._settings.normalize_observations else None
        card = card_of(self._settings, statistics, steps=model.num_timesteps, success=score)
        save_model(model, self._directory.path / name, card, to_drive=name != LATEST)


def _score(row: Row) -> float:
    return float(row["success"])


def _checkpoint(row: Row) -> str:
    """Return the file of the model that a line of the learning curve is of."""
    return f"{CHECKPOINTS}/{row['steps']:010d}.zip"


def _steps_of(model: Path) -> int | None:
    """Return the steps of a kept model; None if there is none, or it is damaged."""
    try:
        card = read_card(model)
    except ConfigError:
        return None
    return None if card is None else card.training.get("steps")


def _row(steps: int, seconds: float, score: float, found: Mapping[str, Judgement], training: float | None) -> Row:
    """Return a line of the learning curve: every group's success with its 95 % interval, collisions and time."""
    row: Row = {"steps": steps, "seconds": round(seconds, 1), "success": score, "success_in_training": training}
    for name, judgement in found.items():
        low, high = judgement.interval
        collisions = judgement.outcomes.get("collision", 0) / judgement.runs
        row |= {name: judgement.success, f"{name}_low": low, f"{name}_high": high}
        row |= {f"{name}_collisions": collisions, f"{name}_time": judgement.time}
    return row
