"""Kills searches, studies and benchmarks, or fills their disk, and continues them: the files must have the same bytes.

Each task runs in a copy of this process, which saves the imports.
"""

from __future__ import annotations

import os
import shutil
import signal
import time
from collections.abc import Callable
from contextlib import suppress
from functools import cache, partial
from multiprocessing import get_context
from multiprocessing.process import BaseProcess
from pathlib import Path

import numpy as np

from gym_mapbench.errors import MapBenchError
from tests.evolution.processes import children_of
from tests.faults import search
from tests.faults.inputs import End

STOPPED, FAILED = 2, 3
HARMS = ("killed at a write", "killed at any moment", "disk full")
KINDS = (*(f"{task}: {harm}" for task in search.TASKS for harm in HARMS), "search: worker killed")


def begun(task: str, path: Path, executor: str = search.THREADS, prepare: Callable[[], object] = int) -> BaseProcess:
    """Begin or continue a task in a process of its own."""
    process = get_context("fork").Process(target=_do, args=(task, path, executor, prepare))
    process.start()
    return process


def _do(task: str, path: Path, executor: str, prepare: Callable[[], object]) -> None:
    """Run a task; exit with 2 if it stops with a message of one line, with 3 at any other error; write it to a file."""
    prepare()
    try:
        search.TASKS[task](path, executor)
    except MapBenchError as error:
        path.with_name(f"{path.name}.said").write_text(str(error))
        raise SystemExit(STOPPED) from None
    except Exception as error:
        path.with_name(f"{path.name}.said").write_text(f"{type(error).__name__}: {error}")
        raise SystemExit(FAILED) from None


def ended(process: BaseProcess) -> int | None:
    """Wait until a task has ended, and return its exit code."""
    process.join()
    return process.exitcode


@cache
def whole(folder: Path, task: str) -> Path:
    """Return the directory of an undisturbed task."""
    path = folder / f"whole_{task}"
    assert ended(begun(task, path)) == 0
    return path


@cache
def extent(folder: Path, task: str) -> tuple[int, float]:
    """Return how many files a task writes, and how long it takes."""
    return search.count_writes(folder / f"counted_{task}", task), search.seconds_of(folder / f"timed_{task}", task)


def try_one(folder: Path, kind: str, seed: int) -> End:
    """Disturb a task, continue it, and compare its files with those of an undisturbed task."""
    task, harm = kind.split(": ")
    expected, path = files_of(whole(folder, task)), folder / f"{kind.replace(' ', '_')}_{seed}"
    rng = np.random.default_rng([seed, *kind.encode()])
    code = _harmed(folder, task, harm, path, rng)
    if code == FAILED or ended(begun(task, path)) != 0:
        return End("not continued", path.with_name(f"{path.name}.said").read_text()[:300])
    differing = [name for name, content in expected.items() if files_of(path).get(name) != content]
    shutil.rmtree(path)
    return End(f"differs in {differing[0]}") if differing else End("same bytes" if code != 0 else "was too late")


def files_of(path: Path) -> dict[str, bytes]:
    """Return the reproducible files of a task."""
    files = [one for one in sorted(path.rglob("*")) if one.is_file() and not one.name.startswith(".")]
    return {str(one.relative_to(path)): one.read_bytes() for one in files if one.stem not in ("timing", "results")}


def _harmed(folder: Path, task: str, harm: str, path: Path, rng: np.random.Generator) -> int | None:
    """Begin a task and disturb it; returns its exit code."""
    writes, seconds = extent(folder, task)
    if harm == "killed at a write":
        number = int(rng.integers(1, writes + 1)) * int(rng.choice([-1, 1]))
        return ended(begun(task, path, prepare=partial(search.killed_at, number)))
    if harm == "disk full":
        return ended(begun(task, path, prepare=partial(search.limited_to, int(rng.integers(1_000, 60_000)))))
    if harm == "worker killed":
        process = begun(task, path, executor="processes")
        return int(_kill_worker(process, rng))
    process = begun(task, path)
    process.join(float(rng.uniform(0.0, seconds)))
    process.kill()
    return ended(process)


def _kill_worker(process: BaseProcess, rng: np.random.Generator) -> bool:
    """Kill one worker of a task some time after the start of the task; returns whether there was a worker.

    A second kill could hit the second attempt of the same run, which then counts as an error.
    """
    killed = False
    while process.is_alive() and not killed:
        time.sleep(float(rng.uniform(0.0, 0.3)))
        workers = [one for child in children_of(process.pid) for one in children_of(child)]
        if workers:
            with suppress(ProcessLookupError):
                os.kill(int(rng.choice(workers)), signal.SIGKILL)
                killed = True
    process.join()
    return killed
