"""Measure how costs grow with populations, long searches, maps per set, maps and stores; prints ratios, draws a plot.

Controllers are replaced by runs that cost nothing, so that what is left is this project's own work around them. Seconds
are of CPU, which other programs on the machine disturb little; those of the store are of the clock.
"""

from __future__ import annotations

import argparse
import os
import sqlite3
import statistics
import tempfile
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from sampled_maps import full_costmap, map_with_path

from controllers.nav2_params import load_preset as load_parameters
from evolution.api import compose
from evolution.driving.evaluator import Evaluator
from evolution.driving.executors import EXECUTORS
from evolution.driving.jobs import Job, RunResult
from evolution.driving.store import ResultStore
from evolution.runs.directory import STORE, RunDir
from evolution.search.experiments import experiment_of
from evolution.search.loop import Progress, evolve
from gym_mapbench.generator import default_task
from gym_mapbench.planners import make_planner
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.scenario import Scenario

POPULATIONS = (40, 200, 1000)
MAPS_PER_SET = (1, 2, 3, 6, 12)
SIDES = (150, 300, 600)
STORES = (1_000, 30_000, 1_000_000)
REAL_RUN_SECONDS = 0.15
"""What a run of a real controller takes on one core, s."""

MEASURES = ("mean_clearance", "min_clearance", "mean_jerk", "smoothness", "n_recoveries", "n_replans", "n_spins")


class Inline(Executor):
    """Does every job at once, in this process."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Return the future of a call that is over."""
        future: Future[Any] = Future()
        future.set_result(fn(*args, **kwargs))
        return future


EXECUTORS.register("inline", lambda _setup: Inline())


@dataclass(frozen=True)
class Series:
    """What something costs by size.

    Args:
        title: What is measured.
        sizes: By what.
        unit: Unit of the costs.
        points: Costs by size.
        goal: What the ratio of the last cost to the first should be at most.
    """

    title: str
    sizes: str
    unit: str
    points: dict[int, float]
    goal: str

    def lines(self) -> Iterator[str]:
        """Lines of the table."""
        first = next(iter(self.points.values()))
        yield f"{self.title} ({self.goal})"
        for size, cost in self.points.items():
            yield f"  {size:>10,} {self.sizes:24s} {cost:10.4g} {self.unit:20s} {cost / first:8.2f}x"


def free_run(job: Job) -> RunResult:
    """Draw a result from the seed of a job."""
    rng = np.random.default_rng(job.seed)
    time_s = 5.0 + float(rng.gamma(2.0, 2.0))
    metrics = dict(zip(MEASURES, map(float, rng.random(len(MEASURES))), strict=True))
    outcome = "timeout" if rng.random() < 0.05 else "goal"
    return RunResult(outcome, time_s, 0.5 * time_s, metrics=metrics, timings={"controller_ms": 0.1})


def search(generations: int, **options: Any) -> list[tuple[float, Progress]]:
    """Run a search of free runs in a directory; returns the CPU seconds at the end of each generation."""
    document = compose("thesis", **options, evaluations=generations * options["pop_size"])
    experiment = experiment_of(document)
    seen: list[tuple[float, Progress]] = []
    with tempfile.TemporaryDirectory() as place:
        directory = RunDir.create(Path(place) / "run", experiment)
        with (
            ResultStore(directory.path / STORE) as store,
            Evaluator(free_run, store, executor="inline") as evaluator,
        ):
            evolve(experiment, evaluator, directory, on_generation=lambda one: seen.append((time.process_time(), one)))
    return seen


def per_evaluation(seen: list[tuple[float, Progress]]) -> float:
    """Milliseconds of CPU for each evaluation after the first of some generations."""
    (began, first), (ended, last) = seen[0], seen[-1]
    return 1e3 * (ended - began) / (last.row["evaluations"] - first.row["evaluations"])


def by_population(generations: int) -> tuple[Series, float]:
    """Cost of an evaluation by population; also the largest share of the time of real driving."""
    searches = {size: search(generations, pop_size=size) for size in POPULATIONS}
    costs = {size: per_evaluation(seen) for size, seen in searches.items()}
    shares = [
        1e-3 * costs[size] * (seen[-1][1].row["evaluations"] - seen[0][1].row["evaluations"])
        / (REAL_RUN_SECONDS * sum(one.driven for _, one in seen[1:]))
        for size, seen in searches.items()
    ]  # fmt: skip
    title = "an evaluation outside driving, by population"
    return Series(title, "map sets", "ms of CPU", costs, "flat"), max(shares)


