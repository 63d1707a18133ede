"""Faults of a controller that damage its worker process, besides those of :mod:`tests.evolution.fake_runs`."""

from __future__ import annotations

import ctypes
import os
import signal
import subprocess
import sys
import threading
import time
from dataclasses import replace
from pathlib import Path

from evolution.driving.jobs import Job, RunResult
from tests.evolution import fake_runs


class UnprintableError(Exception):
    """Raises when it is printed."""

    def __str__(self) -> str:
        raise ValueError("no words")


class UnpicklableError(Exception):
    """Raises when it is pickled."""

    def __reduce__(self):
        raise TypeError("stay here")


def raising(error: BaseException):
    """Return a function that raises an error."""

    def fail() -> None:
        raise error

    return fail


def recurse(so_far: tuple) -> None:
    """Call itself without end."""
    recurse((*so_far, 1))


def recurse_with_memory() -> None:
    """Call itself without end, and take memory each time."""
    sys.setrecursionlimit(10**8)
    kept = []

    def again() -> None:
        kept.append(bytes(10**8))
        again()

    again()


def write_into_every_file() -> None:
    """Write garbage into whatever is open, the pipe to the parent among it."""
    for number in range(3, 64):
        try:
            os.write(number, b"\xff" * 64)
        except OSError:
            continue


FAULTS = {
    "aborts": os.abort,
    "reads_address_0": lambda: ctypes.string_at(0),
    "stops_itself": lambda: os.kill(os.getpid(), signal.SIGSTOP),
    "terminates": lambda: os.kill(os.getpid(), signal.SIGTERM),
    "is_woken_by_an_alarm": lambda: (signal.alarm(1), time.sleep(600)),
    "takes_memory": lambda: bytearray(10**11),
    "recurses_with_memory": recurse_with_memory,
    "recurses": lambda: recurse(()),
    "presses_ctrl_c": raising(KeyboardInterrupt()),
    "ends_a_generator": raising(GeneratorExit()),
    "cannot_say_why": raising(UnprintableError()),
    "cannot_send_why": raising(UnpicklableError()),
    "says_too_much": raising(ValueError("x" * 10**7)),
    "speaks_to_the_terminal": raising(ValueError("\x1b[31m[/x]\n\ud800")),
    "writes_garbage": write_into_every_file,
}
HARMLESS = {
    "goes_elsewhere": lambda: os.chdir("/"),
    "leaves_a_thread": lambda: threading.Thread(target=time.sleep, args=(600,), daemon=True).start(),
    "leaves_a_program": lambda: subprocess.Popen(["sleep", "600"]),
    "closes_its_output": lambda: (os.close(1), os.close(2)),
    "prints_much": lambda: [os.write(1, b"." * 99 + b"\n") for _ in range(3)],
    "ignores_signals": lambda: signal.signal(signal.SIGTERM, signal.SIG_IGN),
    "forgets_environment": os.environ.clear,
    "deletes_its_folder": lambda: os.chdir(_deleted_folder()),
}
"""Faults that cost no run."""


def _deleted_folder() -> Path:
    path = Path(f"/tmp/deleted-{os.getpid()}")
    path.mkdir(exist_ok=True)
    threading.Timer(0.05, path.rmdir).start()
    return path


def misbehave(job: Job) -> RunResult:
    """Run a job; a controller with the name of a fault shows that fault."""
    name = job.controller.name
    if name == "answers_too_much":
        return replace(fake_runs.drive(job), reason="x" * 10**8)
    if name == "answers_with_something_else":
        return "goal"  # type: ignore[return-value]
    {**FAULTS, **HARMLESS}.get(name, lambda: None)()
    return fake_runs.misbehave(job)
