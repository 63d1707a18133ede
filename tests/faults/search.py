"""Long commands with fake runs, which may be killed at any moment and begun again."""

from __future__ import annotations

import itertools
import os
import resource
import signal
import time
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import pytest

from evolution.benchmark.directory import BENCHMARK, begin_benchmark, benchmark_document
from evolution.benchmark.runs import bench
from evolution.driving import Evaluator, Job, JobPlan, Resources, RunResult, WorkerSetup
from evolution.minimizing.results import MINIMIZATION
from evolution.quality_diversity import run_atlas
from evolution.quality_diversity.results import ATLAS
from evolution.runs import RUN, RunDir, exclusive_store
from evolution.search import evolve
from evolution.studies import run_study
from evolution.studies.directory import STUDY
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.scenario import Pose, Scenario
from tests.evolution import fake_runs, fake_study
from tests.evolution.fake_runs import CONTROLLERS, WORLD
from tests.evolution.minimizing import test_minimizing
from tests.evolution.quality_diversity import test_search

SEARCH = {"pop_size": 4, "evaluations": 20, "seed": 3}
THREADS = "tests.faults.search:threads"
"""Executor that starts no process, so that a task costs no more than itself."""


def threads(setup: WorkerSetup) -> Executor:
    """Make an executor of threads."""
    return ThreadPoolExecutor(setup.workers)


def drive(job: Job) -> RunResult:
    """Take long enough to be interrupted; nothing in the result is measured by the clock."""
    time.sleep(0.002)
    return replace(fake_runs.drive(job), timings={})


def run_search(path: Path, executor: str) -> None:
    """Begin a search, or continue it."""
    experiment = fake_study.read_experiment({"search": SEARCH})
    rundir = RunDir.open(path) if RUN.holds(path) else RunDir.create(path, experiment)
    with exclusive_store(RUN, path) as store, Evaluator(drive, store, workers=2, executor=executor) as evaluator:
        evolve(experiment, evaluator, rundir)


def run_small_study(path: Path, executor: str) -> None:
    """Begin a study of a search and a baseline, or continue it."""
    configurations = [{"name": "ga", "experiment": {"search": {"pop_size": 4}}}]
    configurations += [{"name": "best", "method": "best_triple", "of": "ga"}]
    settings = fake_study.small_study(runs=2, budget=12, configurations=configurations)
    with pytest.MonkeyPatch.context() as patch:
        fake_study.use_fakes(patch)
        run_study(settings, path, resume=STUDY.holds(path), resources=Resources(workers=2, executor=executor))


def run_bench(path: Path, executor: str) -> None:
    """Begin a benchmark, or continue it."""
    grid = GridMap.from_rows(["#" * 20, *["#" + "." * 18 + "#"] * 18, "#" * 20])
    scenarios = [Scenario(grid, Pose(0.2, 0.2), Pose(0.2 + 0.05 * n, 0.8), f"map_{n}") for n in range(8)]
    plan = JobPlan(CONTROLLERS, WORLD, repeats=4)
    begin_benchmark(path, benchmark_document(scenarios, plan), resume=BENCHMARK.holds(path))
    with exclusive_store(BENCHMARK, path) as store, Evaluator(drive, store, workers=2, executor=executor) as evaluator:
        bench(scenarios, plan, evaluator).save(path)


def run_small_atlas(path: Path, executor: str) -> None:
    """Begin an atlas, or continue it."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("evolution.quality_diversity.running.run_job", drive)
        patch.setattr("evolution.runs.exclusive.preparation_of", lambda *_: None)
        settings, resources = test_search.SETTINGS.replace(runs=60), Resources(workers=2, executor=executor)
        run_atlas(test_search.EXPERIMENT, settings, path, resume=ATLAS.holds(path), resources=resources)


def run_small_minimization(path: Path, executor: str) -> None:
    """Begin a minimization, or continue it."""
    with pytest.MonkeyPatch.context() as patch:
        test_minimizing.use_fakes(patch)
        test_minimizing.minimise(path, resume=MINIMIZATION.holds(path), workers=2, executor=executor)


TASKS = {
    "search": run_search,
    "study": run_small_study,
    "benchmark": run_bench,
    "atlas": run_small_atlas,
    "minimization": run_small_minimization,
}


def killed_at(number: int) -> None:
    """Kill this process at its write of this number: before the file is in its place, or, if negative, right after."""
    writes, put = itertools.count(1), os.replace

    def replace_or_die(source: Path, target: Path) -> None:
        now = next(writes)
        if now == number:
            os.kill(os.getpid(), signal.SIGKILL)
        put(source, target)
        if now == -number:
            os.kill(os.getpid(), signal.SIGKILL)

    os.replace = replace_or_die


def limited_to(largest: int) -> None:
    """Let no file of this process grow beyond some bytes, as on a disk that is full."""
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (largest, largest))


def count_writes(path: Path, task: str) -> int:
    """Return how many files a task writes."""
    writes, put = [], os.replace
    os.replace = lambda *names: (writes.append(names), put(*names))
    try:
        TASKS[task](path, THREADS)
    finally:
        os.replace = put
    return len(writes)


def seconds_of(path: Path, task: str) -> float:
    """Return how long a task takes."""
    began = time.monotonic()
    TASKS[task](path, THREADS)
    return time.monotonic() - began
