"""Runs on a Dask cluster: on the machines of a scheduler, or on this one.

A Dask worker drives nothing itself. It keeps as many worker processes (:mod:`evolution.driving.pool`) as it has
threads, so that on every machine a run that takes too long is killed, and a controller that kills its process costs its
own run. What Dask does is to carry jobs and results, and to drive elsewhere what was lost with a machine.

Jobs travel in chunks of about half a second of work, because a scheduler can hand out about a thousand tasks a second.
This is the one file that imports ``distributed``, which comes with the extra of this name.
"""

from __future__ import annotations

import contextlib
import logging
import math
import pickle
import queue
import re
import threading
import time
import uuid
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple, TypeVar

from distributed import Client, LocalCluster, Worker, WorkerPlugin, get_worker

from evolution.driving.pool import Answer, Processes, WorkerSetup, loaded
from evolution.files import software
from gym_mapbench.errors import ConfigError, RunError

T = TypeVar("T")

ADDRESS = re.compile(r"[a-z]+://.+:\d+")
CONNECT_SECONDS = 5
LOOPBACK = "127.0.0.1:0"
"""Where the page of a cluster on this machine is shown: at any free port, to this machine alone."""

RETRIES = 3
"""How often Dask tries a chunk again on a worker that cannot start processes, perhaps on another one."""

CHUNK_SECONDS = 0.5
"""What a chunk should take, s; Dask needs about a millisecond for each."""

CHUNKS_PER_THREAD = 4
"""The least number of chunks for each thread of the cluster, so that none waits long for the last one."""

QUIET_SECONDS = 0.02
"""When no job came for so long, those that did are cut into chunks."""

MEMORY = 0.2
"""Share of the newest chunk in the mean duration of a run."""


def connect(setup: WorkerSetup) -> Cluster:
    """Connect to the scheduler of a worker setup, or start a cluster on this machine if it names none.

    Raises:
        ConfigError: If the address is none.
        RunError: If no scheduler answers there, or a worker has other versions of the software.
    """
    if not setup.scheduler:
        # Inside this process, for it drives nothing: a process of its own would import the caller's script.
        local = LocalCluster(
            n_workers=1, threads_per_worker=setup.workers, processes=False, dashboard_address=LOOPBACK, memory_limit=0
        )
        return Cluster(Client(local, set_as_default=False), setup, local)
    if not ADDRESS.fullmatch(setup.scheduler):
        raise ConfigError(f"scheduler: expected tcp://HOST:PORT, got {setup.scheduler!r}")
    try:
        client = Client(setup.scheduler, timeout=CONNECT_SECONDS, set_as_default=False)
    except (OSError, ValueError, RuntimeError) as error:
        reason = " ".join(f"{type(error).__name__}: {error}".split())[:100]
        raise RunError(f"{setup.scheduler}: no Dask scheduler answers there ({reason})") from None
    try:
        workers = client.run(software, on_error="return")
        if not workers:
            logging.getLogger(__name__).warning("%s: has no worker yet; waiting for some", setup.scheduler)
        check_workers(workers)
        return Cluster(client, setup)
    except BaseException:
        client.close()
        raise


def check_workers(found: dict[str, Any]) -> None:
    """Refuse workers with other software than is in use here: their results might be others.

    Args:
        found: What :func:`~evolution.files.software` returned on each worker by its address, or what it raised.

    Raises:
        RunError: Naming the first such worker.
    """
    for address, theirs in found.items():
        if isinstance(theirs, BaseException):
            raise RunError(f"worker {address}: mapbench cannot be used there ({theirs})")
        if other := difference(software(), theirs):
            raise RunError(f"worker {address}: {other}")


def difference(wanted: dict[str, str], found: dict[str, str]) -> str:
    """Say how versions, as :func:`~evolution.files.software` returns them, differ; empty if they do not."""
    name = next((name for name in wanted if found.get(name) != wanted[name]), None)
    if name is None:
        return ""
    return f"expected {name} {wanted[name]}, got {found.get(name)}; install the same versions on all workers"


class Call(NamedTuple):
    """A job that was submitted, and the future of its result."""

    function: Callable[[], Any]
    future: Future[Any]


class Chunk(NamedTuple):
    """What comes back for the calls of a chunk: their answers in order, and how many seconds they took."""

    answers: list[Answer]
    seconds: float


