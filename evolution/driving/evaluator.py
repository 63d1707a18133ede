"""Evaluator: takes jobs and returns their results in the same order, in whichever order the workers finish.

Every job runs in a worker process, also with one worker, so that a controller that hangs or
kills its process costs that run and no other; unless another executor is chosen
(:mod:`evolution.driving.executors`). Workers see nothing of the parent's memory but the pickled
jobs.
"""

from __future__ import annotations

import logging
import queue
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import Self, TypeVar

from evolution.driving.executors import EXECUTORS
from evolution.driving.jobs import Job, JobPlan, RunResult, SetResults
from evolution.driving.pool import (
    NotStartedError,
    Processes,
    RunJob,
    WarmUp,
    WorkerDiedError,
    WorkerSetup,
    attempt,
    error_result,
    one_line,
    prepare_worker,
    shows_tracebacks,
)
from evolution.driving.store import ResultStore
from gym_mapbench.errors import ConfigError, PluginError, RunError
from gym_mapbench.world.scenario import MapSet

LOG = logging.getLogger(__name__)

T = TypeVar("T")
OnRun = Callable[[Job, RunResult, int], None]

CTRL_C_SECONDS = 0.5
"""How long Ctrl-C may go unnoticed: where another thread receives the signal, it does not wake one that waits."""

MAX_DEAD_POOLS = 3
RUN_TIMEOUT_SECONDS = 300.0


