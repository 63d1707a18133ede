"""Searches that are killed, or can no longer write, and are begun again: the result must be the same bytes."""

from __future__ import annotations

import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

from evolution.runs import RUN
from tests.faults.inputs import End

WRITES = 40
"""Files that the search of :mod:`tests.faults.search` writes, roughly."""

KINDS = ("killed at a write", "killed at any moment", "worker killed", "disk full")


def search(path: Path, *options: str) -> subprocess.Popen[str]:
    """Begin or continue the search."""
    command = [sys.executable, "-m", "tests.faults.search", str(path), *options]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


def ended(process: subprocess.Popen[str]) -> int:
    """Wait until a search has ended, and return its exit code."""
    process.communicate()
    return process.returncode


def whole_run(folder: Path) -> Path:
    """Return the directory of a search that nothing happened to."""
    path = folder / "whole"
    if not path.is_dir():
        assert ended(search(path)) == 0
    return path


def try_one(folder: Path, kind: str, seed: int) -> End:
    """Let something happen to a search, continue it, and compare it with one that nothing happened to."""
    whole, path = whole_run(folder), folder / f"{kind.replace(' ', '_')}_{seed}"
    rng = np.random.default_rng([seed, *kind.encode()])
    hit = _harm(kind, path, rng)
    process = search(path)
    said, _ = process.communicate()
    if process.returncode != 0:
        return End("not continued", said[-300:])
    differing = [name for name, content in files_of(whole).items() if files_of(path).get(name) != content]
    shutil.rmtree(path)
    return End(f"differs in {differing[0]}") if differing else End("same bytes" if hit else "was too late")


def files_of(path: Path) -> dict[str, bytes]:
    """Return the reproducible files of a run."""
    files = [one for one in sorted(path.rglob("*")) if one.is_file() and not one.name.startswith(".")]
    return {str(one.relative_to(path)): one.read_bytes() for one in files if one.stem not in ("timing", "results")}


def _harm(kind: str, path: Path, rng: np.random.Generator) -> bool:
    """Begin a search and let something happen to it; returns whether it was stopped by that."""
    if kind == "killed at a write":
        number = int(rng.integers(1, WRITES)) * int(rng.choice([-1, 1]))
        return ended(search(path, f"--die-at-write={number}")) == -signal.SIGKILL
    if kind == "disk full":
        return ended(search(path, f"--largest-file={int(rng.integers(2_000, 60_000))}")) != 0
    process = search(path)
    while not RUN.holds(path):
        time.sleep(0.05)
    time.sleep(float(rng.uniform(0.0, 3.0)))
    if kind == "worker killed":
        return _kill_workers(process, rng)
    process.kill()
    return ended(process) != 0


def _kill_workers(process: subprocess.Popen[str], rng: np.random.Generator) -> bool:
    """Kill workers of a search a few times, while it goes on; returns whether there were any."""
    killed = 0
    for _ in range(4):
        workers = [one for child in _children(process.pid) for one in _children(child)]
        if workers:
            subprocess.run(["kill", "-9", str(rng.choice(workers))], check=False, stderr=subprocess.DEVNULL)
            killed += 1
        time.sleep(0.3)
    ended(process)
    return killed > 0


def _children(pid: int) -> list[int]:
    """Return the numbers of the processes that a process has started."""
    try:
        text = Path(f"/proc/{pid}/task/{pid}/children").read_text(encoding="ascii")
    except OSError:
        return []
    return [int(number) for number in text.split()]
