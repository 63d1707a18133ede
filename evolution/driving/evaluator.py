"""Evaluator: jobs in, results out in the same order, whatever the workers do.

Every job runs in a worker process, also with one worker, so that a controller that hangs or
kills its process costs that run and no other. The parent's memory is the workers' only in the
form of pickled jobs: workers come from a *fork server* (a clean process without threads that has
imported the code of the job once; a replaced worker is there in milliseconds), or are spawned
where there is none. Plain ``fork`` would copy a process with threads (the pool's own, BLAS),
which may deadlock.
"""

from __future__ import annotations

import multiprocessing
import os
import queue
import threading
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
from dataclasses import replace
from types import TracebackType
from typing import Self

from pebble import ProcessExpired, ProcessPool

from evolution.driving.jobs import Job, JobPlan, RunResult, SetResults
from evolution.driving.launching import worker_context
from evolution.driving.store import ResultStore
from gym_mapbench.errors import ConfigError, RunError
from gym_mapbench.scenario import MapSet

RunJob = Callable[[Job], RunResult]
OnRun = Callable[[Job, RunResult, int], None]

MAX_REASON = 300
POOL_CHECK_SECONDS = 1.0
MAX_DEAD_POOLS = 3


class Evaluator:
    """Drives jobs in worker processes and remembers every result.

    A run that raises, takes longer than ``timeout_s``, or kills its worker has the outcome
    ``error`` with the reason, after ``retries`` further attempts with the same seed.

    Args:
        run_job: Drives one job; must be importable by a worker (a function of a module, or a
            ``functools.partial`` of one).
        store: Results known already, and where new ones are kept; in memory if None.
        workers: Number of worker processes.
        timeout_s: Wall-clock seconds an attempt may take, the worker's start not included.
        retries: Further attempts after an ``error``.
        warm_up: Called once in every new worker, before its first job: loads and compiles kernels
            outside of ``timeout_s``.

    Attributes:
        driven: Runs driven so far.
        reused: Runs answered by the store so far.
    """

    def __init__(
        self,
        run_job: RunJob,
        store: ResultStore | None = None,
        *,
        workers: int = 1,
        timeout_s: float = 300.0,
        retries: int = 1,
        warm_up: Callable[[], object] | None = None,
    ) -> None:
        if workers < 1 or retries < 0 or not timeout_s > 0:
            raise ConfigError(
                "evaluator: expected workers >= 1, timeout_s > 0 and retries >= 0, "
                f"got {workers}, {timeout_s} and {retries}"
            )
        self.run_job = run_job
        self.store = ResultStore() if store is None else store
        self.workers = workers
        self.timeout_s = timeout_s
        self.retries = retries
        self.warm_up = warm_up
        self.driven = 0
        self.reused = 0
        self._pool: ProcessPool | None = None

    def evaluate(self, map_sets: Sequence[MapSet], plan: JobPlan, on_run: OnRun | None = None) -> list[SetResults]:
        """Drive map sets as ``plan`` says; ``results[set][map][controller][repeat]``."""
        scenarios = {scenario.digest: scenario for map_set in map_sets for scenario in map_set}
        jobs = [job for scenario in scenarios.values() for job in plan.jobs(scenario)]
        results = iter(self.run(jobs, on_run))
        of_scenario = {
            digest: tuple(tuple(next(results) for _ in range(plan.repeats)) for _ in plan.controllers)
            for digest in scenarios
        }
        return [tuple(of_scenario[scenario.digest] for scenario in map_set) for map_set in map_sets]

    def run(self, jobs: Sequence[Job], on_run: OnRun | None = None) -> list[RunResult]:
        """Return the results of ``jobs`` in their order; only what the store does not know is driven.

        Args:
            jobs: May hold the same job several times.
            on_run: Called after every driven run with the job, its result, and how many are left.

        Raises:
            RunError: If no worker can be started.
        """
        results = self.store.get_many(job.key for job in jobs)
        missing = {job.key: job for job in jobs if job.key not in results}
        self.reused += len(jobs) - len(missing)
        try:
            for left, (job, result) in zip(range(len(missing) - 1, -1, -1), self._drive(missing), strict=True):
                self.store.put(job.key, result)
                results[job.key] = result
                self.driven += 1
                if on_run is not None:
                    on_run(job, result, left)
        except BaseException:
            self.close()
            raise
        return [results[job.key] for job in jobs]

    def close(self) -> None:
        """Stop all workers, whatever they do."""
        if self._pool is not None:
            self._pool.stop()  # type: ignore[no-untyped-call]
            self._pool.join()
            self._pool = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, _type: type[BaseException] | None, _error: BaseException | None, _trace: TracebackType | None
    ) -> None:
        self.close()

    def _drive(self, jobs: dict[str, Job]) -> Iterator[tuple[Job, RunResult]]:
        """Drive every job to a final result, in the order in which they end."""
        left = dict(jobs)
        attempts: Counter[str] = Counter()
        dead_pools = 0
        while left:
            answered = 0
            for job, result in self._round(tuple(left.values())):
                answered += 1
                attempts[job.key] += 1
                if result.outcome == "error" and attempts[job.key] <= self.retries:
                    continue
                del left[job.key]
                yield job, replace(result, attempts=attempts[job.key], seed=job.seed)
            dead_pools = 0 if answered else dead_pools + 1
            if dead_pools == MAX_DEAD_POOLS:
                raise RunError("workers die before their first run (is run_job importable?)")

    def _round(self, jobs: Sequence[Job]) -> Iterator[tuple[Job, RunResult]]:
        """Try every job once; what a broken pool lost is not answered."""
        pool = self._running_pool()
        finished: queue.SimpleQueue[Future[RunResult]] = queue.SimpleQueue()
        job_of: dict[Future[RunResult], Job] = {}
        for job in jobs:
            try:
                scheduled = pool.schedule(attempt, (self.run_job, job), timeout=self.timeout_s)
            except RuntimeError:  # the pool broke meanwhile
                break
            job_of[scheduled] = job
            scheduled.add_done_callback(finished.put)
        for future in _as_they_end(finished, len(job_of), pool):
            yield job_of[future], self._result_of(future)

    def _result_of(self, future: Future[RunResult]) -> RunResult:
        """Read an answer; everything but a result is an error of that run."""
        error = future.exception()
        if error is None:
            return future.result()
        if isinstance(error, WarmUpError):
            raise RunError(f"workers cannot start: {error}") from None
        if isinstance(error, TimeoutError):
            return error_result(f"no answer within {self.timeout_s:g} s")
        if isinstance(error, ProcessExpired):
            return error_result(f"the worker died (exit code {error.exitcode})")
        return error_result(one_line(error))

    def _running_pool(self) -> ProcessPool:
        if self._pool is not None and not self._pool.active:
            self.close()
        if self._pool is None:
            context = worker_context(self.run_job, self.warm_up)
            self._pool = ProcessPool(self.workers, initializer=start_worker, initargs=[self.warm_up], context=context)
        return self._pool


