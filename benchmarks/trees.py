"""What the behaviour tree does to controllers: the same maps, noise and people with other rules of planning.

``python benchmarks/trees.py [--maps N] [--seeds R] [--people P ...] [--trees T ...] [--out FILE]`` samples maps of the
families without a route, with and without people, and runs DWB, MPPI and RPP with Nav2's default tree (a plan each
second), with a plan every five seconds, with one after each metre, and with one only where the path is no longer free;
or, if ``--trees`` names them, with a smoothed plan each second. It prints shares with Wilson intervals, McNemar's exact
test, paired ratios and means with bootstrap intervals, over maps. ``--out`` is continued.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from people import among, sample
from run_tables import compared, of, over_maps, read_runs, share, write_runs

from controllers.behaviors import BehaviorTree
from evolution import bench
from evolution.driving import DriveSettings
from evolution.files import Row
from evolution.search import load_preset

XML = Path(__file__).parents[1] / "examples" / "behavior_trees"
DEFAULT = "each second (default)"
REPLANNING = {
    DEFAULT: {},
    "every 5 s": {"replanning_frequency": 0.2},
    "after each metre": {"xml": (XML / "replan_by_distance.xml").read_text(encoding="utf-8")},
    "if the path is not free": {"xml": (XML / "replan_if_invalid.xml").read_text(encoding="utf-8")},
}
SMOOTHERS = {"smoothed: simple": "simple", "smoothed: Savitzky-Golay": "savitzky_golay"}
SMOOTHED = {"xml": (XML / "smooth_path.xml").read_text(encoding="utf-8")}
TREES = REPLANNING | dict.fromkeys(SMOOTHERS, SMOOTHED)
CONTROLLERS = ("dwb", "mppi", "rpp")
FIRST_SEED = 9000
COLUMNS = ("people", "tree", "map", "controller", "repeat", "outcome", "time_s")
MEASURES = ("n_replans", "n_recoveries", "min_clearance")
HEADER = "people | controller | plans | goal, % | goal in one only | time ratio | plans a run | recoveries"


def driven(args: argparse.Namespace) -> list[Row]:
    """Run everything that the table of earlier runs lacks, and return all runs; they are written after each part."""
    settings = DriveSettings.from_mapping(load_preset("people")["run"], "run")
    scenarios = sample(args.maps, args.first_seed)
    rows = read_runs(args.out) if args.out.exists() else []
    done = {(int(row["people"]), row["tree"]) for row in rows}
    for count in args.people:
        for name in args.trees:
            if (count, name) in done:
                continue
            smoothers = {"only": {"kind": SMOOTHERS[name]}} if name in SMOOTHERS else {}
            navigation = settings.navigation.replace(bt=BehaviorTree(**TREES[name]), smoothers=smoothers)
            own = settings.replace(navigation=navigation)
            options = {"settings": own, "seed": 29, "repeats": args.seeds, "workers": args.workers}
            found = bench(among(scenarios, count), args.controllers, **options).rows
            rows += [{**row, "people": count, "tree": name} for row in found]
            write_runs(args.out, rows, (*COLUMNS, *MEASURES))
    return [{**row, "people": int(row["people"])} for row in read_runs(args.out)]


def cells(rows: Sequence[Row], before: Sequence[Row]) -> list[str]:
    """Return the table cells of one controller with one tree.

    Args:
        rows: Its runs.
        before: The same runs with the default tree.
    """
    paired = compared(before, rows)
    ratio = f"{paired.time_ratio:.3f} ({paired.ratio_low:.3f} to {paired.ratio_high:.3f})"
    means = [
        over_maps([(str(row["map"]), float(row[measure] or 0)) for row in rows], np.mean, 1)
        for measure in ("n_replans", "n_recoveries")
    ]
    return [share(rows), f"+{paired.wins} -{paired.losses} (p = {paired.p_success:.2g})", ratio, *means]


def main() -> None:
    """Run, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--maps", type=int, default=100, help="sampled maps (default 100)")
    parser.add_argument("--seeds", type=int, default=1, help="runs of each controller on each map (default 1)")
    parser.add_argument("--first-seed", type=int, default=FIRST_SEED, help="seed of the first map (default 9000)")
    parser.add_argument("--controllers", nargs="+", default=CONTROLLERS, help="controllers (default all three)")
    parser.add_argument("--people", type=int, nargs="+", default=[0, 6], help="numbers of people (default 0 and 6)")
    parser.add_argument("--trees", nargs="+", default=tuple(REPLANNING), choices=TREES, help="trees, the default first")
    parser.add_argument("--workers", type=int, default=2, help="processes (default 2)")
    parser.add_argument("--out", type=Path, default=Path("trees.csv"), help="table of runs (default trees.csv)")
    args = parser.parse_args()
    rows = driven(args)
    print(f"| {HEADER} |")
    print("|---" * len(HEADER.split(" | ")) + "|")
    for count in args.people:
        for controller in args.controllers:
            before = of(rows, people=count, controller=controller, tree=DEFAULT)
            for tree in args.trees:
                found = cells(of(rows, people=count, controller=controller, tree=tree), before)
                print(f"| {count} | {controller} | {tree} | {' | '.join(found)} |")


if __name__ == "__main__":
    main()
