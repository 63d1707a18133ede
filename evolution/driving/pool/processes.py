"""The pool: an executor that runs each job in a worker process of this machine.

Whatever happens to a worker process costs the job that it runs and no other. Every worker has its own pipe, so a worker
that dies while it writes blocks no other. Every worker leads its own process group, so the processes that a job starts
end with the worker. One thread of the calling process looks after each worker: it sends a job, and waits for the
answer, the end of the worker, or the end of the job's time.
"""

from __future__ import annotations

import atexit
import contextlib
import pickle
import queue
import threading
from collections.abc import Callable
from concurrent.futures import BrokenExecutor, Executor, Future
from dataclasses import dataclass
from functools import partial
from multiprocessing.connection import wait
from typing import Any, TypeVar

from evolution.driving.pool.process_start import start_worker_process
from evolution.driving.pool.worker_loop import READY, Answer

T = TypeVar("T")

MAX_FAILED_STARTS = 5
"""The number of workers, besides one for each that is wanted, that may die in a row before they are ready."""


class WorkerDiedError(Exception):
    """The worker process died during a run.

    Args:
        exitcode: Its exit code; negative for the number of a signal.
    """

    def __init__(self, exitcode: int | None) -> None:
        super().__init__(exitcode)

    def __str__(self) -> str:
        return f"the worker died (exit code {self.args[0]})"


@dataclass(frozen=True)
class _Job:
    """A call, and the future of its result."""

    call: Callable[[], Any]
    future: Future[Any]


class Processes(Executor):
    """Runs jobs in worker processes, one job at a time in each; kills a job that takes too long with its process.

    Args:
        workers: Number of worker processes.
        timeout_s: Wall-clock seconds a job may take, not counting the start of its worker.
        prepare: Called once in every new worker, before its first job; can be pickled.
    """

    def __init__(self, workers: int, timeout_s: float, prepare: Callable[[], object]) -> None:
        self._timeout_s = timeout_s
        self._prepare = prepare
        self._jobs: queue.SimpleQueue[_Job | None] = queue.SimpleQueue()
        self._stopping = threading.Event()
        self._workers: set[_Worker] = set()
        self._failed_starts = 0
        self._max_failed_starts = MAX_FAILED_STARTS + workers
        self._threads = [threading.Thread(target=self._run_jobs, daemon=True) for _ in range(workers)]
        for thread in self._threads:
            thread.start()
        atexit.register(self.shutdown)

    def submit(self, fn: Callable[..., T], /, *args: Any, **kwargs: Any) -> Future[T]:
        """Run ``fn`` in a worker; the future gets ``TimeoutError`` or :class:`WorkerDiedError` where the run is lost.

        Raises:
            RuntimeError: If the pool was shut down.
        """
        if self._stopping.is_set():
            raise RuntimeError("the workers were stopped")
        future: Future[T] = Future()
        self._jobs.put(_Job(partial(fn, *args, **kwargs), future))
        return future

    def get_ready(self) -> None:
        """Start all workers now; otherwise each starts with its first job."""
        for _ in self._threads:
            self.submit(bool)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Kill all workers at once, busy or not, with the processes that they have started."""
        self._stopping.set()
        atexit.unregister(self.shutdown)
        for worker in tuple(self._workers):
            worker.process.kill()
        for _ in self._threads:
            self._jobs.put(None)
        for thread in self._threads:
            thread.join()

    def _run_jobs(self) -> None:
        """Give jobs to one worker, and to its successors, until the pool is shut down."""
        worker: _Worker | None = None
        while (job := self._jobs.get()) is not None:
            if self._stopping.is_set():
                job.future.cancel()
            elif job.future.set_running_or_notify_cancel():
                worker = self._run(job, worker or self._ready_worker())
        if worker is not None:
            self._end(worker)

    def _ready_worker(self) -> _Worker | None:
        """Start a worker; returns it once it is ready, None if too many have died before or the pool is shut down."""
        while self._failed_starts < self._max_failed_starts and not self._stopping.is_set():
            worker = self._start_worker()
            if worker is not None and worker.gets_ready():
                self._failed_starts = 0
                return worker
            if worker is not None:
                self._end(worker)
            self._failed_starts += 1
            self._stopping.wait(0.1 * self._failed_starts)
        return None

    def _start_worker(self) -> _Worker | None:
        """Start a worker; None if no process can be started."""
        try:
            worker = _Worker(self._prepare)
        except OSError:
            return None
        self._workers.add(worker)
        if self._stopping.is_set():  # shutdown() may have looked before this worker was added
            worker.process.kill()
        return worker

    def _run(self, job: _Job, worker: _Worker | None) -> _Worker | None:
        """Run a job and settle its future; returns the worker, None if it cannot be used again."""
        if worker is None:
            job.future.set_exception(BrokenExecutor("workers die before they are ready"))
            return None
        try:
            answer = worker.answer(job, self._timeout_s)
        except Exception as error:
            answer = Answer(error=error, left_children=True)
        if answer.left_children:
            self._end(worker)
        answer.settle(job.future)
        return None if answer.left_children else worker

    def _end(self, worker: _Worker) -> None:
        """Kill a worker and the processes that it has started, and wait until it has ended."""
        worker.process.end()
        self._workers.discard(worker)


class _Worker:
    """A worker process, as the pool sees it.

    Args:
        prepare: Called in the worker before its first job.

    Raises:
        OSError: If no process can be started.
    """

    def __init__(self, prepare: Callable[[], object]) -> None:
        self.process = start_worker_process(prepare)

    def gets_ready(self) -> bool:
        """Wait until the worker is prepared; returns False if it dies before."""
        try:
            return bool(self._next_message() == READY)
        except WorkerDiedError:
            return False

    def answer(self, job: _Job, timeout_s: float) -> Answer:
        """Run a job and return its answer.

        Raises:
            TimeoutError: If the job takes longer than ``timeout_s`` wall-clock seconds.
            WorkerDiedError: If the worker dies meanwhile.
        """
        content = pickle.dumps(job.call)
        with contextlib.suppress(OSError):  # the worker is dead; its exit code is read below
            self.process.pipe.send_bytes(content)
        answer = self._next_message(timeout_s)
        if not isinstance(answer, Answer):
            raise TypeError(f"expected an answer of a worker, got {type(answer).__name__}")
        return answer

    def _next_message(self, timeout_s: float | None = None) -> Any:
        """Wait for the next message of the worker and return it."""
        ready = wait([self.process.pipe, self.process.sentinel], timeout_s)
        if not ready:
            raise TimeoutError
        if self.process.pipe in ready:
            with contextlib.suppress(EOFError, OSError):
                return self.process.pipe.recv()
        raise WorkerDiedError(self.process.exit_code())
