"""Recorder of a training: the learning curve, checkpoints, the best model."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from evolution.files import Row
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
    STATISTICS,
    TrainingDir,
)
from evolution.training.evaluation import Judgement
from evolution.training.settings import TrainSettings

NO_SCORE = -1.0


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

    Args:
        directory: The directory.
        settings: The training.
        statistics: Its VecNormalize, None without one.
        rows: The learning curve so far.
        state: Content of ``state.json``; None at the beginning.
    """

    def __init__(
        self,
        directory: TrainingDir,
        settings: TrainSettings,
        statistics: Any,
        rows: list[Row] | None = None,
        state: Mapping[str, Any] | None = None,
    ) -> None:
        self._directory = directory
        self._settings = settings
        self._statistics = statistics
        self.rows = rows or []
        self._best = float((state or {}).get("best", NO_SCORE))
        self._seconds = float((state or {}).get("seconds", 0.0))
        self._began = time.perf_counter()

    @property
    def seconds(self) -> float:
        """Wall-clock seconds of the training so far."""
        return self._seconds + time.perf_counter() - self._began

    def evaluated(self, model: Any, found: Mapping[str, Judgement], success: float | None) -> None:
        """Record an evaluation; save the model if it is the best so far."""
        score = float(np.mean([judgement.success for judgement in found.values()]))
        self.rows.append(_row(model.num_timesteps, self.seconds, score, found, success))
        path = self._directory.path
        if score > self._best:
            self._best = score
            self._save(model, BEST, score)
        self._save(model, f"{CHECKPOINTS}/{model.num_timesteps:010d}.zip", score)
        self._directory.write_curve(self.rows)
        save_figure(learning_figure(self.rows, list(found)), path / FIGURES / CURVE_FIGURE)
        self.keep(model)

    def keep(self, model: Any, *, with_buffer: bool = False) -> None:
        """Write the latest model and the state of the training.

        Args:
            model: The model.
            with_buffer: Whether to write the replay buffer too, where the algorithm has one; it may be large.
        """
        path = self._directory.path
        self._save(model, LATEST, self.rows[-1]["success"] if self.rows else None)
        if self._uses_statistics:
            save_statistics(self._statistics, path / STATISTICS)
        if with_buffer and hasattr(model, "replay_buffer"):
            save_experience(model.replay_buffer, path / BUFFER)
        finished = model.num_timesteps >= self._settings.steps
        state = {"steps": model.num_timesteps, "seconds": self.seconds, "best": self._best, "finished": finished}
        self._directory.write_state(state)

    @property
    def _uses_statistics(self) -> bool:
        return self._statistics is not None

    def _save(self, model: Any, name: str, score: float | None) -> None:
        statistics = self._statistics if self._settings.normalize_observations else None
        card = card_of(self._settings, statistics, steps=model.num_timesteps, success=score)
        save_model(model, self._directory.path / name, card, to_drive=name != LATEST)


def _row(steps: int, seconds: float, score: float, found: Mapping[str, Judgement], training: float | None) -> Row:
    """Return a line of the learning curve: every group's success with its 95 % interval, collisions and time."""
    row: Row = {"steps": steps, "seconds": round(seconds, 1), "success": score, "success_in_training": training}
    for name, judgement in found.items():
        low, high = judgement.interval
        collisions = judgement.outcomes.get("collision", 0) / judgement.runs
        row |= {name: judgement.success, f"{name}_low": low, f"{name}_high": high}
        row |= {f"{name}_collisions": collisions, f"{name}_time": judgement.time}
    return row
