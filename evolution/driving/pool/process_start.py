"""How worker processes are started: from a fork server, without the caller's script, with the modules of the caller.

A job names everything it needs by module, so a worker never has to import the script or notebook that asked for it;
``multiprocessing`` would do so at every start, and a script without a ``__main__`` guard would begin itself anew.
"""

from __future__ import annotations

import multiprocessing
import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from multiprocessing import forkserver, popen_forkserver, spawn, util
from multiprocessing.context import BaseContext, ForkServerContext, ForkServerProcess
from multiprocessing.process import BaseProcess
from typing import Any

from evolution.files import temporary_directory

MAIN = ("init_main_from_name", "init_main_from_path")
"""Keys under which a new process is told which script to import."""


def available_cores() -> int:
    """Number of cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def worker_context(modules: Sequence[str] = ()) -> BaseContext:
    """Return the way workers are started: from a *fork server*, or spawned where there is none.

    A fork server is a clean process without threads that starts a worker in milliseconds. Plain ``fork``
    would copy a process with threads (the pool's own, BLAS), which may deadlock.

    Args:
        modules: Names of modules that a fork server imports once for all workers.
    """
    if "forkserver" not in multiprocessing.get_all_start_methods():
        return multiprocessing.get_context("spawn")
    multiprocessing.current_process()._config.setdefault("tempdir", str(temporary_directory()))  # type: ignore[attr-defined]
    context = _Context()
    context.set_forkserver_preload(list(modules))
    return context


@contextmanager
def _without_main() -> Iterator[None]:
    """Keep the caller's script from processes that are started inside the ``with`` block."""
    original = spawn.get_preparation_data

    def without(name: str) -> dict[str, Any]:
        return {key: value for key, value in original(name).items() if key not in MAIN}

    spawn.get_preparation_data = without
    try:
        yield
    finally:
        spawn.get_preparation_data = original


@contextmanager
def _same_modules() -> Iterator[None]:
    """Let processes that are started inside the ``with`` block search modules where this one does.

    A fork server of Python 3.11 to 3.13 is told, and forgets it: it searches the current directory first, so in a clone
    of this repository its workers would drive with the files there, whatever is installed.
    """
    original = util.spawnv_passfds

    def start(path: Any, args: Sequence[Any], passfds: Sequence[int]) -> int:
        *options, program = args
        return original(path, [*options, f"import sys; sys.path[:] = {list(map(str, sys.path))}; {program}"], passfds)

    util.spawnv_passfds = start
    try:
        yield
    finally:
        util.spawnv_passfds = original


class _Popen(popen_forkserver.Popen):
    def _launch(self, process_obj: BaseProcess) -> None:
        with _without_main(), _same_modules():
            super()._launch(process_obj)  # type: ignore[misc]


class _Process(ForkServerProcess):
    @staticmethod
    def _Popen(process_obj: BaseProcess) -> _Popen:  # noqa: N802 - multiprocessing's name
        return _Popen(process_obj)


class _Context(ForkServerContext):
    Process = _Process


def leave_fork_server() -> None:
    """In a worker, let go of the fork server, which ends once no process holds on to it.

    Otherwise each worker would keep the server alive after the parent is gone. A controller that wants a fork server
    starts its own.
    """
    server: Any = forkserver._forkserver
    if server._forkserver_alive_fd is not None:
        os.close(server._forkserver_alive_fd)
        vars(server).update(vars(type(server)()))


def may_have_children() -> None:
    """Let a process that ``multiprocessing`` calls daemonic, as a Dask worker is, start workers.

    Such a process may have no children, because they would outlive it; workers end with whoever started them.
    """
    config: dict[str, Any] = multiprocessing.current_process()._config  # type: ignore[attr-defined]
    config["daemon"] = False
