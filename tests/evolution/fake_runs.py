"""Runs without a robot: outcomes and times that depend on the job alone, and controllers that misbehave."""

from __future__ import annotations

import ctypes
import importlib
import os
import signal
import sys
import time
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from evolution.driving.jobs import ControllerSpec, Job, RunResult
from evolution.driving.pool import WorkerSetup
from evolution.driving.settings import DriveSettings
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.generator import ShapeSettings
from gym_mapbench.world.robot import RobotSpec, make_robot

WAFFLE = make_robot("turtlebot3_waffle")
SMALL = ShapeSettings(
    size=30,
    n_obstacles=(3, 8),
    circle_radius=(1, 3),
    square_side=(2, 4),
    wall_length=(3, 8),
    task_distance=2,
    cleared_distance=2,
)
WORKERS = "evolution.driving.executors:_processes"
"""The worker processes, also where a test has put something else in their place."""
IN_PROCESS = "tests.evolution.fake_runs:InProcess"
CONTROLLERS = tuple(ControllerSpec(name=name) for name in ("dwb", "mppi", "rpp"))


WORLD = DriveSettings(navigation="thesis", environment=EnvConfig(robot=RobotSpec(radius=0.05)))
"""A world whose robot fits on small maps; nothing drives in it."""


def drive(job: Job) -> RunResult:
    """Time and outcome from the job's seed; harder maps take longer."""
    rng = np.random.default_rng(job.seed)
    share = float(job.scenario.map.occupancy.mean())
    time_s = float(5.0 + 20.0 * share + rng.gamma(2.0, 2.0))
    outcome = "timeout" if rng.random() < 0.05 else "goal"
    return RunResult(
        outcome, time_s, 0.5 * time_s, seed=job.seed, metrics={"clearance": share}, timings={"wall": time.monotonic()}
    )


def drive_slowly(job: Job) -> RunResult:
    """As :func:`drive`, slowly enough to be interrupted."""
    time.sleep(0.002)
    return drive(job)


def process_of(job: Job) -> tuple[str, int]:
    """Return the job's key and the number of the process that was asked."""
    return job.key, os.getpid()


def large_answer(job: Job) -> tuple[str, bytes]:
    """Return the job's key, and more than a worker can send."""
    return job.key, bytes(10**7)


def overflow_the_stack() -> None:
    """Call itself through C until the stack of the process is full."""
    sys.setrecursionlimit(10**8)
    call_again = ctypes.CFUNCTYPE(ctypes.c_int)(lambda: call_again())  # noqa: PLW0108 - the name is bound by then
    call_again()


def leave_a_child() -> int:
    """Leave a copy of this process behind that sleeps; returns its number."""
    child = os.fork()
    if child == 0:
        time.sleep(600)
    return child


def print_everywhere() -> None:
    """Print from Python, from C, and to the file descriptor."""
    print("a controller says hello")
    os.write(1, b"so does its library\n")
    ctypes.CDLL(None).puts(b"in C")


FAULTS = {
    "exits_at_once": lambda: os._exit(0),
    "overflows": overflow_the_stack,
    "leaves_a_child": leave_a_child,
    "returns_twice": os.fork,
    "closes_all": lambda: os.closerange(3, 1000),
    "holds_the_lock": lambda: ctypes.PyDLL(None).sleep(600),
    "prints": print_everywhere,
}
"""What a controller may do to its process, by the controller's name."""


def misbehave(job: Job) -> RunResult:
    """As :func:`drive`, but controllers named after a fault show it."""
    name, params = job.controller.name, job.controller.params
    if name == "raises":
        raise ValueError("the costmap\nis upside down")
    if name == "exits":
        raise SystemExit(3)
    if name == "hangs":
        time.sleep(600)
    if name == "kills":
        os.kill(os.getpid(), signal.SIGKILL)
    if name == "fails_once":
        mark = Path(str(params["mark"]))
        if not mark.exists():
            mark.touch()
            os.kill(os.getpid(), signal.SIGKILL)
    if name == "tells_its_child":
        Path(str(params["mark"])).write_text(str(leave_a_child()))
    if name == "leaves_a_child_and_hangs":
        leave_a_child()
        time.sleep(600)
    if name in FAULTS:
        FAULTS[name]()
    if name == "wrong_type":
        return None  # type: ignore[return-value]
    return drive(job)


def interrupt_parent(job: Job) -> RunResult:
    """Press Ctrl-C in the parent, then hang."""
    os.kill(int(str(job.controller.params["parent"])), signal.SIGINT)
    time.sleep(600)
    return drive(job)


def broken_warm_up() -> None:
    """Fail as a kernel that cannot be compiled."""
    raise ImportError("no LLVM here")


def touch_warm_up() -> None:
    """Leave a mark that a worker was warmed up."""
    os.environ["WARMED_UP"] = "yes"


def tell_warmth(job: Job) -> RunResult:
    """Report whether this worker was warmed up."""
    return RunResult("goal", 1.0, 1.0, reason=os.environ.get("WARMED_UP", "no"))


def noisy(job: Job) -> RunResult:
    """As :func:`drive`; where the world is noisy, one run in four is a timeout, and all others take longer."""
    result = drive(job)
    recoveries = {"n_recoveries": float(job.seed % 3)}
    if job.settings.model_dump()["environment"]["noise"]["scan"] == 0:
        return replace(result, outcome="goal", metrics=recoveries)
    outcome = "timeout" if job.seed % 4 == 0 else "goal"
    return replace(result, outcome=outcome, time_s=1.2 * result.time_s, metrics=recoveries)


def plain_pool(setup: WorkerSetup) -> Executor:
    """Make the standard library's own pool."""
    context = get_context("forkserver")
    context.set_forkserver_preload([__name__])
    return ProcessPoolExecutor(setup.workers, mp_context=context, initializer=setup.prepare)


class InProcess(Executor):
    """Runs each job where it is submitted, without a warm-up: for runs that take no time."""

    def __init__(self, _setup: WorkerSetup) -> None:
        """Need no setup."""

    def submit(self, function, /, *arguments, **options):
        """Return the finished future of a call."""
        future: Future[RunResult] = Future()
        try:
            future.set_result(function(*arguments, **options))
        except Exception as error:
            future.set_exception(error)
        return future


def no_pool(setup: WorkerSetup) -> Executor:
    """Fail to make one."""
    raise OSError("the cluster is closed on Sundays")


def die_at_first(starts: Path) -> None:
    """Kill a new worker before its first run, but the fifth and all after it live; the starts are marked in a file."""
    with starts.open("a") as file:
        file.write("x")
    if len(starts.read_text()) < 5:
        os.kill(os.getpid(), signal.SIGKILL)


def never(job: Job) -> RunResult:
    """Never reach the goal."""
    return replace(drive(job), outcome="timeout")


def file_of(module: str) -> str:
    """Say where a worker has a module from."""
    return str(importlib.import_module(module).__file__)
