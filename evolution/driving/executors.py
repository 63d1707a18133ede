"""Executors: what jobs run on.

By default these are worker processes of this machine. Anything else with the interface of
:class:`concurrent.futures.Executor` is made by a factory that is registered in :data:`EXECUTORS`, or named
``module:attribute``.

The default kills a run that takes too long, loses no more than one run when a process dies, and leaves no process
behind; so does ``dask`` on each machine of its cluster. A plain ``Executor`` can do none of this: a run that hangs
stops the search, and a worker that dies may break its pool, whose unfinished runs are then tried again in a new one.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import partial

from evolution.driving.jobs import Job, RunResult
from evolution.driving.launching import worker_context
from evolution.driving.processes import Processes
from evolution.driving.serving import NotStartedError, belong_to_parent
from gym_mapbench.errors import ConfigError, visible
from gym_mapbench.registry import Registry, must_be_callable

RunJob = Callable[[Job], RunResult]
WarmUp = Callable[[], object]

MAX_REASON = 300


@dataclass(frozen=True)
class Crew:
    """The workers that an executor is asked for.

    Args:
        workers: How many jobs run at once.
        timeout_s: Wall-clock seconds a job may take, not counting the start of its worker.
        prepare: To be called once in every new worker process, before its first job; can be pickled.
        modules: Modules that workers will import; a fork server may import them once for all workers.
        scheduler: Address of the scheduler whose workers to use; empty if none was named.
    """

    workers: int
    timeout_s: float
    prepare: WarmUp
    modules: tuple[str, ...]
    scheduler: str = ""

    @classmethod
    def of(cls, workers: int, timeout_s: float, run_job: RunJob, warm_up: WarmUp | None, scheduler: str = "") -> Crew:
        """Describe the workers that drive with ``run_job`` after a ``warm_up``."""
        functions = [getattr(function, "func", function) for function in (run_job, warm_up)]
        modules = tuple(name for one in functions if isinstance(name := getattr(one, "__module__", None), str))
        return cls(workers, timeout_s, partial(start_worker, warm_up), modules, scheduler)


def _processes(crew: Crew) -> Executor:
    """Make worker processes of this machine."""
    if crew.scheduler:
        raise ConfigError(f"executor 'processes': takes no scheduler, got {crew.scheduler!r}; 'dask' does")
    return Processes(crew.workers, crew.timeout_s, crew.prepare, worker_context(crew.modules))


def _dask(crew: Crew) -> Executor:
    """Connect to a Dask cluster, or start one on this machine."""
    try:
        import distributed  # noqa: F401
    except ModuleNotFoundError as error:
        raise ConfigError(
            f"executor 'dask': needs dask and distributed ({error}); install them with "
            "pip install 'gym-mapbench[distributed]'"
        ) from None
    from evolution.driving.cluster import connect

    return connect(crew)


EXECUTORS: Registry[Callable[[Crew], Executor]] = Registry(
    "executor", "executors", {"processes": _processes, "dask": _dask}, check=must_be_callable
)
"""Factories that make an executor for a :class:`Crew`, by name."""


_warm_up_failure: list[str] = []
"""Why the warm-up of this worker process failed; empty if it did not."""


def start_worker(warm_up: WarmUp | None) -> None:
    """Prepare a new worker: make it end with its parent and leave standard output alone, and load its kernels."""
    belong_to_parent()
    try:
        if warm_up is not None:
            warm_up()
    except Exception as error:
        _warm_up_failure.append(one_line(error))


def attempt(run_job: RunJob, job: Job) -> RunResult:
    """Drive a job in a worker; an exception of the controller becomes an ``error`` result."""
    if _warm_up_failure:
        raise NotStartedError(_warm_up_failure[0])
    try:
        result = run_job(job)
    except (Exception, SystemExit) as error:
        return error_result(one_line(error))
    if not isinstance(result, RunResult):
        return error_result(f"expected a RunResult, got {type(result).__name__}")
    return result if result.reason.isprintable() else replace(result, reason=visible(result.reason))


def error_result(reason: str) -> RunResult:
    """Return the result of a run that ended in an error."""
    return RunResult("error", time_s=0.0, path_length_m=0.0, reason=reason)


def one_line(error: BaseException) -> str:
    """Return the type and text of an error as one short line."""
    return visible(" ".join(f"{type(error).__name__}: {error}".split()))[:MAX_REASON]
