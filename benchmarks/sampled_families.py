"""How sampled maps of families score: share solved in all runs, and Gini scores.

``python benchmarks/sampled_families.py [--maps N] [--out FILE]`` runs DWB, MPPI and RPP twice on every map.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from evolution.driving import ControllerSpec, DriveSettings, JobPlan, drive
from evolution.search import gini, load_preset, scenario_on
from gym_mapbench.generator import MOTIFS, WITHOUT_ROUTE, FamilySpec, ShapeSettings, draw_from
from gym_mapbench.world.robot import make_robot
from gym_mapbench.world.scenario import Scenario

RUNS = 2
FIRST_SEED = 1000


def groups() -> dict[str, list[FamilySpec]]:
    """Return the families that are compared: those without a route, all motifs, and gates alone."""
    names = {
        "without a route": WITHOUT_ROUTE,
        "motifs": [*MOTIFS.built_in, "sequences"],
        "gates": ["gates"],
    }
    return {group: [FamilySpec(name=name) for name in of_group] for group, of_group in names.items()}


def plan() -> JobPlan:
    """Return the runs of a map in the world of the preset ``robust``, the fastest controllers first."""
    settings = DriveSettings.from_mapping(load_preset("robust")["run"], "run")
    return JobPlan(tuple(ControllerSpec(name=name) for name in ("rpp", "dwb", "mppi")), settings, root_seed=7)


def score(jobs: JobPlan, scenario: Scenario) -> float | None:
    """Return the Gini coefficient of the median times; None if a run did not reach the goal."""
    times = []
    for number in range(len(jobs.controllers)):
        episodes = [drive(jobs.job(scenario, number, repeat)) for repeat in range(RUNS)]
        if not all(episode.success for episode in episodes):
            return None
        times.append(median(episode.time for episode in episodes))
    return float(gini(times))


def rows(maps: int) -> list[dict[str, Any]]:
    """Sample maps of every group with equal seeds, and return their scores."""
    jobs, shapes, robot = plan(), ShapeSettings(), make_robot("turtlebot3_waffle")
    found: list[dict[str, Any]] = []
    for seed in range(FIRST_SEED, FIRST_SEED + maps):
        for group, families in groups().items():
            drawn = draw_from(np.random.default_rng(seed), families, shapes, robot)
            scored = score(jobs, scenario_on(drawn.cells, shapes))
            found.append({"group": group, "seed": seed, "family": drawn.family, "score": scored})
    return found


def main() -> None:
    """Run and print a line for each group."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--maps", type=int, default=80)
    parser.add_argument("--out", type=Path)
    args = parser.parse_args()
    found = rows(args.maps)
    if args.out:
        args.out.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    for group in groups():
        scores = [row["score"] for row in found if row["group"] == group and row["score"] is not None]
        above = [sum(one > limit for one in scores) for limit in (0.1, 0.15)]
        print(f"{group}: {len(scores)} of {args.maps} solved, {above[0]} above 0.1, {above[1]} above 0.15")


if __name__ == "__main__":
    main()
