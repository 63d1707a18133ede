"""What a worker process does: it takes jobs from its pipe one by one and answers each, until the pipe is closed.

It ends with the process that asked for it, whatever it is doing then. What controllers print goes to standard error, so
that standard output holds the results of a command and nothing else.
"""

from __future__ import annotations

import contextlib
import ctypes
import multiprocessing
import os
import pickle
import signal
import sys
import threading
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Any

from evolution.driving.pool.process_start import leave_fork_server

READY = "ready"
"""What a worker says before its first job, once it is prepared."""

MAX_ANSWER_BYTES = 1_000_000
MAX_MEMORY_BYTES = 4_000_000_000 + 100_000_000 * (os.cpu_count() or 1)
"""Data of a worker: one that drives takes some 400 MB, one with a learned policy 1 GB, and numeric libraries set memory
apart for every core."""

SET_DEATH_SIGNAL = 1
"""``PR_SET_PDEATHSIG`` of Linux's ``prctl``."""


class NotStartedError(Exception):
    """A worker process can drive nothing: its preparation failed, or it cannot read a job."""


@dataclass(frozen=True)
class Answer:
    """What a worker sends back for a job.

    Args:
        value: What the job returned; None if it raised.
        error: What it raised; None if it returned.
        alone: Whether it left no process behind.
    """

    value: Any = None
    error: BaseException | None = None
    alone: bool = True

    def settle(self, future: Future[Any]) -> None:
        """Give the answer to whoever waits for the job."""
        if self.error is None:
            future.set_result(self.value)
        else:
            future.set_exception(self.error)


def serve(connection: Connection, prepare: Callable[[], object]) -> None:
    """Be a worker process.

    Args:
        connection: Gives jobs, as a function and its arguments, and takes their answers.
        prepare: Called once, before the first job.
    """
    _be_a_worker()
    prepare()
    connection.send(READY)
    me = os.getpid()
    with contextlib.suppress(EOFError, OSError):  # the parent has closed the pipe, or a controller has
        while True:
            answer = _answer(connection.recv_bytes())
            if os.getpid() != me:  # a copy of this process that the job made, and that came back from it
                os._exit(0)
            connection.send_bytes(answer)


def belong_to_parent() -> None:
    """Make a worker process of any executor end with its parent, and print to standard error."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_exit_after, args=(parent.join,), daemon=True).start()
        sys.stdout.flush()
        os.dup2(2, 1)


def _exit_after(wait: Callable[[], object]) -> None:
    wait()
    os._exit(1)


def _be_a_worker() -> None:
    """Lead a process group, ignore Ctrl-C, write no core files, take no more memory than allowed, die with the parent.

    A worker inside a kernel that holds Python's lock runs no other thread. The fork server ends with the parent, and
    the system then kills the worker; it also kills copies that a controller makes of it, once the worker is gone.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if os.name != "posix":
        return
    import resource

    os.setpgid(0, 0)
    for kind, most in ((resource.RLIMIT_CORE, 0), (resource.RLIMIT_DATA, MAX_MEMORY_BYTES)):
        hard = resource.getrlimit(kind)[1]
        resource.setrlimit(kind, (most if hard == resource.RLIM_INFINITY else min(most, hard), hard))
    leave_fork_server()
    os.register_at_fork(after_in_child=_die_with_creator)
    _die_with_creator()


def _die_with_creator() -> None:
    """Ask the system to kill this process when the one that made it ends; only Linux can."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(SET_DEATH_SIGNAL, signal.SIGKILL)


def _answer(job: bytes) -> bytes:
    """Do a pickled job; returns its pickled answer."""
    value, failure = None, None
    try:
        function, args = _loaded(job)
        value = function(*args)
    except BaseException as error:
        failure = error
    return _pickled(value, failure, alone=_is_alone())


def _loaded(job: bytes) -> tuple[Callable[..., Any], tuple[Any, ...]]:
    """Read a job; raises :class:`NotStartedError` if it names what cannot be imported here."""
    try:
        function, args = pickle.loads(job)
    except Exception as error:
        raise NotStartedError(f"{type(error).__name__}: {error}") from None
    return function, args


def _pickled(value: Any, error: BaseException | None, *, alone: bool) -> bytes:
    """Pickle an answer; one that cannot be sent, or is too large, becomes an error."""
    try:
        pickled = pickle.dumps(Answer(value, error, alone))
    except Exception as problem:
        pickled = pickle.dumps(Answer(error=TypeError(f"the answer cannot be sent ({problem})"), alone=alone))
    if len(pickled) > MAX_ANSWER_BYTES:
        large = ValueError(f"expected an answer of at most {MAX_ANSWER_BYTES} bytes, got {len(pickled)}")
        pickled = pickle.dumps(Answer(error=large, alone=alone))
    return pickled


def _is_alone() -> bool:
    """Whether this process has no child left; children that have ended are cleared away."""
    if os.name != "posix":
        return True
    try:
        while os.waitpid(-1, os.WNOHANG) != (0, 0):
            pass
    except ChildProcessError:
        return True
    return False
