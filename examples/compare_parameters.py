"""Compare two parameter files of Nav2 on your map.

    python compare_parameters.py                            this folder's hall.yaml and nav2_params.yaml
    python compare_parameters.py MAP.yaml A.yaml B.yaml     yours

Shows: what MapBench reads of a `nav2_params.yaml`, and how to tell a difference from chance: the runs
of both files have the same noise in pairs.
Takes: about a minute on two cores; the first time on a machine about a minute more, for compiling.
Comes out: for each controller of the files, goals and times with either, and the difference with its 95 % interval.
"""

import os
import sys
from pathlib import Path
from statistics import fmean

import numpy as np

from controllers.nav2_params import read_nav2_params, summarise
from evolution import bench
from evolution.statistics import FEWEST_FOR_INTERVAL, bootstrap_interval

SMALL = bool(os.environ.get("MAPBENCH_SMALL"))  # the tests run a small form
REPEATS = 1 if SMALL else 10
HERE = Path(__file__).parent


def files():
    """Return the map and both files; without arguments, the second is the first with less inflation around walls."""
    if len(sys.argv) == 4:
        return sys.argv[1:]
    wide, narrow = HERE / "nav2_params.yaml", Path("nav2_params_narrow.yaml")
    narrow.write_text(wide.read_text().replace("inflation_radius: 0.45", "inflation_radius: 0.25"))
    return HERE / "hall.yaml", wide, narrow


def goals_and_times(rows, controller):
    """Return the number of goals of a controller, and the time of each run that reached one, by its repeat."""
    times = {
        (row["map"], row["repeat"]): row["time_s"]
        for row in rows
        if row["controller"] == controller and row["outcome"] == "goal"
    }
    return len(times), times


grid, *both = files()
for path in both:
    for line in summarise(read_nav2_params(path)):
        print(f"{path}: {line}")
first, second = (
    bench(grid, params=str(path), noise="nominal", repeats=REPEATS, time_limit=120.0).rows for path in both
)
for name in dict.fromkeys(row["controller"] for row in first):
    (goals_a, times_a), (goals_b, times_b) = goals_and_times(first, name), goals_and_times(second, name)
    gains = [times_b[key] - times_a[key] for key in times_a if key in times_b]
    print(f"{name}: {goals_a} and {goals_b} goals, of {REPEATS} runs with either file")
    if len(gains) >= FEWEST_FOR_INTERVAL:
        low, high = bootstrap_interval(gains, np.random.default_rng(0))
        mean = f"{fmean(gains):+.2f} s (95 % interval {low:+.2f} to {high:+.2f} s)"
        print(f"  with the second file it takes {mean} where both reach the goal")