class Cluster(Executor):
    """Jobs on the workers of a Dask cluster.

    Args:
        client: Is connected to the scheduler; closed at the end.
        setup: What the workers need.
        local: The cluster to close at the end; None if it is somebody else's.
    """

    def __init__(self, client: Client, setup: WorkerSetup, local: LocalCluster | None = None) -> None:
        self._client, self._local = client, local
        self._plugin = f"mapbench-{uuid.uuid4().hex}"
        client.register_plugin(KeepsProcesses(setup, software()), name=self._plugin)
        self._executor = client.get_executor(pure=False, retries=RETRIES)
        self._calls: queue.SimpleQueue[Call | None] = queue.SimpleQueue()
        self._seconds_per_call = CHUNK_SECONDS
        self._stopped = False
        self._sender = threading.Thread(target=self._send_all, daemon=True)
        self._sender.start()

    def submit(self, fn: Callable[..., T], /, *args: Any, **kwargs: Any) -> Future[T]:
        """Run ``fn`` in a process of some worker; its arguments and its result are pickled.

        Raises:
            RuntimeError: If the executor was shut down.
        """
        if self._stopped:
            raise RuntimeError("the cluster was left")
        future: Future[T] = Future()
        self._calls.put(Call(partial(fn, *args, **kwargs), future))
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Leave the cluster at once; what it does for this executor is stopped."""
        if self._stopped:
            return
        self._stopped = True
        self._calls.put(None)
        self._sender.join()
        with contextlib.suppress(Exception):  # whatever a cluster that is gone makes of it
            self._executor.shutdown(wait=False)
            self._client.unregister_worker_plugin(self._plugin)
        self._client.close()
        if self._local is not None:
            self._local.close()

    def _send_all(self) -> None:
        """Send what is submitted, until the end."""
        for batch in batches(self._calls):
            size = chunk_size(len(batch), self._threads(), self._seconds_per_call)
            for start in range(0, len(batch), size):
                self._send(batch[start : start + size])

    def _threads(self) -> int:
        """Return how many calls the cluster can do at once, as far as is known."""
        with contextlib.suppress(Exception):  # if it is gone, sending says so
            return sum(self._client.nthreads().values())
        return 0

    def _send(self, calls: Sequence[Call]) -> None:
        try:
            content = pickle.dumps([call.function for call in calls])
            sent = self._executor.submit(do_chunk, self._plugin, content)
        except Exception as error:
            _fail(calls, BrokenExecutor(str(error)))
        else:
            sent.add_done_callback(partial(self._deliver, calls))

    def _deliver(self, calls: Sequence[Call], done: Future[Chunk]) -> None:
        """Give everyone who waits for a call of a chunk its answer."""
        error = BrokenExecutor("the scheduler has gone") if done.cancelled() else done.exception()
        if error is not None:
            _fail(calls, error)
            return
        chunk = done.result()
        self._seconds_per_call += MEMORY * (chunk.seconds / len(calls) - self._seconds_per_call)
        for call, answer in zip(calls, chunk.answers, strict=True):
            answer.settle(call.future)


def _fail(calls: Sequence[Call], error: BaseException) -> None:
    """Give an error to all who wait for some calls."""
    for call in calls:
        call.future.set_exception(error)


def batches(calls: queue.SimpleQueue[Call | None]) -> Iterator[list[Call]]:
    """Yield calls that came in one go, until None comes."""
    while (first := calls.get()) is not None:
        batch, going_on = [first], True
        with contextlib.suppress(queue.Empty):
            while (call := calls.get(timeout=QUIET_SECONDS)) is not None:
                batch.append(call)
            going_on = False
        yield batch
        if not going_on:
            return


def chunk_size(calls: int, threads: int, seconds_per_call: float) -> int:
    """Return how many calls to send together.

    Args:
        calls: So many are waiting.
        threads: So many can be done at once.
        seconds_per_call: What one of them takes.
    """
    worth_sending = math.ceil(CHUNK_SECONDS / max(seconds_per_call, 1e-3))
    fair = math.ceil(calls / (CHUNKS_PER_THREAD * max(threads, 1)))
    return min(worth_sending, fair)


@dataclass
class KeepsProcesses(WorkerPlugin):  # type: ignore[misc]
    """Keeps the processes that drive on a Dask worker, and turns a worker away that came with other software.

    Args:
        worker_setup: What the processes need.
        versions: The versions of the software in use where the jobs come from.
    """

    worker_setup: WorkerSetup
    versions: dict[str, str]
    processes: Processes | None = None

    def setup(self, worker: Worker) -> None:
        """Start the processes, which then load their kernels; called for workers that come later, too."""
        if other := difference(self.versions, software()):
            worker.loop.add_callback(partial(worker.close, reason=f"refused: {other}"))
            raise RunError(f"refused: {other}")
        self.processes = Processes(worker.state.nthreads, self.worker_setup.timeout_s, self.worker_setup.prepare)
        self.processes.get_ready()

    def teardown(self, worker: Worker) -> None:
        """Kill the processes, whatever they do."""
        if self.processes is not None:
            self.processes.shutdown()


def do_chunk(plugin: str, content: bytes) -> Chunk:
    """Do the calls of a chunk one after another, in a process of this Dask worker.

    Args:
        plugin: Name of the :class:`KeepsProcesses`.
        content: The calls, pickled.
    """
    processes = get_worker().plugins[plugin].processes
    began = time.perf_counter()
    answers = [_answer(processes.submit(call)) for call in loaded(content)]
    return Chunk(answers, time.perf_counter() - began)


def _answer(future: Future[Any]) -> Answer:
    error = future.exception()
    if isinstance(error, BrokenExecutor):  # nothing can be driven here; Dask tries elsewhere
        raise error
    return Answer(error=error) if error is not None else Answer(future.result())
