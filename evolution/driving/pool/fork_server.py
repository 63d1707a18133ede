"""The fork server: a process that copies itself into a worker.

A worker starts in milliseconds that way, because the server has imported this package already. A copy of the process
that asks for the worker would also copy that process' threads and locks, and could deadlock. The server of a command is
a copy of the command, made before that has threads; the server of a script is a new process.
"""

from __future__ import annotations

import contextlib
import gc
import os
import select
import signal
import socket
import sys
from multiprocessing.connection import Connection
from typing import NoReturn

from evolution.driving.pool.worker_loop import serve
from gym_mapbench.kernels.geometry import normalize_angle

STANDARD_INPUT = 0


def prepare_to_be_copied() -> None:
    """Do what every copy of this process would do for itself: numba loads what all kernels need when one is called.

    Garbage collection passes over what is there: to look at it would also copy its memory.
    """
    with contextlib.suppress(Exception):  # the warm-up of a worker fails for the same reason, and says it
        normalize_angle(0.0)
    gc.freeze()
    gc.enable()


def become_fork_server(descriptor: int) -> NoReturn:
    """Be a fork server until the process that asks for workers has ended, and end with it.

    It has a process group of its own, so that Ctrl-C does not reach it, and reads nothing. It stands in no folder that
    somebody may want to unmount; a worker goes where the process that asks for it is.

    Args:
        descriptor: The socket from which requests come.
    """
    exit_code = 1
    try:
        os.setpgid(0, 0)
        os.chdir("/")
        with open(os.devnull) as nothing:
            os.dup2(nothing.fileno(), STANDARD_INPUT)
        ForkServer(descriptor).run()
        exit_code = 0
    except BaseException:
        sys.excepthook(*sys.exc_info())
    finally:
        os._exit(exit_code)


class ForkServer:
    """Starts a worker for every request, until the process that asks for workers has ended.

    A request is one byte with two file descriptors: the worker's end of its pipe, and a pipe for reports. The server
    reports the worker's process number at its start and its exit code at its end.

    Args:
        descriptor: The socket from which requests come.
    """

    def __init__(self, descriptor: int) -> None:
        self._requests = socket.socket(fileno=descriptor)
        self._reports: dict[int, Connection] = {}
        self._child_ended, self._wakeup = os.pipe()
        os.set_blocking(self._wakeup, False)
        signal.set_wakeup_fd(self._wakeup)
        signal.signal(signal.SIGCHLD, lambda *_: None)

    def run(self) -> None:
        """Serve requests."""
        while True:
            ready, _, _ = select.select([self._requests.fileno(), self._child_ended], [], [])
            if self._child_ended in ready:
                os.read(self._child_ended, 4096)
                self._report_exit_codes()
            if self._requests.fileno() in ready:
                _, descriptors, _, _ = socket.recv_fds(self._requests, 1, 2)
                if not descriptors:
                    return
                self._start_worker(*map(Connection, descriptors))

    def _start_worker(self, pipe: Connection, report: Connection) -> None:
        """Copy this process into a worker; closes ``report`` without a report if no process can be started."""
        with pipe, contextlib.suppress(OSError):
            pid = os.fork()
            if pid == 0:
                report.close()
                self._become_worker(pipe)
            self._reports[pid] = report
            report.send(pid)

    def _become_worker(self, pipe: Connection) -> NoReturn:
        """Close what belongs to the server, serve jobs, and end this process."""
        exit_code = 1
        try:
            signal.set_wakeup_fd(-1)
            signal.signal(signal.SIGCHLD, signal.SIG_DFL)
            for descriptor in (self._requests.detach(), self._child_ended, self._wakeup):
                os.close(descriptor)
            for report in self._reports.values():
                report.close()
            os.set_inheritable(pipe.fileno(), False)
            serve(pipe)
            exit_code = 0
        except BaseException:
            sys.excepthook(*sys.exc_info())
        finally:
            os._exit(exit_code)

    def _report_exit_codes(self) -> None:
        """Report the exit codes of the workers that have ended, and forget these workers."""
        while self._reports:
            pid, status = os.waitpid(-1, os.WNOHANG)
            if pid == 0:
                return
            with self._reports.pop(pid) as report, contextlib.suppress(BrokenPipeError):
                report.send(os.waitstatus_to_exitcode(status))
