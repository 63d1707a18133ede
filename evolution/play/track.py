"""Track: runs batches of jobs in a process pool, one batch at a time; a new batch ends the one under way."""

from __future__ import annotations

import contextlib
import secrets
import tempfile
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import CancelledError as FutureCancelledError
from dataclasses import dataclass, field
from functools import partial
from multiprocessing import AuthenticationError
from multiprocessing.connection import Client, Connection, Listener
from typing import Any

from evolution.driving import Evaluator, Job, ResultStore, RunResult
from evolution.play.streaming import BEGIN, END, Address, CancelledError
from gym_mapbench.errors import ConfigError

OnMessage = Callable[[Job, Any], object]
OnResult = Callable[[Job, RunResult], object]
RunStreamed = Callable[[Address, Job], RunResult]
RunJobs = Callable[..., list[RunResult]]
""":meth:`Track.run`, perhaps with the answer to whether its batches are wanted."""

END_SECONDS = 1.0
"""How long a batch may take to end once it is told to; its workers are killed then."""
BACKLOG = 64
ENDS = (OSError, EOFError, AuthenticationError)


def ignore(_job: Job, _message: Any) -> None:
    """Do nothing with a message or a result."""


def _set_event() -> threading.Event:
    event = threading.Event()
    event.set()
    return event


@dataclass
class _Batch:
    """A batch of runs.

    Args:
        number: Number of the batch.
        jobs: Its jobs by their keys.
        on_message: Takes what a run sends.
        ended: For each job, set once its connection has ended.
        channels: The open connections.
        over: Set unless the batch is under way.
    """

    number: int
    jobs: dict[str, Job]
    on_message: OnMessage
    ended: dict[str, threading.Event]
    channels: set[Connection] = field(default_factory=set)
    over: threading.Event = field(default_factory=_set_event)


def _listening(key: bytes) -> Listener:
    """Listen for workers, at a socket in the folder for temporary files; errors as for :class:`Track`."""
    try:
        return Listener(None, authkey=key, backlog=BACKLOG)
    except OSError as error:
        folder = tempfile.gettempdir()
        raise ConfigError(
            f"the playground cannot make a socket in {folder} ({error}); set TMPDIR to another folder with a short path"
        ) from None


class Track:
    """A process pool whose runs stream and can be cancelled.

    Args:
        evaluator: Runs the jobs; its function and its store are replaced for each batch.

    Raises:
        ConfigError: If workers cannot connect to it.
    """

    def __init__(self, evaluator: Evaluator) -> None:
        self._evaluator = evaluator
        self._key = secrets.token_bytes(32)
        self._listener = _listening(self._key)
        self._address = str(self._listener.address)
        self._lock = threading.Lock()
        self._busy = threading.Lock()
        self._batch = _Batch(0, {}, ignore, {})
        self._closed = False
        threading.Thread(target=self._accept, daemon=True).start()

    def get_ready(self) -> None:
        """Start the workers now."""
        self._evaluator.get_ready()

    def run(
        self,
        function: RunStreamed,
        jobs: Sequence[Job],
        on_message: OnMessage = ignore,
        on_result: OnResult = ignore,
        wanted: Callable[[], bool] = lambda: True,
    ) -> list[RunResult]:
        """End the batch under way, run another, and return its results in the order of its jobs.

        Args:
            function: Runs a job in a worker; takes the address to which it sends its messages.
            jobs: The jobs.
            on_message: Called with each message of a run, in a thread.
            on_result: Called with each result, after all messages of its run, in a thread.
            wanted: Whether the batch is still wanted; asked once the former batch is told to end.

        Raises:
            CancelledError: If a later batch or :meth:`cancel` has ended this one.
            RunError: If no worker can be started.
        """
        batch = self._begin(jobs, on_message)
        if not wanted():
            raise CancelledError
        with self._busy:
            batch.over.clear()
            try:
                return self._run(batch, function, jobs, on_result)
            finally:
                with self._lock:
                    batch.over.set()

    def cancel(self) -> None:
        """End the batch under way, without waiting for its end."""
        self._begin((), ignore)

    def close(self) -> None:
        """End everything: no worker is left."""
        self._closed = True
        self.cancel()
        self._evaluator.close()
        with contextlib.suppress(*ENDS):
            Client(self._address, authkey=self._key).close()

    def _begin(self, jobs: Sequence[Job], on_message: OnMessage) -> _Batch:
        """Make a batch the present one, and tell the runs of the former one to end."""
        by_key = {job.key: job for job in jobs}
        with self._lock:
            former = self._batch
            ended = {key: threading.Event() for key in by_key}
            self._batch = _Batch(former.number + 1, by_key, on_message, ended)
            channels = tuple(former.channels)
        for channel in channels:
            with contextlib.suppress(OSError):
                channel.send(END)
        for event in former.ended.values():
            event.set()
        if not former.over.is_set():
            threading.Thread(target=self._kill_if_slow, args=(former,), daemon=True).start()
        return self._batch

    def _kill_if_slow(self, batch: _Batch) -> None:
        """Kill the workers of a batch that does not end by itself."""
        if not batch.over.wait(END_SECONDS):
            with self._lock:
                if not batch.over.is_set():
                    self._evaluator.close()

    def _run(self, batch: _Batch, function: RunStreamed, jobs: Sequence[Job], on_result: OnResult) -> list[RunResult]:
        def pass_on(job: Job, result: RunResult, _left: int) -> None:
            batch.ended[job.key].wait(END_SECONDS if result.outcome == "error" else None)
            if self._is_present(batch):
                on_result(job, result)

        if self._is_present(batch):
            self._evaluator.store = ResultStore()
            address = Address(self._address, self._key, batch.number)
            self._evaluator.run_job = partial(function, address)
            self._evaluator.on_run = pass_on
            with contextlib.suppress(FutureCancelledError):
                results = self._evaluator.run(jobs)
                if self._is_present(batch):
                    return results
        raise CancelledError

    def _is_present(self, batch: _Batch) -> bool:
        return batch is self._batch

    def _accept(self) -> None:
        """Take the connections of the workers, until one comes after the end: that of :meth:`close`."""
        with self._listener:
            while not self._closed:
                with contextlib.suppress(*ENDS):
                    channel = self._listener.accept()
                    threading.Thread(target=self._receive, args=(channel,), daemon=True).start()

    def _receive(self, channel: Connection) -> None:
        """Take the messages of a run until it ends; a run of a former batch is refused."""
        with channel, contextlib.suppress(*ENDS):
            number, key = channel.recv()
            with self._lock:
                batch = self._batch
                if batch.number != number:
                    return
                channel.send(BEGIN)
                batch.channels.add(channel)
            try:
                while True:
                    batch.on_message(batch.jobs[key], channel.recv())
            finally:
                batch.channels.discard(channel)
                batch.ended[key].set()
