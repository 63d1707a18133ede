"""What people do to controllers: the same runs on sampled maps without people, and among more and more of them.

``python benchmarks/people.py [--maps N] [--seeds R] [--out FILE] [--plot FILE]`` samples maps of the families
without a route with ten people each, takes the first 0, 3, 6 and 10 of them, and runs DWB, MPPI, RPP and the shipped
policies. It prints shares with Wilson intervals, and medians with bootstrap intervals over maps. The tables of several
calls, with other ``--counts`` or ``--controllers``, are read together with ``--read FILE FILE``.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from run_tables import is_goal, of, over_maps, read_runs, share, share_and_ends, write_runs

from evolution import bench
from evolution.benchmark import time_lost
from evolution.driving import DriveSettings
from evolution.files import Row
from evolution.pictures import colour_of, new_figure
from evolution.search import load_preset, scenario_on
from gym_mapbench.generator import WITHOUT_ROUTE, FamilySpec, PeopleSettings, ShapeSettings, draw_from, with_people
from gym_mapbench.world.robot import make_robot
from gym_mapbench.world.scenario import Scenario

CONTROLLERS = ("dwb", "mppi", "rpp", "ppo=examples/policies/ppo.zip", "ppo_path=examples/policies/ppo_path.zip")
COUNTS = (0, 3, 6, 10)
FIRST_SEED = 5000
COLUMNS = ("map", "people", "controller", "repeat", "outcome", "time_s", "n_collisions_with_people")
MEASURES = ("min_distance_to_people", "personal_space_time", "intimate_space_time", "freezing_time")


def sample(maps: int, seed: int = FIRST_SEED) -> list[Scenario]:
    """Sample maps with room for ten people, from a seed on."""
    shapes, robot = ShapeSettings(), make_robot("turtlebot3_waffle")
    families = [FamilySpec(name=name) for name in WITHOUT_ROUTE]
    crowd, found = PeopleSettings(count=max(COUNTS)), list[Scenario]()
    while len(found) < maps:
        rng = np.random.default_rng(seed)
        drawn = draw_from(rng, families, shapes, robot)
        scenario = with_people(scenario_on(drawn.cells, shapes), crowd, rng)
        if len(scenario.bodies) == max(COUNTS):
            found.append(replace(scenario, name=f"{len(found):03d}_{drawn.family}"))
        seed += 1
    return found


def among(scenarios: Sequence[Scenario], count: int) -> list[Scenario]:
    """Return the scenarios with the first people only."""
    return [replace(one, bodies=one.bodies[:count]) for one in scenarios]


def summary(rows: Sequence[Row], alone: Sequence[Row]) -> dict[str, str]:
    """Return the table cells of one controller among a number of people.

    Args:
        rows: Its runs.
        alone: The runs without people.
    """
    lost = time_lost(rows, alone)
    cells = {"goal, %": share(rows), "goal without touching anybody, %": share(rows, is_clean)}
    cells["time / time without people"] = over_maps([(pair.map, pair.ratio) for pair in lost], np.median, 2)
    cells["time lost, s"] = over_maps([(pair.map, pair.seconds) for pair in lost], np.median, 1)
    for measure in MEASURES:
        values = [(str(row["map"]), float(row[measure])) for row in rows if row.get(measure) not in (None, "")]
        cells[measure] = over_maps(values, np.mean, 1)
    return cells


def driven(args: argparse.Namespace) -> list[Row]:
    """Run everything and return the runs; they are written after each number of people."""
    settings = DriveSettings.from_mapping(load_preset("people")["run"], "run")
    scenarios, rows = sample(args.maps, args.first_seed), list[Row]()
    for count in args.counts:
        options = {"settings": settings, "seed": 13, "repeats": args.seeds, "workers": args.workers}
        found = bench(among(scenarios, count), args.controllers, **options).rows
        rows += [{**row, "people": count} for row in found]
        if args.out:
            write_runs(args.out, rows, (*COLUMNS, *MEASURES))
    return rows


def read(paths: Sequence[Path]) -> list[Row]:
    """Read the runs of earlier calls."""
    rows = [row for path in paths for row in read_runs(path)]
    for row in rows:
        row["people"], row["n_collisions_with_people"] = int(row["people"]), float(row["n_collisions_with_people"] or 0)
    return rows


def plot(rows: Sequence[Row], path: Path) -> None:
    """Draw the shares of goals, and of goals without touching anybody, by the number of people."""
    names = list(dict.fromkeys(str(row["controller"]) for row in rows))
    counts = sorted({int(row["people"]) for row in rows})
    figure, panels = new_figure(columns=2, width=8.0, height=3.4, sharey=True)
    for axes, (title, wanted) in zip(
        panels, (("at the goal", is_goal), ("at the goal, nobody touched", is_clean)), strict=True
    ):
        for number, name in enumerate(names):
            points = [share_and_ends(of(rows, controller=name, people=count), wanted) for count in counts]
            places = np.array(counts) + 0.12 * (number - (len(names) - 1) / 2)
            middle, low, high = np.array(points).T
            spread = np.stack([middle - low, high - middle])
            axes.errorbar(places, middle, spread, color=colour_of(names, name), label=name, marker="o", markersize=4)
        axes.set(title=title, xlabel="people", xticks=counts, ylim=(0, 102))
    panels[0].set_ylabel("runs, % (95 %, Wilson)")
    panels[1].legend(frameon=False, fontsize=9)
    figure.savefig(path, dpi=110)


def is_clean(row: Row) -> bool:
    """Whether a run reached the goal, and the robot touched nobody while it moved."""
    return is_goal(row) and not row.get("n_collisions_with_people")


def main() -> None:
    """Run or read, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--maps", type=int, default=100)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--counts", type=int, nargs="+", default=COUNTS, choices=range(max(COUNTS) + 1), help="people")
    parser.add_argument("--controllers", nargs="+", default=CONTROLLERS)
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED, help="of the maps; others give other maps")
    parser.add_argument("--out", type=Path, help="file for the runs")
    parser.add_argument("--read", type=Path, nargs="+", help="runs that were written before, instead of new ones")
    parser.add_argument("--plot", type=Path, help="picture to draw")
    args = parser.parse_args()
    rows = read(args.read) if args.read else driven(args)
    alone = [row for row in rows if row["people"] == 0]
    for controller in dict.fromkeys(str(row["controller"]) for row in rows):
        for count in sorted({row["people"] for row in rows}):
            own = [row for row in rows if row["controller"] == controller and row["people"] == count]
            if own:
                print(f"| {controller} | {count} | " + " | ".join(summary(own, alone).values()) + " |")
    if args.plot:
        plot(rows, args.plot)


if __name__ == "__main__":
    main()
