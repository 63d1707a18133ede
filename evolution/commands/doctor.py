"""``mapbench doctor``: versions, compiled kernels, speed, and packages that are not installed."""

from __future__ import annotations

import argparse
import shutil
import sys
import time
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, requires, version

import numpy as np
from packaging.requirements import Requirement

from evolution.commands import options
from evolution.commands.console import note
from evolution.driving import (
    DriveSettings,
    Job,
    JobPlan,
    available_cores,
    calibration_loop,
    clear_kernels,
    compiled_kernels,
    drive,
)
from evolution.files import counted, version_lines
from evolution.search import DEFAULT_CONTROLLERS, controllers_from
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.errors import ConfigError
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.scenario import Pose, Scenario

EXAMPLES = """  mapbench doctor                     what to send with a question
  mapbench doctor --clear-kernels     after a change of a kernel that other kernels call"""
SECONDS = 2.0
PLAN = JobPlan(
    controllers_from(DEFAULT_CONTROLLERS),
    DriveSettings(environment=EnvConfig(time_limit=SECONDS, noise="nominal"), navigation="thesis"),
)
ROOM = Scenario(GridMap(np.zeros((200, 200), np.bool_), 0.05), Pose(1.0, 1.0), Pose(9.0, 9.0), "empty room")
"""A room that no robot crosses in :data:`SECONDS`."""

DRIVES = 5
BUSY = 0.8
"""Share of a core below which the machine counts as busy."""


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the subcommand."""
    parser = options.example_parser(subparsers, "doctor", EXAMPLES)
    parser.add_argument(
        "--clear-kernels",
        action="store_true",
        help="delete the compiled kernels and do nothing else; numba compiles them again at the next run",
    )
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Print everything about the installation, or delete its compiled kernels."""
    if args.clear_kernels:
        print(clear_kernels())
        return 0
    lines = [", ".join(version_lines()), f"{sys.platform}, {counted(available_cores(), 'core')}", *_kernels()]
    print("\n".join(lines), flush=True)
    note("measuring the speed; kernels that are not compiled are compiled first")
    for line in (*_speed(), *_missing()):
        print(line, flush=True)
    return 0


def _kernels() -> Iterator[str]:
    """Say how many kernels are compiled."""
    try:
        compiled, count = compiled_kernels()
    except ConfigError:
        yield "kernels: NUMBA_DISABLE_JIT is set, so nothing is compiled and everything is hundreds of times slower"
        return
    yield f"kernels: {compiled} of {count} compiled; numba compiles the others when they are first used"


def _speed() -> Iterator[str]:
    """Return the processor time of a run with each controller, set-up included, in words."""
    wall, busy = time.perf_counter(), time.process_time()
    for number, kind in enumerate(PLAN.names):
        job = PLAN.job(ROOM, number, 0)
        drive(job)  # loads the kernels, or compiles them
        seconds = min(_processor_seconds(job) for _ in range(DRIVES))
        turns = seconds / min(calibration_loop() for _ in range(DRIVES))
        yield (
            f"{kind}: a run of {SECONDS:g} s takes {1e3 * seconds:.0f} ms of the processor "
            f"({round(SECONDS / seconds, 1):g} times real time), or {turns / 1e6:.2g} million turns of the calibration "
            "loop"
        )
    share = (time.process_time() - busy) / (time.perf_counter() - wall)
    if share < BUSY:
        yield f"the machine is busy: this process got {100 * share:.0f} % of a core, so everything takes longer"


def _processor_seconds(job: Job) -> float:
    began = time.process_time()
    drive(job)
    return time.process_time() - began


def _missing() -> Iterator[str]:
    """Say for every extra which of its packages are missing, and whether ``ffmpeg`` is installed."""
    lines = [Requirement(line) for line in requires("gym-mapbench") or []]
    extras = sorted({name for one in lines for name in _extras_of(one)})
    for extra in extras:
        absent = [one.name for one in lines if extra in _extras_of(one) and not _installed(one.name)]
        state = f"not installed: {', '.join(absent)} (pip install 'gym-mapbench[{extra}]')" if absent else "complete"
        yield f"extra {extra}: {state}"
    yield "ffmpeg: " + ("found" if shutil.which("ffmpeg") else "not found; --mp4 needs it, --gif does not")


def _extras_of(requirement: Requirement) -> list[str]:
    """Return the extra that a requirement belongs to, if it applies here."""
    marker = requirement.marker
    if marker is None:
        return []
    named = [part.strip(" '\"") for part in str(marker).split("extra ==")[1:]]
    return [name for name in named if marker.evaluate({"extra": name})]


def _installed(name: str) -> bool:
    try:
        version(name)
    except PackageNotFoundError:
        return False
    return True
