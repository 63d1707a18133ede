"""What makes MPPI slow at oblique gates, and which parameter mends it at what price.

``python benchmarks/gates.py [--seeds R] [--workers W]`` builds maps of equal gates on a diagonal route and prints the
median times of DWB, MPPI and RPP by number of gates and thickness of their walls. Then it changes one parameter of MPPI
at a time: on four gates, and on sampled maps of families without a route, where it may cost something. The last table
has four gates for other robots and releases, with MPPI as it is and with the change that mends it.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import replace
from statistics import fmean, median
from typing import Any

import numpy as np
from run_tables import is_goal, of, share

from evolution import bench
from evolution.driving import ControllerSpec, DriveSettings
from evolution.files import Row
from evolution.search import load_preset, scenario_on
from gym_mapbench.generator import (
    WITHOUT_ROUTE,
    FamilySpec,
    MotifGenes,
    ShapeSettings,
    draw_from,
    make_family,
)
from gym_mapbench.generator.motifs import USUAL_WIDTH
from gym_mapbench.generator.motifs.genes import Section
from gym_mapbench.generator.motifs.routes import Route
from gym_mapbench.world.robot import make_robot
from gym_mapbench.world.scenario import Scenario

REGULAR = {"pitch": 1.5, "gap": 0.95, "phase": 0.0, "shift": 0.0, "slope": 0.0, "swing": 0.0}
THICKNESSES = (0.1, 0.2, 0.3, 0.4)
GATES = (1, 2, 3, 4)
CHANGES: dict[str, Mapping[str, Any]] = {
    "as it is": {},
    "CostCritic.cost_weight 3.81 to 2": {"CostCritic": {"cost_weight": 2.0}},
    "CostCritic.cost_weight 3.81 to 1": {"CostCritic": {"cost_weight": 1.0}},
    "PathFollowCritic.cost_weight 5 to 10": {"PathFollowCritic": {"cost_weight": 10.0}},
    "PathFollowCritic.cost_weight 5 to 20": {"PathFollowCritic": {"cost_weight": 20.0}},
    "PathAlignCritic.max_path_occupancy_ratio 0.05 to 0.3": {"PathAlignCritic": {"max_path_occupancy_ratio": 0.3}},
    "PathAlignCritic.max_path_occupancy_ratio 0.05 to 1": {"PathAlignCritic": {"max_path_occupancy_ratio": 1.0}},
    "PathAngleCritic without": {"PathAngleCritic": {"enabled": False}},
    "PreferForwardCritic without": {"PreferForwardCritic": {"enabled": False}},
    "temperature 0.3 to 0.1": {"temperature": 0.1},
    "wz_std 0.4 to 0.8": {"wz_std": 0.8},
    "vx_std 0.2 to 0.4": {"vx_std": 0.4},
}
WAFFLE = "turtlebot3_waffle"
WORLDS = (
    (WAFFLE, "fair"),
    (WAFFLE, "jazzy_fair"),
    (WAFFLE, "lyrical_fair"),
    ("turtlebot3_waffle_gz", "fair"),
    ("turtlebot3_burger", "fair"),
    ("jackal", "fair"),
)
"""Robots and navigation presets of the last table."""
CONTROLLERS = ("dwb", "mppi", "rpp")
HEADERS = (
    "| walls, m | gates | DWB, s | MPPI, s | RPP, s |\n|---|---|---|---|---|",
    "| MPPI | four gates, s | goals elsewhere, % | time, s | clearance, m | contacts |\n|---|---|---|---|---|---|",
    "| robot | preset | DWB, s | RPP, s | MPPI, s | MPPI with vx_std 0.4, s |\n|---|---|---|---|---|---|",
)
SAMPLED = 40
FIRST_SEED = 9000


def gates(count: int, thickness: float, robot: str = WAFFLE) -> Scenario:
    """Return the map of some equal gates that the robot crosses at about 45 degrees, with equal room for each robot."""
    shared = {**REGULAR, "thickness": thickness}
    shared["gap"] += make_robot(robot).width - USUAL_WIDTH
    genes = MotifGenes(route=Route(name="diagonal"), sections=(Section(shared=shared, elements=({},) * count),))
    cells = make_family("gates", routes=["diagonal"]).build(genes, ShapeSettings())
    return replace(scenario_on(cells, ShapeSettings()), name=f"{count}_gates_{thickness:g}")


def sampled(count: int) -> list[Scenario]:
    """Return maps of the families without a route."""
    shapes, robot = ShapeSettings(), make_robot(WAFFLE)
    families = [FamilySpec(name=name) for name in WITHOUT_ROUTE]
    drawn = [draw_from(np.random.default_rng(FIRST_SEED + number), families, shapes, robot) for number in range(count)]
    return [replace(scenario_on(one.cells, shapes), name=str(number)) for number, one in enumerate(drawn)]


def changed() -> list[ControllerSpec]:
    """Return MPPI with each change."""
    return [ControllerSpec(name=f"mppi_{n}", kind="mppi", params=dict(one)) for n, one in enumerate(CHANGES.values())]


def times(rows: Sequence[Row]) -> str:
    """Return the median time of some runs, the least, the greatest and the failures."""
    found = [float(row["time_s"]) for row in rows if is_goal(row)]
    if not found:
        return f"none of {len(rows)}"
    failed = f", {len(rows) - len(found)} failed" if len(found) < len(rows) else ""
    return f"{median(found):.1f} ({min(found):.1f} to {max(found):.1f}{failed})"


def line(label: str, at_gates: Sequence[Row], elsewhere: Sequence[Row]) -> str:
    """Return the table line of one change."""
    goals = [row for row in elsewhere if is_goal(row)]
    cells = [times(at_gates), share(len(goals), len(elsewhere)), f"{fmean(float(row['time_s']) for row in goals):.1f}"]
    cells += [f"{fmean(float(row['min_clearance']) for row in goals):.3f}"]
    cells += [f"{fmean(float(row['n_contacts'] or 0) for row in elsewhere):.2f}"]
    return f"| {label} | " + " | ".join(cells) + " |"


def world_line(robot: str, navigation: str, seeds: int, options: Mapping[str, Any]) -> str:
    """Return the table line of a robot and a navigation preset."""
    run = load_preset("robust")["run"]
    run = {**run, "navigation": navigation, "environment": {**run["environment"], "robot": robot}}
    mended = ControllerSpec(name="mended", kind="mppi", params=CHANGES["vx_std 0.2 to 0.4"])
    settings = DriveSettings.from_mapping(run, "run")
    specs = ["dwb", "rpp", "mppi", mended]
    rows = bench([gates(4, 0.3, robot)], specs, repeats=seeds, settings=settings, **options).rows
    found = [times(of(rows, controller=name)) for name in ("dwb", "rpp", "mppi", "mended")]
    return f"| {robot} | {navigation} | " + " | ".join(found) + " |"


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--workers", type=int, default=2)
    args = parser.parse_args()
    settings = DriveSettings.from_mapping(load_preset("robust")["run"], "run")
    shared: dict[str, Any] = {"seed": 11, "workers": args.workers}
    options = {"settings": settings, **shared}
    maps = {(thickness, count): gates(count, thickness) for thickness in THICKNESSES for count in GATES}
    rows = bench(list(maps.values()), list(CONTROLLERS), repeats=args.seeds, **options).rows
    print(HEADERS[0])
    for (thickness, count), one in maps.items():
        own = [of(rows, map=one.name, controller=name) for name in CONTROLLERS]
        print(f"| {thickness:g} | {count} | " + " | ".join(map(times, own)) + " |")
    found = bench([gates(4, 0.3)], changed(), repeats=args.seeds, **options).rows
    elsewhere = bench(sampled(SAMPLED), changed(), repeats=1, **options).rows
    print(HEADERS[1])
    for spec, label in zip(changed(), CHANGES, strict=True):
        print(line(label, *(of(some, controller=spec.name) for some in (found, elsewhere))))
    print(HEADERS[2])
    for robot, navigation in WORLDS:
        print(world_line(robot, navigation, args.seeds, shared), flush=True)


if __name__ == "__main__":
    main()
