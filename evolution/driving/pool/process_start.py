"""Starts worker processes: by a fork server, or as new interpreters where a process cannot copy itself.

A job names everything it needs by module, so a worker does not import the script or notebook that asked for it. A
script without a ``__main__`` guard would otherwise run again in every worker.
"""

from __future__ import annotations

import atexit
import contextlib
import multiprocessing
import os
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess

from evolution.driving.pool.fork_server import become_fork_server, prepare_to_be_copied
from evolution.driving.pool.worker_loop import serve
from evolution.one_thread import ONE_THREAD

SERVER_COMMAND = (
    "import gc, sys; gc.disable(); sys.path[:] = {path!r}; "
    "from evolution.driving.pool.fork_server import become_fork_server, prepare_to_be_copied; "
    "prepare_to_be_copied(); become_fork_server({descriptor})"
)
"""The fork server's program; the server finds modules where the process that starts it does."""

KILL = getattr(signal, "SIGKILL", signal.SIGTERM)
END_SECONDS = 5.0
"""How long to wait for the end of a process that was killed, or that has closed its pipe, s."""


def available_cores() -> int:
    """Return the number of cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@dataclass(frozen=True)
class WorkerProcess:
    """A worker process, as the process that started it sees it.

    Args:
        pid: Number of the process, and of the process group that it leads.
        pipe: Takes jobs and gives answers.
        sentinel: Can be waited for; ready once the process has ended.
        read_exit_code: Returns the exit code once the process has ended.
    """

    pid: int
    pipe: Connection
    sentinel: Connection | int
    read_exit_code: Callable[[], int | None]

    def exit_code(self) -> int | None:
        """Return the exit code, negative for the number of a signal; None if the process does not end soon."""
        return self.read_exit_code() if self._ends_within(END_SECONDS) else None

    def kill(self) -> None:
        """Kill the process and its process group."""
        with contextlib.suppress(ProcessLookupError):
            if not self._ends_within(0.0):
                os.kill(self.pid, KILL)
        with contextlib.suppress(ProcessLookupError):
            if hasattr(os, "killpg"):
                os.killpg(self.pid, KILL)

    def end(self) -> None:
        """Kill the process and its process group, wait until the process has ended, and close the pipe to it."""
        self.kill()
        self._ends_within(END_SECONDS)
        self.pipe.close()

    def _ends_within(self, seconds: float) -> bool:
        return bool(wait([self.sentinel], seconds))


def start_worker_process(prepare: Callable[[], object]) -> WorkerProcess:
    """Start a worker process.

    Args:
        prepare: Called in the worker before its first job; can be pickled.

    Raises:
        OSError: If no process can be started.
    """
    process = _start()
    process.pipe.send((sys.path, os.getcwd()))
    process.pipe.send(prepare)
    return process


def copy_for_workers() -> None:
    """Start the fork server as a copy of this process, which saves it all imports.

    To be called before this process has threads or holds locks, because the copy would hold them for ever. Where no
    process can copy itself, the server starts with the first worker.
    """
    if hasattr(os, "fork") and not _FORK_SERVER.is_started:
        prepare_to_be_copied()
        with contextlib.suppress(OSError):
            _FORK_SERVER.start_as_copy()


@dataclass(frozen=True)
class _Copy:
    """A copy of this process, with those methods of ``subprocess.Popen`` that are needed."""

    pid: int

    def kill(self) -> None:
        os.kill(self.pid, KILL)

    def wait(self) -> None:
        os.waitpid(self.pid, 0)


class _ForkServerClient:
    """The fork server of this process; started with the first worker, and again if it has died."""

    _requests: socket.socket | None = None
    _server: subprocess.Popen[bytes] | _Copy | None = None

    def __init__(self) -> None:
        self._lock = threading.Lock()

    @property
    def is_started(self) -> bool:
        """Whether there is a server."""
        return self._requests is not None

    def forget(self) -> None:
        """Forget the server: a copy of this process needs its own, because workers end with the process that asks."""
        if self._requests is not None:
            self._requests.close()
        self._requests = self._server = None
        self._lock = threading.Lock()

    def start_worker(self) -> WorkerProcess:
        """Have the fork server start a worker.

        Raises:
            OSError: If it cannot.
        """
        pipe, pipe_of_worker = multiprocessing.Pipe()
        report, report_of_server = multiprocessing.Pipe(duplex=False)
        with pipe_of_worker, report_of_server:
            self._request([pipe_of_worker.fileno(), report_of_server.fileno()])
        pid = _received(report)
        if pid is None:
            raise OSError("the fork server cannot start a process")
        return WorkerProcess(pid, pipe, report, partial(_received, report))

    def start_as_copy(self) -> None:
        """Start the server as a copy of this process."""
        requests, requests_of_server = socket.socketpair()
        with requests_of_server:
            pid = os.fork()
            if pid == 0:
                requests.close()
                become_fork_server(requests_of_server.detach())
        self._requests, self._server = requests, _Copy(pid)

    def stop(self) -> None:
        """Kill the fork server; workers die with it."""
        if self._server is not None and self._requests is not None:
            self._requests.close()
            self._server.kill()
            self._server.wait()
            self._requests = self._server = None

    def _request(self, descriptors: list[int]) -> None:
        """Send a request, to a new server if there is none that takes it."""
        with self._lock:
            if self._requests is not None:
                with contextlib.suppress(BrokenPipeError):
                    socket.send_fds(self._requests, [b"w"], descriptors)
                    return
            self.stop()
            self._requests = self._start()
            socket.send_fds(self._requests, [b"w"], descriptors)

    def _start(self) -> socket.socket:
        """Start a server; returns the socket that takes requests."""
        requests, requests_of_server = socket.socketpair()
        with requests_of_server:
            descriptor = requests_of_server.fileno()
            command = [sys.executable, "-c", SERVER_COMMAND.format(path=sys.path, descriptor=descriptor)]
            environment = {**ONE_THREAD, **os.environ}
            self._server = subprocess.Popen(command, pass_fds=[descriptor], process_group=0, env=environment)
        return requests


def _received(report: Connection) -> int | None:
    """Return the next number in a report of the fork server; None if the server has died."""
    try:
        return int(report.recv())
    except (EOFError, OSError):
        return None


def start_interpreter() -> WorkerProcess:
    """Start a worker as a new interpreter, where a process cannot copy itself (Windows)."""
    context = multiprocessing.get_context("spawn")
    pipe, pipe_of_worker = context.Pipe()
    process = context.Process(target=serve, args=(pipe_of_worker,))
    with _SPAWNING, pipe_of_worker:
        process.start()
    return WorkerProcess(int(process.pid or 0), pipe, process.sentinel, partial(_exit_code_of, process))


def _exit_code_of(process: BaseProcess) -> int | None:
    process.join(END_SECONDS)
    return process.exitcode


_SPAWNING = threading.Lock()
"""Held while ``multiprocessing`` starts a process: its list of processes is not safe for threads."""

_FORK_SERVER = _ForkServerClient()
atexit.register(_FORK_SERVER.stop)
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_FORK_SERVER.forget)
_start = _FORK_SERVER.start_worker if hasattr(os, "fork") else start_interpreter
