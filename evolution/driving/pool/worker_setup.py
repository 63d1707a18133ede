"""What an executor is told about its workers, and the function with which a worker runs a job."""

from __future__ import annotations

import logging
import random
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from evolution.driving.jobs import Job, RunResult
from evolution.driving.pool.worker_loop import NotStartedError, belong_to_parent
from gym_mapbench.errors import MapBenchError, visible
from gym_mapbench.registry import LOG as TRACEBACKS
from gym_mapbench.registry import describe, type_and_text

RunJob = Callable[[Job], RunResult]
WarmUp = Callable[[], object]

MAX_REASON = 300


@dataclass(frozen=True)
class WorkerSetup:
    """The workers that an executor is asked for.

    Args:
        workers: Number of jobs that run at once.
        timeout_s: Wall-clock seconds a job may take, not counting the start of its worker.
        prepare: To be called once in every new worker process, before its first job; can be pickled.
        scheduler: Address of the scheduler whose workers to use; empty if none was named.
    """

    workers: int
    timeout_s: float
    prepare: WarmUp
    scheduler: str = ""


_warm_up_failure: list[str] = []
"""Why the warm-up of this worker process failed; empty if it did not."""


def shows_tracebacks() -> bool:
    """Whether this process logs tracebacks of third parties' errors, which its workers then print as well."""
    return TRACEBACKS.isEnabledFor(logging.INFO)


def prepare_worker(warm_up: WarmUp | None, print_tracebacks: bool = False) -> None:
    """Prepare a new worker process: tie it to its parent, print to standard error, and load the kernels.

    Args:
        warm_up: Loads the kernels; None if nothing does.
        print_tracebacks: Whether to print the tracebacks of third parties' errors.
    """
    belong_to_parent()
    if print_tracebacks:
        TRACEBACKS.setLevel(logging.INFO)
        TRACEBACKS.addHandler(logging.StreamHandler(sys.stderr))
    try:
        if warm_up is not None:
            warm_up()
    except Exception as error:
        _warm_up_failure.append(one_line(error))


def attempt(run_job: RunJob, job: Job) -> RunResult:
    """Run a job in a worker and return its result; an exception of the controller becomes an ``error`` result.

    An exception that is none of this project's own is reported with its file and line number. The global generators of
    Python and NumPy, which third parties may use, start from the job's seed.
    """
    if _warm_up_failure:
        raise NotStartedError(_warm_up_failure[0])
    random.seed(job.seed)
    np.random.seed(job.seed % 2**32)  # noqa: NPY002 - the global generator is what they use
    try:
        result = run_job(job)
    except MapBenchError as error:
        return error_result(one_line(error))
    except (Exception, SystemExit) as error:
        return error_result(_placed(error))
    if not isinstance(result, RunResult):
        return error_result(f"expected a RunResult, got {type(result).__name__}")
    return result if result.reason.isprintable() else replace(result, reason=visible(result.reason))


def error_result(reason: str) -> RunResult:
    """Return the result of a run that ended in an error."""
    return RunResult("error", time_s=0.0, path_length_m=0.0, reason=reason)


def one_line(error: BaseException) -> str:
    """Return the type and text of an error as one short line."""
    return visible(type_and_text(error))[:MAX_REASON]


def _placed(error: BaseException) -> str:
    """Return the type, text and place of an error as one short line; a long text loses its middle, not the place."""
    text = visible(describe(error))
    return text if len(text) <= MAX_REASON else f"{text[: MAX_REASON - 105]} ... {text[-100:]}"
