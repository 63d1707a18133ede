"""Which metrics tell controllers apart where time does not: Gini coefficients of every metric on sampled maps.

``python benchmarks/metric_ranks.py [--maps N] [--workers W] [--out FILE]`` runs DWB, MPPI and RPP twice on every
map, half of them random shapes, half of the families without a route, and prints rank correlations with the
Gini of time, and between the two repeats as a control.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from run_tables import write_runs
from sampled_maps import sampled
from scipy.stats import spearmanr

from evolution import bench
from evolution.driving import DriveSettings
from evolution.files import Row
from evolution.search import gini, load_preset
from gym_mapbench.generator import WITHOUT_ROUTE

CONTROLLERS = ("dwb", "mppi", "rpp")
METRICS = (
    *("time_s", "path_length_m", "min_clearance", "mean_clearance", "curvature", "path_smoothness"),
    *("velocity_smoothness", "jerk", "effort", "n_replans", "n_recoveries"),
)
FIRST_SEED, REPEATS = 3000, 2
KINDS = ("shapes",), WITHOUT_ROUTE
"""Families of the maps, in turns."""


def ginis(rows: Sequence[Row]) -> list[Row]:
    """Return the Gini coefficient of each metric for every repeat on the maps that all controllers solved in both."""
    runs = {(str(row["map"]), int(row["repeat"]), str(row["controller"])): row for row in rows}
    maps = dict.fromkeys(name for name, _, _ in runs)
    solved = [name for name in maps if all(run["outcome"] == "goal" for place, run in runs.items() if place[0] == name)]
    return [
        {"map": name, "repeat": repeat, **{metric: _gini(runs, name, repeat, metric) for metric in METRICS}}
        for name in solved
        for repeat in range(REPEATS)
    ]


def _gini(runs: Mapping[tuple[str, int, str], Row], name: str, repeat: int, metric: str) -> float:
    """Return the Gini coefficient of a metric over the controllers; distances below 0 count as 0."""
    return gini([max(float(runs[name, repeat, one][metric]), 0.0) for one in CONTROLLERS])


def main() -> None:
    """Run, write the Gini coefficients, and print how they agree with those of time, and between the repeats."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--maps", type=int, default=300)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--out", type=Path)
    args = parser.parse_args()
    settings = DriveSettings.from_mapping(load_preset("robust")["run"], "run")
    options = {"settings": settings, "seed": 11, "repeats": REPEATS, "workers": args.workers}
    rows = ginis(bench(sampled(args.maps, FIRST_SEED, KINDS), list(CONTROLLERS), **options).rows)
    if args.out:
        rounded = [row | {name: f"{row[name]:.4f}" for name in METRICS} for row in rows]
        write_runs(args.out, rounded, ("map", "repeat", *METRICS))
    print(
        f"{len(rows) // REPEATS} of {args.maps} maps are solved by all; Spearman's rho with time, and between repeats"
    )
    values = {name: np.array([row[name] for row in rows]).reshape(-1, REPEATS) for name in METRICS}
    for name, of_metric in values.items():
        with_time = spearmanr(values["time_s"].mean(axis=1), of_metric.mean(axis=1)).statistic
        print(f"{name:20s} {with_time:6.2f} {spearmanr(*of_metric.T).statistic:6.2f}")


if __name__ == "__main__":
    main()
