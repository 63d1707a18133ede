"""``mapbench doctor``: versions, compiled kernels, speed, and packages that are not installed."""

from __future__ import annotations

import argparse
import logging
import os
import pkgutil
import shutil
import sys
import time
from collections.abc import Iterator
from importlib import import_module
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path
from typing import Any

import numpy as np
from packaging.requirements import Requirement

import controllers
import gym_mapbench
from evolution.commands import options
from evolution.commands.console import note
from evolution.driving import DriveSettings, Job, JobPlan, available_cores, calibration_loop, drive
from evolution.files import version_lines
from evolution.search import DEFAULT_CONTROLLERS, controllers_from
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.errors import ConfigError, RunError
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.scenario import Pose, Scenario

LOG = logging.getLogger(__name__)
EXAMPLES = """  mapbench doctor                     what to send with a question
  mapbench doctor --clear-kernels     after a change of a kernel that other kernels call"""
SECONDS = 2.0
PLAN = JobPlan(
    controllers_from(DEFAULT_CONTROLLERS),
    DriveSettings(environment=EnvConfig(time_limit=SECONDS, noise="nominal"), navigation="thesis"),
)
ROOM = Scenario(GridMap(np.zeros((200, 200), np.bool_), 0.05), Pose(1.0, 1.0), Pose(9.0, 9.0), "empty room")
"""A room that no robot crosses in :data:`SECONDS`."""

COMPILED = ("*.nbi", "*.nbc")
"""Files of a compiled kernel: its index, and its machine code for some types of arguments."""
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
    lines = [", ".join(version_lines()), f"{sys.platform}, {available_cores()} cores", *_kernels()]
    print("\n".join(lines), flush=True)
    note("measuring the speed; kernels that are not compiled are compiled first")
    for line in (*_speed(), *_missing()):
        print(line, flush=True)
    return 0


def clear_kernels() -> str:
    """Delete the files of all compiled kernels of this project, and say how many there were.

    The folders are those in which numba keeps them, ``NUMBA_CACHE_DIR`` included.

    Raises:
        ConfigError: If ``NUMBA_DISABLE_JIT`` is set, with which numba knows no folder.
        RunError: If a file cannot be deleted.
    """
    if _is_disabled():
        raise ConfigError("--clear-kernels: expected NUMBA_DISABLE_JIT not to be set, as numba then names no folder")
    folders = {Path(kernel.stats.cache_path) for kernel in _dispatchers()}
    files = [path for folder in sorted(folders) for kind in COMPILED for path in sorted(folder.glob(kind))]
    size = sum(path.stat().st_size for path in files)
    for path in files:
        try:
            path.unlink(missing_ok=True)
        except OSError as error:
            raise RunError(f"{path}: could not be deleted ({error.strerror})") from error
    kernels = sum(path.suffix == ".nbi" for path in files)
    return f"deleted {kernels} compiled kernels ({size / 1e6:.1f} MB in {len(files)} files)"


def _is_disabled() -> bool:
    """Whether numba is told to compile nothing."""
    return os.environ.get("NUMBA_DISABLE_JIT", "0") != "0"


def _kernels() -> Iterator[str]:
    """Say how many kernels are compiled, and where numba keeps them."""
    if _is_disabled():
        yield "kernels: NUMBA_DISABLE_JIT is set, so nothing is compiled and everything is hundreds of times slower"
        return
    found = {(kernel.stats.cache_path, kernel.py_func) for kernel in _dispatchers()}
    for path in sorted({path for path, _ in found}):
        LOG.info("%s: numba keeps compiled kernels here", path)
    compiled = sum(_is_compiled(Path(path), function) for path, function in found)
    yield f"kernels: {compiled} of {len(found)} compiled; numba compiles the others when they are first used"


def _dispatchers() -> Iterator[Any]:
    """Return the functions of this project that numba compiles and keeps on disk."""
    for package in (gym_mapbench, controllers):
        for info in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            if "kernels" in info.name.split("."):
                for entry in vars(import_module(info.name)).values():
                    if hasattr(entry, "py_func") and entry.stats.cache_path and entry.__module__ == info.name:
                        yield entry


def _is_compiled(folder: Path, function: object) -> bool:
    """Whether numba's cache has an index for a function."""
    name, line = function.__qualname__, function.__code__.co_firstlineno  # type: ignore[attr-defined]
    return any(folder.glob(f"*.{name}-{line}.*.nbi"))


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
            f"({SECONDS / seconds:.2g} times real time), or {turns / 1e6:.2g} million turns of the calibration loop"
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
