"""The process pool."""

from __future__ import annotations

from evolution.driving.pool.process_start import available_cores
from evolution.driving.pool.processes import Processes, WorkerDiedError
from evolution.driving.pool.worker_loop import Answer, NotStartedError
from evolution.driving.pool.worker_setup import (
    RunJob,
    WarmUp,
    WorkerSetup,
    attempt,
    error_result,
    one_line,
    prepare_worker,
)

__all__ = [
    "Answer",
    "NotStartedError",
    "Processes",
    "RunJob",
    "WarmUp",
    "WorkerDiedError",
    "WorkerSetup",
    "attempt",
    "available_cores",
    "error_result",
    "one_line",
    "prepare_worker",
]