def _as_they_end(
    finished: queue.SimpleQueue[Future[RunResult]], count: int, pool: ProcessPool
) -> Iterator[Future[RunResult]]:
    """Yield ``count`` futures as they end, fewer if the pool breaks."""
    for _ in range(count):
        future = None
        while future is None:
            try:
                future = finished.get(timeout=POOL_CHECK_SECONDS)
            except queue.Empty:
                if not pool.active:
                    return
        if isinstance(future.exception(), BrokenProcessPool):
            return
        yield future


class WarmUpError(Exception):
    """A worker's warm-up failed: nothing can be driven there."""


_warm_up_failure: list[str] = []
"""Of this worker process; a list, because a function fills it."""


def start_worker(warm_up: Callable[[], object] | None) -> None:
    """Prepare a new worker: it ends with its parent, and has its kernels loaded."""
    threading.Thread(target=_end_with_parent, daemon=True).start()
    try:
        if warm_up is not None:
            warm_up()
    except Exception as error:
        _warm_up_failure.append(one_line(error))


def _end_with_parent() -> None:
    """A parent that is killed cannot stop a worker that hangs."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def attempt(run_job: RunJob, job: Job) -> RunResult:
    """Drive a job in a worker; whatever the controller raises becomes the run's result."""
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
    """Return the result of a run that could not be driven to an end."""
    return RunResult("error", time_s=0.0, path_length_m=0.0, reason=reason)


def one_line(error: BaseException) -> str:
    """Say type and text of an error in one short line."""
    return " ".join(f"{type(error).__name__}: {error}".split())[:MAX_REASON]