class Evaluator:
    """Drives jobs in worker processes and remembers every result.

    A run that raises, takes longer than ``timeout_s``, or kills its worker has the outcome
    ``error`` with the reason, after ``retries`` further attempts with the same seed.

    Args:
        run_job: Drives one job; must be importable by a worker (a function of a module, or a
            ``functools.partial`` of one).
        store: Holds the results known already and keeps the new ones; in memory if None.
        workers: Number of worker processes.
        timeout_s: Wall-clock seconds an attempt may take, not counting the start of its worker.
        retries: Further attempts after an ``error``.
        warm_up: Called once in every new worker, before its first job: loads and compiles kernels
            outside of ``timeout_s``.
        executor: What the jobs run on, by its name in :data:`~evolution.driving.executors.EXECUTORS`, or
            ``NAME=ADDRESS`` with the address of a scheduler (``dask=tcp://HOST:PORT``). ``processes``, the default, and
            ``dask`` enforce ``timeout_s`` and lose no more than one run when a process that drives dies; others do not.
        on_run: Called after every driven run with the job, its result, and how many of its batch are left.

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
        timeout_s: float = RUN_TIMEOUT_SECONDS,
        retries: int = 1,
        warm_up: WarmUp | None = None,
        executor: str = "processes",
        on_run: OnRun | None = None,
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
        self.on_run = on_run
        self.executor, _, self.scheduler = executor.partition("=")
        self.driven = 0
        self.reused = 0
        self._make = EXECUTORS.get(self.executor)
        self._executor: Executor | None = None

    def evaluate(self, map_sets: Sequence[MapSet], plan: JobPlan) -> list[SetResults]:
        """Drive map sets as ``plan`` says; returns ``results[set][map][controller][repeat]``."""
        scenarios = {scenario.digest: scenario for map_set in map_sets for scenario in map_set}
        jobs = [job for scenario in scenarios.values() for job in plan.jobs(scenario)]
        results = iter(self.run(jobs))
        of_scenario = {
            digest: tuple(tuple(next(results) for _ in range(plan.repeats)) for _ in plan.controllers)
            for digest in scenarios
        }
        return [tuple(of_scenario[scenario.digest] for scenario in map_set) for map_set in map_sets]

    def run(self, jobs: Sequence[Job]) -> list[RunResult]:
        """Return the results of ``jobs`` in their order; only what the store does not know is driven.

        Args:
            jobs: May hold the same job several times.

        Raises:
            RunError: If no worker can be started.
        """
        results = self.store.get_many(job.key for job in jobs)
        missing = {job.key: job for job in jobs if job.key not in results}
        self.reused += len(jobs) - len(missing)
        LOG.info("%d runs, of which %d are to be driven", len(jobs), len(missing))
        try:
            for left, (job, result) in zip(range(len(missing) - 1, -1, -1), self._drive(missing), strict=True):
                self.store.put(job.key, result)
                results[job.key] = result
                self.driven += 1
                _log_run(job, result)
                if self.on_run is not None:
                    self.on_run(job, result, left)
        except BaseException:
            self.close()
            raise
        return [results[job.key] for job in jobs]

    def map(self, function: Callable[[Job], T], jobs: Iterable[Job]) -> list[T]:
        """Return the values of a function of jobs, in their order; neither stored nor tried again.

        Worker processes that are running compute the values. This process computes those that they cannot send.

        Args:
            function: Can be pickled.
            jobs: The jobs.
        """
        jobs, executor = tuple(jobs), self._executor
        if not isinstance(executor, Processes):
            return [function(job) for job in jobs]
        futures = [executor.submit(function, job) for job in jobs]
        finished: queue.SimpleQueue[Future[T]] = queue.SimpleQueue()
        for future in futures:
            future.add_done_callback(finished.put)
        answered = {future for future in _as_they_end(finished, len(futures)) if future.exception() is None}
        return [
            future.result() if future in answered else function(job) for future, job in zip(futures, jobs, strict=True)
        ]

    def get_ready(self) -> None:
        """Start the workers now, so that they load and compile while their first jobs are still being made."""
        executor = self._running()
        if isinstance(executor, Processes):
            executor.get_ready()

    def close(self) -> None:
        """Stop all workers at once; those of an executor other than ``processes`` finish their job first.

        A third party's executor that fails to stop costs no result, but a warning.
        """
        executor, self._executor = self._executor, None
        if executor is not None:
            try:
                with EXECUTORS.blamed(self.executor):
                    executor.shutdown(wait=False, cancel_futures=True)
            except PluginError as error:
                LOG.warning("%s", error)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
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
                raise RunError("workers die before their first run")

    def _round(self, jobs: Sequence[Job]) -> Iterator[tuple[Job, RunResult]]:
        """Try every job once; jobs that a broken executor lost yield nothing."""
        executor = self._running()
        finished: queue.SimpleQueue[Future[RunResult]] = queue.SimpleQueue()
        job_of: dict[Future[RunResult], Job] = {}
        for job in jobs:
            try:
                scheduled = self._scheduled(executor, job)
            except RuntimeError:  # the executor broke meanwhile
                break
            job_of[scheduled] = job
            scheduled.add_done_callback(finished.put)
        answered = 0
        for future in _as_they_end(finished, len(job_of)):
            answered += 1
            yield job_of[future], self._result_of(future)
        if answered < len(jobs):
            self.close()

    def _scheduled(self, executor: Executor, job: Job) -> Future[RunResult]:
        """Submit a job; raises ``PluginError`` if a third-party executor fails, or ``RuntimeError`` if it is broken."""
        with EXECUTORS.blamed(self.executor, passing=RuntimeError):
            scheduled: object = executor.submit(attempt, self.run_job, job)
        if not isinstance(scheduled, Future):
            raise PluginError(f"executor {self.executor!r}: expected a Future of a job, got {scheduled!r:.80}")
        return scheduled

    def _result_of(self, future: Future[RunResult]) -> RunResult:
        """Return the result; anything a worker raised becomes an ``error`` result of that run."""
        error = future.exception()
        if error is None:
            result: object = future.result()
            if not isinstance(result, RunResult):
                raise PluginError(f"executor {self.executor!r}: expected the result of a run, got {result!r:.80}")
            return result
        if isinstance(error, NotStartedError):
            raise RunError(f"workers cannot start: {error}") from None
        if isinstance(error, TimeoutError):
            return error_result(f"no answer within {self.timeout_s:g} s (--run-timeout)")
        if isinstance(error, WorkerDiedError):
            return error_result(str(error))
        return error_result(one_line(error))

    def _running(self) -> Executor:
        if self._executor is None:
            with EXECUTORS.blamed(self.executor):
                prepare = partial(prepare_worker, self.warm_up, shows_tracebacks())
                made = self._make(WorkerSetup(self.workers, self.timeout_s, prepare, self.scheduler))
            if not hasattr(made, "submit") or not hasattr(made, "shutdown"):
                raise PluginError(f"executor {self.executor!r}: expected an Executor, got {made!r:.80}")
            self._executor = made
        return self._executor


def _log_run(job: Job, result: RunResult) -> None:
    run = f"{job.scenario.name}, {job.controller.name}, repeat {job.repeat}"
    reason = f" ({result.reason})" if result.reason else ""
    seeds = f"seed {job.seed}, of the noise {job.noise_seed}"
    LOG.info("%s: %s after %.2f s%s; %s", run, result.outcome, result.time_s, reason, seeds)


def _as_they_end(finished: queue.SimpleQueue[Future[T]], count: int) -> Iterator[Future[T]]:
    """Yield ``count`` futures as they end, fewer if the executor breaks."""
    for _ in range(count):
        future = None
        while future is None:
            with suppress(queue.Empty):
                future = finished.get(timeout=CTRL_C_SECONDS)
        if future.cancelled() or isinstance(future.exception(), BrokenExecutor):
            return
        yield future
