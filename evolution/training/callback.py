"""The callback of a training: evaluations, checkpoints, progress, and the end at a signal."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

import numpy as np
from stable_baselines3.common.callbacks import BaseCallback

from evolution.training.evaluation import Judgement
from evolution.training.record import Recorder, TrainProgress
from evolution.training.settings import TrainSettings
from evolution.training.vec_env import TrainingWorlds, share_done

OnProgress = Callable[[TrainProgress], None]

SIGNALS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))
"""Ctrl-C, what a machine sends that will be taken away, and the end of the terminal; Windows has no SIGHUP."""


class Interruption:
    """Whether one of :data:`SIGNALS` came; learning then stops between two steps, where the model is whole."""

    def __init__(self) -> None:
        self.asked = False

    @contextmanager
    def heeded(self) -> Iterator[None]:
        """Take note of a signal inside the ``with`` block instead of stopping at once; a second one stops at once.

        A signal that is ignored, as after ``nohup``, stays ignored.
        """
        if threading.current_thread() is not threading.main_thread():
            yield
            return
        heard = [number for number in SIGNALS if signal.getsignal(number) is not signal.SIG_IGN]
        before = {number: signal.signal(number, self._ask) for number in heard}
        try:
            yield
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)

    def _ask(self, number: int, frame: FrameType | None) -> None:
        if self.asked:
            raise KeyboardInterrupt
        self.asked = True


class Companion(BaseCallback):
    """Accompanies a training.

    Args:
        settings: The training.
        worlds: The VecEnv of the training.
        recorder: Writes its directory.
        judge: Drives the model on every group of held-out maps.
        interruption: Whether to stop.
        on_progress: Called after every rollout.
    """

    def __init__(
        self,
        settings: TrainSettings,
        worlds: TrainingWorlds,
        recorder: Recorder,
        judge: Callable[[Any], dict[str, Judgement]],
        interruption: Interruption,
        on_progress: OnProgress | None,
    ) -> None:
        super().__init__()
        self._settings = settings
        self._worlds = worlds
        self._recorder = recorder
        self._judge = judge
        self._interruption = interruption
        self._on_progress = on_progress

    def _on_training_start(self) -> None:
        self._began = time.perf_counter()
        self._first = self.num_timesteps
        every = self._settings.evaluation.every
        self._next = (self.num_timesteps // every + 1) * every

    def _on_rollout_start(self) -> None:
        done = share_done(self._settings, self.num_timesteps)
        self._worlds.progress = done
        first, last = self._settings.learning_rate
        self.model.learning_rate = first + (last - first) * done
        self.model._setup_lr_schedule()
        if self.num_timesteps >= self._next:
            self._next += self._settings.evaluation.every
            self.evaluate()
        self._tell()

    def _on_step(self) -> bool:
        return not self._interruption.asked

    def evaluate(self) -> None:
        """Evaluate the model and record the result."""
        found = self._judge(self.model)
        for name, judgement in found.items():
            self.logger.record(f"held_out/{name}", judgement.success)
        self._recorder.evaluated(self.model, found, self.success)

    @property
    def success(self) -> float | None:
        """Success of the latest episodes of the training; None before the first has ended."""
        return float(np.mean(self._worlds.successes)) if self._worlds.successes else None

    def _tell(self) -> None:
        if self._on_progress is None:
            return
        seconds = time.perf_counter() - self._began
        rate = (self.num_timesteps - self._first) / max(seconds, 1e-9)
        left = (self._settings.steps - self.num_timesteps) / rate if rate > 0 else None
        row = self._recorder.rows[-1] if self._recorder.rows else None
        self._on_progress(TrainProgress(self.num_timesteps, self._settings.steps, rate, self.success, left, row))
