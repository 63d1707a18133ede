"""Measure what a cluster costs the process that searches and the scheduler, and print what follows for many cores.

Runs cost nothing here, so that only the carrying of jobs and results is left; maps and parameters are real. Seconds are
of CPU, which other programs on the machine disturb little.
"""

from __future__ import annotations

import argparse
import os
import pickle
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import psutil
from distributed import Client
from growth import REAL_RUN_SECONDS, free_run, per_evaluation, search

from evolution.driving import cluster as driving
from evolution.driving.cluster import chunk_size
from evolution.driving.evaluator import Evaluator
from evolution.driving.jobs import Job, JobPlan
from evolution.search.experiments import experiment_of, load_preset
from evolution.search.operators.sampling import MapSampling

PER_CHUNK = round(driving.CHUNK_SECONDS / REAL_RUN_SECONDS)
CORES = (2, 8, 64, 250, 1000)
STUDY = 57_600
"""Evaluations of the study whose cost is printed."""

POPULATIONS = (40, 1000)
LONGEST_RUN = 4.0
"""How many times the mean the longest run of a generation is taken to last; the next generation waits for it."""


@dataclass(frozen=True)
class Costs:
    """Seconds of CPU, and bytes.

    Args:
        evaluation: What the search itself needs for a map set.
        run: What the searching process needs to send and receive a run.
        chunk: What the scheduler needs for a chunk.
        job_bytes: Size of a run's job within a chunk.
        result_bytes: Size of its result.
    """

    evaluation: float
    run: float
    chunk: float
    job_bytes: float
    result_bytes: float


@contextmanager
def cluster(workers: int) -> Iterator[tuple[str, psutil.Process]]:
    """Start a scheduler and a worker on this machine; yields its address and the scheduler's process."""
    here = os.pathsep.join([str(Path(__file__).parent), *sys.path])
    with tempfile.TemporaryDirectory() as place:
        options = {"cwd": place, "env": {**os.environ, "PYTHONPATH": here}, "stderr": subprocess.DEVNULL}
        module = [sys.executable, "-m", "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0"]
        file = ["--scheduler-file", str(Path(place) / "scheduler.json")]
        scheduler = subprocess.Popen([*module, *file, "--dashboard-address", "127.0.0.1:0"], **options)
        module = [sys.executable, "-m", "distributed.cli.dask_worker", "--nthreads", str(workers), "--no-nanny"]
        worker = subprocess.Popen([*module, *file, "--no-dashboard"], **options)
        try:
            while not Path(file[1]).exists():
                time.sleep(0.1)
            with Client(scheduler_file=file[1], set_as_default=False) as client:
                client.wait_for_workers(1)
                yield client.scheduler.address, psutil.Process(scheduler.pid)
        finally:
            worker.terminate()
            scheduler.terminate()
            worker.wait()
            scheduler.wait()


def jobs(maps: int, seed: int) -> list[Job]:
    """Draw maps of the thesis, each with a run of every controller."""
    experiment, rng = experiment_of(load_preset("thesis")), np.random.default_rng(seed)
    plan = JobPlan(experiment.controllers, experiment.run, seed)
    scenarios = MapSampling(maps, experiment.search.shapes).draw_set(rng)
    return [job for scenario in scenarios for job in plan.jobs(scenario)]


def measured(maps: int) -> Costs:
    """Drive maps for nothing on a cluster and see who needed how long."""
    first, work = jobs(20, seed=1), jobs(maps, seed=2)
    driving.chunk_size = lambda *_: PER_CHUNK  # what it would be for real runs
    with cluster(1) as (address, scheduler), Evaluator(free_run, executor=f"dask={address}") as evaluator:
        evaluator.run(first)
        before, began = cpu_of(scheduler), time.process_time()
        evaluator.run(work)
        ours, theirs = time.process_time() - began, cpu_of(scheduler) - before
    return Costs(
        1e-3 * per_evaluation(search(4, pop_size=40)),
        ours / len(work),
        theirs * PER_CHUNK / len(work),
        len(pickle.dumps(work[:PER_CHUNK])) / PER_CHUNK,
        len(pickle.dumps(free_run(work[0]))),
    )


def cpu_of(process: psutil.Process) -> float:
    """Seconds of CPU that a process has needed."""
    times = process.cpu_times()
    return float(times.user + times.system)


def rates(costs: Costs, runs_per_evaluation: float) -> Iterator[str]:
    """Lines about what a search and a study cost by cores."""
    parent = costs.evaluation / runs_per_evaluation + costs.run
    yield f"the searching process ends at {1 / parent:.0f} runs/s: {REAL_RUN_SECONDS / parent:.0f} cores"
    yield f"the scheduler ends at {PER_CHUNK / costs.chunk:.0f} runs/s in chunks of {PER_CHUNK}"
    yield "cores   " + "   ".join(f"runs/s, population {size}   study, h" for size in POPULATIONS)
    for cores in CORES:
        line = f"{cores:5d}"
        for population in POPULATIONS:
            runs = population * runs_per_evaluation
            seconds = generation_seconds(costs, population, runs_per_evaluation, cores)
            line += f"   {runs / seconds:22.0f}   {STUDY / population * seconds / 3600:8.2f}"
        yield line


def generation_seconds(costs: Costs, population: int, runs_per_evaluation: float, cores: int) -> float:
    """Seconds of a generation: its runs, limited by cores, parent or scheduler; its longest run; the search itself."""
    runs = population * runs_per_evaluation
    chunks = runs / chunk_size(round(runs), cores, REAL_RUN_SECONDS)
    slowest = max(runs * REAL_RUN_SECONDS / cores, runs * costs.run, chunks * costs.chunk)
    return slowest + LONGEST_RUN * REAL_RUN_SECONDS + population * costs.evaluation


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--maps", type=int, default=400, help="maps that are driven, each by three controllers")
    parser.add_argument("--runs-per-evaluation", type=float, default=5.5, help="new runs; maps are often known already")
    args = parser.parse_args()
    costs = measured(args.maps)
    print(f"load {os.getloadavg()[0]:.1f}, {os.cpu_count()} cores; a real run takes {REAL_RUN_SECONDS} s")
    print(f"search                {1e3 * costs.evaluation:8.2f} ms for each evaluation")
    print(f"sending and receiving {1e3 * costs.run:8.2f} ms for each run")
    print(f"scheduler             {1e3 * costs.chunk:8.2f} ms for each chunk")
    print(f"a job                 {costs.job_bytes:8.0f} bytes; its result {costs.result_bytes:.0f} bytes")
    for line in rates(costs, args.runs_per_evaluation):
        print(line)


if __name__ == "__main__":
    main()
