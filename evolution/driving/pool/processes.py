"""Worker processes of this machine: whatever happens to one of them costs the run it drives, and no other.

Every worker has a pipe of its own, so that one that dies while it writes stops no other, and leads a process group of
its own, so that what a controller starts ends with it. A thread of this process tends each worker: it hands out jobs,
and waits for the answer, the end of the process, or the end of the time that the job has.
"""

from __future__ import annotations

import atexit
import contextlib
import os
import pickle
import queue
import signal
import threading
from collections.abc import Callable
from concurrent.futures import BrokenExecutor, Executor, Future
from dataclasses import dataclass
from functools import partial
from multiprocessing.connection import wait
from multiprocessing.context import BaseContext
from multiprocessing.process import BaseProcess
from typing import Any, TypeVar

from evolution.driving.pool.worker_loop import READY, Answer, serve

T = TypeVar("T")

PATIENCE = 5
"""So many workers, and one more for each that is wanted, may die in a row before they are ready."""

_PROCESSES = threading.Lock()
"""Held while a process is started or looked at: the list that ``multiprocessing`` keeps is not safe for threads."""


class WorkerDiedError(Exception):
    """The process that drove a run has died.

    Args:
        exitcode: Its exit code; negative for the number of a signal.
    """

    def __init__(self, exitcode: int | None) -> None:
        super().__init__(exitcode)

    def __str__(self) -> str:
        return f"the worker died (exit code {self.args[0]})"


@dataclass(frozen=True)
class _Job:
    """A function with its arguments, and the future of its result."""

    function: Callable[..., Any]
    args: tuple[Any, ...]
    future: Future[Any]


class Processes(Executor):
    """Worker processes, one job each at a time; a job that takes too long is killed with its process.

    Args:
        workers: How many.
        timeout_s: Wall-clock seconds a job may take, not counting the start of its worker.
        prepare: Called once in every new worker, before its first job; can be pickled.
        context: Starts processes.
    """

    def __init__(self, workers: int, timeout_s: float, prepare: Callable[[], object], context: BaseContext) -> None:
        self._timeout_s = timeout_s
        self._start = partial(_Worker, context, prepare)
        self._jobs: queue.SimpleQueue[_Job | None] = queue.SimpleQueue()
        self._stopping = threading.Event()
        self._workers: set[_Worker] = set()
        self._failed_starts = 0
        self._patience = PATIENCE + workers
        self._threads = [threading.Thread(target=self._tend, daemon=True) for _ in range(workers)]
        for thread in self._threads:
            thread.start()
        atexit.register(self.shutdown)

    def submit(self, fn: Callable[..., T], /, *args: Any, **kwargs: Any) -> Future[T]:
        """Run ``fn`` in a worker; the future gets ``TimeoutError`` or :class:`WorkerDiedError` where the run is lost.

        Raises:
            RuntimeError: If the workers were stopped.
        """
        if self._stopping.is_set():
            raise RuntimeError("the workers were stopped")
        future: Future[T] = Future()
        self._jobs.put(_Job(partial(fn, **kwargs), args, future))
        return future

    def get_ready(self) -> None:
        """Start all workers now; without this, they start as jobs come."""
        for _ in self._threads:
            self.submit(bool)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Kill all workers at once, busy or not, with whatever they have started."""
        self._stopping.set()
        atexit.unregister(self.shutdown)
        for worker in tuple(self._workers):
            worker.kill()
        for _ in self._threads:
            self._jobs.put(None)
        for thread in self._threads:
            thread.join()

    def _tend(self) -> None:
        """Hand jobs to one worker, and to its successors, until the workers are stopped."""
        worker: _Worker | None = None
        while (job := self._jobs.get()) is not None:
            if self._stopping.is_set():
                job.future.cancel()
            elif job.future.set_running_or_notify_cancel():
                worker = self._do(job, worker or self._hire())
        if worker is not None:
            self._dismiss(worker)

    def _hire(self) -> _Worker | None:
        """Start a worker and wait until it is ready; None if too many have died before that, or none is wanted."""
        while self._failed_starts < self._patience and not self._stopping.is_set():
            worker = self._start()
            self._workers.add(worker)
            if self._stopping.is_set():  # since then, so that nobody else kills this one
                worker.kill()
            if worker.gets_ready():
                self._failed_starts = 0
                return worker
            self._dismiss(worker)
            self._failed_starts += 1
            self._stopping.wait(0.1 * self._failed_starts)
        return None

    def _do(self, job: _Job, worker: _Worker | None) -> _Worker | None:
        """Have a job done; returns the worker, None if it cannot be used again."""
        if worker is None:
            job.future.set_exception(BrokenExecutor("workers die before they are ready"))
            return None
        try:
            answer = worker.answer(job, self._timeout_s)
        except Exception as error:
            answer = Answer(error=error, alone=False)
        if not answer.alone:
            self._dismiss(worker)
        answer.settle(job.future)
        return worker if answer.alone else None

    def _dismiss(self, worker: _Worker) -> None:
        """Make sure that a worker and all it has started are gone."""
        worker.kill()
        worker.forget()
        self._workers.discard(worker)


class _Worker:
    """A worker process, as its parent sees it."""

    def __init__(self, context: BaseContext, prepare: Callable[[], object]) -> None:
        self._pipe, theirs = context.Pipe()
        with _PROCESSES:
            self._process: BaseProcess = context.Process(  # type: ignore[attr-defined]
                target=serve, args=(theirs, prepare), name="mapbench-worker"
            )
            self._process.start()
        theirs.close()

    @property
    def pid(self) -> int:
        """Number of the process, and of the process group that it leads."""
        return int(self._process.pid or 0)

    def gets_ready(self) -> bool:
        """Wait until the worker is prepared; False if it dies before."""
        try:
            return bool(self._received() == READY)
        except WorkerDiedError:
            return False

    def answer(self, job: _Job, timeout_s: float) -> Answer:
        """Have a job done.

        Raises:
            TimeoutError: If that takes longer than ``timeout_s`` wall-clock seconds.
            WorkerDiedError: If the worker dies meanwhile.
        """
        content = pickle.dumps((job.function, job.args))
        with contextlib.suppress(OSError):  # it is dead; how it died is found out next
            self._pipe.send_bytes(content)
        answer = self._received(timeout_s)
        if not isinstance(answer, Answer):
            raise TypeError(f"expected an answer of a worker, got {type(answer).__name__}")
        return answer

    def kill(self) -> None:
        """Kill the process and its process group."""
        if hasattr(os, "killpg"):
            with contextlib.suppress(ProcessLookupError):
                os.killpg(self.pid, signal.SIGKILL)
        with _PROCESSES:
            self._process.kill()

    def forget(self) -> None:
        """Close the pipe to a worker that was killed."""
        with _PROCESSES:
            self._process.join(1.0)
        self._pipe.close()

    def _received(self, timeout_s: float | None = None) -> Any:
        """Wait for what the worker says next."""
        ready = wait([self._pipe, self._process.sentinel], timeout_s)
        if not ready:
            raise TimeoutError
        if self._pipe in ready:
            with contextlib.suppress(EOFError, OSError):
                return self._pipe.recv()
        with _PROCESSES:
            self._process.join(1.0)
            exitcode = self._process.exitcode
        raise WorkerDiedError(exitcode)