def by_length(evaluations: int, parts: int = 4) -> Series:
    """Cost of an evaluation in the parts of a long search."""
    seen = search(evaluations // 40, pop_size=40)
    size = (len(seen) - 1) // parts
    costs = {}
    for part in range(parts):
        of_part = seen[part * size : (part + 1) * size + 1]
        costs[int(of_part[-1][1].row["evaluations"])] = per_evaluation(of_part)
    return Series("the same in a long search of population 40", "evaluations so far", "ms of CPU", costs, "flat")


def by_maps_per_set(generations: int) -> Series:
    """Cost of one map of an evaluation by maps per set."""
    costs = {maps: per_evaluation(search(generations, pop_size=40, maps_per_set=maps)) / maps for maps in MAPS_PER_SET}
    return Series("one map of an evaluation, by maps per set", "maps in a set", "ms of CPU", costs, "flat: linear")


def by_side(calls: int) -> Series:
    """Cost of a plan by side of the map: the same map with each cell drawn as several."""
    navigation, costs = load_parameters("thesis"), {}
    smallest = map_with_path(navigation).map
    for side in SIDES:
        scale = side // SIDES[0]
        grid = GridMap(np.kron(smallest.occupancy, np.ones((scale, scale), dtype=bool)))
        scenario = Scenario(grid, *default_task(grid))
        costmap = full_costmap(scenario, navigation)
        plan = partial(make_planner("navfn").plan, costmap, scenario.start, scenario.goal)
        plan()
        costs[side] = 1e3 * statistics.median(cpu_seconds(plan) for _ in range(calls))
    return Series("a plan of NavFn, by side of the map", "cells", "ms of CPU", costs, "<= 20x; 16x the cells")


def cpu_seconds(call: Callable[[], object]) -> float:
    """Seconds of CPU that a call takes."""
    began = time.process_time()
    call()
    return time.process_time() - began


def by_results(calls: int = 5) -> Series:
    """Seconds to open a store, by its results."""
    return Series("opening a store", "results", "s", {size: opening(size, calls) for size in STORES}, "<= 1 s")


def opening(size: int, calls: int) -> float:
    """Median seconds until a store of some results is open and has answered for 1,000 of them."""
    text = RunResult("goal", 12.5, 6.25, metrics=dict.fromkeys(MEASURES, 0.123456789), timings={"ms": 1.0}).to_json()
    keys = [f"{number:032x}" for number in range(size)]
    with tempfile.TemporaryDirectory() as place:
        path = Path(place) / "results.sqlite"
        ResultStore(path).close()
        with closing(sqlite3.connect(path)) as database, database:
            database.executemany("INSERT INTO results VALUES (?, ?)", ((key, text) for key in keys))
        seconds = []
        for _ in range(calls):
            began = time.perf_counter()
            with ResultStore(path) as store:
                assert len(store.get_many(keys[:: max(1, size // 1000)])) >= min(size, 1000)
            seconds.append(time.perf_counter() - began)
    return statistics.median(seconds)


def draw(all_series: list[Series], path: Path) -> None:
    """Draw a panel for each series."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    figure, panels = plt.subplots(1, len(all_series), figsize=(4 * len(all_series), 3.4), layout="constrained")
    for panel, series in zip(panels, all_series, strict=True):
        panel.plot(list(series.points), list(series.points.values()), "o-")
        panel.set(title=f"{series.title}\n({series.goal})", xlabel=series.sizes, ylabel=series.unit, xscale="log")
        panel.title.set_fontsize(9)
        panel.set_ylim(0, 1.2 * max(series.points.values()))
        panel.grid(alpha=0.3)
    figure.savefig(path, dpi=100)


def main() -> None:
    """Measure, print and draw."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--generations", type=int, default=4, help="of each search, the first of which is not counted")
    parser.add_argument("--evaluations", type=int, default=2000, help="of the long search")
    parser.add_argument("--calls", type=int, default=20, help="plans on each map")
    parser.add_argument("--plot", type=Path, metavar="FILE", help="PNG to draw")
    args = parser.parse_args()
    print(f"load at the start {os.getloadavg()[0]:.1f}, {os.cpu_count()} cores")
    search(2, pop_size=8)
    populations, share = by_population(args.generations)
    all_series = [populations, by_length(args.evaluations), by_maps_per_set(args.generations), by_side(args.calls)]
    all_series.append(by_results())
    for series in all_series:
        print("\n".join(series.lines()))
    print(f"largest share of real driving at {REAL_RUN_SECONDS} s a run: {share:.2%}")
    print(f"load at the end {os.getloadavg()[0]:.1f}")
    if args.plot:
        draw(all_series, args.plot)


if __name__ == "__main__":
    main()
