"""A search of fake runs in a process of its own, which may be killed at any moment and begun again.

::

    python -m tests.faults.search DIRECTORY [--die-at-write N] [--largest-file BYTES]
"""

from __future__ import annotations

import argparse
import itertools
import os
import resource
import signal
from pathlib import Path

from evolution.driving import Evaluator, ResultStore
from evolution.files import WriteError
from evolution.runs import RUN, RunDir
from evolution.search import evolve
from gym_mapbench.errors import RunError
from tests.evolution import fake_study
from tests.evolution.fake_runs import drive_slowly

SEARCH = {"pop_size": 4, "evaluations": 20, "seed": 3}
STOPPED = 2


def run(path: Path) -> None:
    """Begin a search, or continue it."""
    experiment = fake_study.read_experiment({"search": SEARCH})
    rundir = RunDir.open(path) if RUN.holds(path) else RunDir.create(path, experiment)
    with ResultStore(rundir.store_path) as store, Evaluator(drive_slowly, store, workers=2) as evaluator:
        evolve(experiment, evaluator, rundir)


def die_at(number: int) -> None:
    """Kill this process at its write of this number: before the file is in its place, or, if negative, right after."""
    writes, replace = itertools.count(1), os.replace

    def replace_or_die(source: Path, target: Path) -> None:
        now = next(writes)
        if now == number:
            os.kill(os.getpid(), signal.SIGKILL)
        replace(source, target)
        if now == -number:
            os.kill(os.getpid(), signal.SIGKILL)

    os.replace = replace_or_die


def main() -> int:
    """Run the search; exit code 2 if it cannot write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("path", type=Path)
    parser.add_argument("--die-at-write", type=int, default=0)
    parser.add_argument("--largest-file", type=int)
    options = parser.parse_args()
    if options.largest_file is not None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (options.largest_file, options.largest_file))
    if options.die_at_write:
        die_at(options.die_at_write)
    try:
        run(options.path)
    except (WriteError, RunError) as error:
        print(error)
        return STOPPED
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
