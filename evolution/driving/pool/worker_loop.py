"""The loop of a worker process: it reads a job from its pipe, runs it and sends the answer, until the pipe is closed.

A worker ends with the process that asked for it, whatever the worker is doing then. What controllers print goes to
standard error, so that standard output holds the results of a command and nothing else.
"""

from __future__ import annotations

import contextlib
import ctypes
import multiprocessing
import os
import pickle
import select
import signal
import sys
import threading
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Any

from evolution.one_thread import use_one_thread

READY = "ready"
"""The first message of a worker, sent once it is prepared."""

MAX_ANSWER_BYTES = 1_000_000
MAX_MEMORY_BYTES = 4_000_000_000 + 100_000_000 * (os.cpu_count() or 1)
"""Limit of a worker's data: a worker that drives takes about 400 MB, one with a learned policy 1 GB, and numeric
libraries reserve memory for every core."""

SET_DEATH_SIGNAL = 1
"""``PR_SET_PDEATHSIG`` of Linux's ``prctl``."""


class NotStartedError(Exception):
    """A worker process can run no job: its preparation failed, or it cannot read the job."""


@dataclass(frozen=True)
class Answer:
    """What a worker sends back for a job.

    Args:
        value: What the job returned; None if it raised.
        error: What the job raised; None if it returned.
        left_children: Whether the job left a child process behind.
    """

    value: Any = None
    error: BaseException | None = None
    left_children: bool = False

    def settle(self, future: Future[Any]) -> None:
        """Set the result or the exception of a future."""
        if self.error is None:
            future.set_result(self.value)
        else:
            future.set_exception(self.error)


def serve(pipe: Connection) -> None:
    """Be a worker process, of one thread: prepare, then run jobs until the pipe is closed.

    Args:
        pipe: Gives where to search modules, the current directory, the function that prepares the worker, and jobs
            (each a function and its arguments, pickled). Takes the answers, pickled.
    """
    use_one_thread()
    _set_up_process(pipe)
    sys.path[:], folder = pipe.recv()
    os.chdir(folder)
    prepare: Callable[[], object] = pipe.recv()
    prepare()
    pipe.send(READY)
    me = os.getpid()
    with contextlib.suppress(EOFError, OSError):  # the parent has closed the pipe, or a controller has
        while True:
            answer = _answer(pipe.recv_bytes())
            if os.getpid() != me:  # a copy of this process that the job made, and that came back from it
                os._exit(0)
            pipe.send_bytes(answer)


def belong_to_parent() -> None:
    """Make a process that ``multiprocessing`` has started end with its parent, and print to standard error."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        _exit_after(parent.join)
        _print_to_standard_error()


def _set_up_process(pipe: Connection) -> None:
    """Lead a process group, ignore Ctrl-C, write no core files, limit the memory, and end with the parent.

    A worker inside a kernel that holds Python's lock runs no other thread. The fork server ends with the parent, and
    Linux then kills the worker. It also kills copies that a controller makes of the worker, once the worker has ended.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if os.name != "posix":
        return
    import resource

    os.setpgid(0, 0)
    for kind, most in ((resource.RLIMIT_CORE, 0), (resource.RLIMIT_DATA, MAX_MEMORY_BYTES)):
        hard = resource.getrlimit(kind)[1]
        resource.setrlimit(kind, (most if hard == resource.RLIM_INFINITY else min(most, hard), hard))
    os.register_at_fork(after_in_child=_die_with_creator)
    _die_with_creator()
    hang_up = select.poll()
    hang_up.register(pipe.fileno(), 0)
    _exit_after(hang_up.poll)
    _print_to_standard_error()


def _exit_after(wait: Callable[[], object]) -> None:
    """End this process as soon as a function returns."""

    def exit_then() -> None:
        wait()
        os._exit(1)

    threading.Thread(target=exit_then, daemon=True).start()


def _print_to_standard_error() -> None:
    sys.stdout.flush()
    os.dup2(2, 1)


def _die_with_creator() -> None:
    """Ask the system to kill this process when the process that made it ends; only Linux can."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(SET_DEATH_SIGNAL, signal.SIGKILL)


def _answer(job: bytes) -> bytes:
    """Run a pickled job and return its pickled answer."""
    value, failure = None, None
    try:
        value = loaded(job)()
    except BaseException as error:
        failure = error
    return _pickled(value, failure, _has_children())


def loaded(content: bytes) -> Any:
    """Unpickle what a worker was sent; raises :class:`NotStartedError` if it names what cannot be imported here."""
    try:
        return pickle.loads(content)
    except Exception as error:
        raise NotStartedError(f"{type(error).__name__}: {error}") from None


def _pickled(value: Any, error: BaseException | None, left_children: bool) -> bytes:
    """Pickle an answer; one that cannot be sent, or is too large, becomes an error."""
    try:
        pickled = pickle.dumps(Answer(value, error, left_children))
    except Exception as problem:
        unsent = TypeError(f"the answer cannot be sent ({problem})")
        pickled = pickle.dumps(Answer(error=unsent, left_children=left_children))
    if len(pickled) > MAX_ANSWER_BYTES:
        large = ValueError(f"expected an answer of at most {MAX_ANSWER_BYTES} bytes, got {len(pickled)}")
        pickled = pickle.dumps(Answer(error=large, left_children=left_children))
    return pickled


def _has_children() -> bool:
    """Return whether this process has a child left; clear away children that have ended."""
    if os.name != "posix":
        return False
    try:
        while os.waitpid(-1, os.WNOHANG) != (0, 0):
            pass
    except ChildProcessError:
        return False
    return True
