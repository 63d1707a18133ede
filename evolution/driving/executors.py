"""Executors: what jobs run on.

By default these are worker processes of this machine. Anything else with the interface of
:class:`concurrent.futures.Executor` is made by a factory that is registered in :data:`EXECUTORS`, or named
``module:attribute``.

The default kills a run that takes too long, loses no more than one run when a process dies, and leaves no process
behind. A plain ``Executor`` can do none of this: a run that hangs stops the search, and a worker that dies may break
its pool, whose unfinished runs are then tried again in a new one.
"""

from __future__ import annotations

import multiprocessing
import os
import threading
from collections.abc import Callable
from concurrent.futures import Executor, Future
from dataclasses import dataclass
from functools import partial
from typing import Any, TypeVar

from pebble import ProcessPool

from evolution.driving.jobs import Job, RunResult
from evolution.driving.launching import worker_context
from gym_mapbench.registry import Registry, must_be_callable

RunJob = Callable[[Job], RunResult]
WarmUp = Callable[[], object]
T = TypeVar("T")

MAX_REASON = 300


@dataclass(frozen=True)
class Crew:
    """The workers that an executor is asked for.

    Args:
        workers: How many jobs run at once.
        timeout_s: Wall-clock seconds a job may take, not counting the start of its worker.
        prepare: To be called once in every new worker process, before its first job; can be pickled.
        modules: Modules that workers will import; a fork server may import them once for all workers.
    """

    workers: int
    timeout_s: float
    prepare: WarmUp
    modules: tuple[str, ...]

    @classmethod
    def of(cls, workers: int, timeout_s: float, run_job: RunJob, warm_up: WarmUp | None) -> Crew:
        """Describe the workers that drive with ``run_job`` after a ``warm_up``."""
        functions = [getattr(function, "func", function) for function in (run_job, warm_up)]
        modules = tuple(name for one in functions if isinstance(name := getattr(one, "__module__", None), str))
        return cls(workers, timeout_s, partial(start_worker, warm_up), modules)


class Processes(Executor):
    """Worker processes of this machine, one job each at a time; a job that takes too long is killed with its process.

    Args:
        crew: The workers that are asked for.
    """

    def __init__(self, crew: Crew) -> None:
        self._timeout_s = crew.timeout_s
        self._pool = ProcessPool(crew.workers, initializer=crew.prepare, context=worker_context(crew.modules))

    @property
    def alive(self) -> bool:
        """Whether jobs that were submitted will still end."""
        return bool(self._pool.active)

    def submit(self, fn: Callable[..., T], /, *args: Any, **kwargs: Any) -> Future[T]:
        """Run ``fn`` in a worker; the future gets a ``TimeoutError`` or a ``ProcessExpired`` where it is lost.

        Raises:
            RuntimeError: If no worker can be started.
        """
        future: Future[T] = self._pool.schedule(fn, args, kwargs, timeout=self._timeout_s)
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Stop all workers at once, busy or not."""
        self._pool.stop()  # type: ignore[no-untyped-call]
        self._pool.join()


EXECUTORS: Registry[Callable[[Crew], Executor]] = Registry(
    "executor", "executors", {"processes": Processes}, check=must_be_callable
)
"""Factories that make an executor for a :class:`Crew`, by name."""


class WarmUpError(Exception):
    """A worker's warm-up failed: nothing can be driven there."""


_warm_up_failure: list[str] = []
"""Why the warm-up of this worker process failed; empty if it did not."""


def start_worker(warm_up: WarmUp | None) -> None:
    """Prepare a new worker: make it end with its parent, and load its kernels."""
    threading.Thread(target=_end_with_parent, daemon=True).start()
    try:
        if warm_up is not None:
            warm_up()
    except Exception as error:
        _warm_up_failure.append(one_line(error))


def _end_with_parent() -> None:
    """Exit with the parent: a parent that is killed cannot stop a worker that hangs."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def attempt(run_job: RunJob, job: Job) -> RunResult:
    """Drive a job in a worker; an exception of the controller becomes an ``error`` result."""
    if _warm_up_failure:
        raise WarmUpError(_warm_up_failure[0])
    try:
        result = run_job(job)
    except (Exception, SystemExit) as error:
        return error_result(one_line(error))
    if not isinstance(result, RunResult):
        return error_result(f"expected a RunResult, got {type(result).__name__}")
    return result


def error_result(reason: str) -> RunResult:
    """Return the result of a run that ended in an error."""
    return RunResult("error", time_s=0.0, path_length_m=0.0, reason=reason)


def one_line(error: BaseException) -> str:
    """Return the type and text of an error as one short line."""
    return " ".join(f"{type(error).__name__}: {error}".split())[:MAX_REASON]
