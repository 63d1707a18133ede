"""``mapbench validate``: compare this project with recorded results of Nav2's own code."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence

from evolution.commands import options
from evolution.commands.console import errors, print_json, print_table
from evolution.driving import Resources, available_cores, run_job, warm_up
from evolution.files import Table
from evolution.validation import (
    AroundOracle,
    LayersOracle,
    Measure,
    Oracle,
    PlantOracle,
    PlantRuns,
    around_measures,
    closed_loop_measures,
    costmap_measures,
    disagreements,
    drive_recorded,
    dwb_measures,
    dynamic_window_measures,
    layer_measures,
    local_plan_measures,
    mppi_measures,
    navfn_measures,
    other_measures,
    plant_measures,
    plant_run_measures,
    rpp_measures,
)

EXAMPLES = """  mapbench validate nav2-oracle
  mapbench validate nav2-oracle --format json > validation.json
  mapbench validate nav2-oracle --units-only           single calls only, in a few seconds
  mapbench validate nav2-oracle-layers                 costmap layers, fed with recorded scans
  mapbench validate nav2-bt-oracle                     behaviour tree, recoveries, controller server, smoother
  mapbench validate fortress-plant                     motion, contacts and runs in the physics of Gazebo Fortress
  mapbench validate fortress-plant --units-only        motion and contacts only, in seconds"""

UNIT_MEASURES = (
    costmap_measures,
    navfn_measures,
    local_plan_measures,
    rpp_measures,
    dynamic_window_measures,
    dwb_measures,
    other_measures,
    mppi_measures,
)
"""Measures of single calls; those of a controller that is not built for the recorded release are left out."""


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the subcommand."""
    parser = options.example_parser(subparsers, "validate", EXAMPLES)
    parser.add_argument("directory", metavar="DIR", help="directory of recorded results")
    parser.add_argument("--format", choices=("table", "json"), default="table")
    parser.add_argument("--units-only", action="store_true", help="compare single calls only, no whole runs")
    parser.add_argument("--workers", type=options.positive, metavar="N", help="worker processes (default: all cores)")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Measure and print; the exit code is 1 if a target is missed."""
    measures, differing = measure(args)
    if args.format == "json":
        print_json(_document(measures, differing))
    else:
        _print_table(measures)
        for line in differing:
            errors.print(f"differs: {line}")
    missed = [one for one in measures if one.missed]
    for one in missed:
        errors.print(f"missed: {one.key} is {one.value:.6g}, expected {one.target}")
    return 1 if missed else 0


def measure(args: argparse.Namespace) -> tuple[list[Measure], list[str]]:
    """Compare with the recordings of a directory; returns the measures, and a line for each run that ended differently.

    The directory's files tell which recordings they are.
    """
    take = next((take for is_in, take in RECORDINGS if is_in(args.directory)), None)
    return measure_navigation(args) if take is None else (take(args), [])


def measure_plant(args: argparse.Namespace) -> list[Measure]:
    """Compare with recorded motion, contacts and whole runs in the physics of Gazebo Fortress."""
    measures, recorded = plant_measures(PlantOracle(args.directory)), PlantRuns(args.directory)
    if args.units_only or not recorded:
        return measures
    with Resources(workers=args.workers).evaluator(run_job, warm_up=warm_up) as evaluator:
        return measures + plant_run_measures(recorded, evaluator.run)


RECORDINGS: tuple[tuple[Callable[[str], bool], Callable[[argparse.Namespace], list[Measure]]], ...] = (
    (PlantOracle.is_in, measure_plant),
    (AroundOracle.is_in, lambda args: around_measures(AroundOracle(args.directory))),
    (LayersOracle.is_in, lambda args: layer_measures(LayersOracle(args.directory))),
)
"""Kinds of recordings beside those of navigation: whether a directory holds them, and their measures."""


def measure_navigation(args: argparse.Namespace) -> tuple[list[Measure], list[str]]:
    """Compare with recorded costmaps, plans, commands and runs, and name the runs that ended differently."""
    oracle = Oracle(args.directory)
    measures = [measure for take in UNIT_MEASURES for measure in take(oracle)]
    if args.units_only:
        return measures, []
    episodes = drive_recorded(oracle, args.workers or available_cores())
    return measures + closed_loop_measures(episodes), disagreements(episodes)


def _document(measures: Sequence[Measure], differing: Sequence[str]) -> dict[str, object]:
    """Return every measure with its target, and the runs that ended differently."""
    names = ("value", "count", "worst", "target", "missed")
    return {one.key: {name: getattr(one, name) for name in names} for one in measures} | {"disagreements": differing}


def _print_table(measures: Sequence[Measure]) -> None:
    rows = [
        {
            "measure": one.key,
            "value": f"{one.value:.6g}",
            "target": one.target,
            "cases": one.count,
            "worst case": one.worst,
        }
        for one in measures
    ]
    print_table(Table(rows, "Against the recordings"))
