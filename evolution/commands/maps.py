"""``mapbench maps``: measure maps, convert them to other formats, check their tasks, and draw new ones."""

from __future__ import annotations

import argparse
import json
import math
from dataclasses import asdict

from rich.table import Table

from evolution.commands import options
from evolution.commands.console import console
from evolution.commands.drawn_maps import add_draw
from gym_mapbench.mapio import load_maps, load_scenarios
from gym_mapbench.mapio.conversion import write_map_file
from gym_mapbench.mapio.movingai_check import check_scen
from gym_mapbench.mapmeasures import measure_map
from gym_mapbench.robot import RobotSpec, make_robot
from gym_mapbench.scenario import Scenario

EXAMPLES = """  mapbench maps info office.yaml --start 1,1,0 --goal 8,6,0
  mapbench maps convert arena.map.scen arena.yaml
  mapbench maps check arena.map.scen
  mapbench maps draw --family doors,pillars --count 4 --seed 1 --out drawn"""

METRES = {
    "resolution",
    "path_length",
    "narrowest_passage",
    "closest_obstacle",
    "average_visibility",
    "characteristic_dimension",
}
"""What is measured in m; all else are counts and shares."""


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the subcommand and its own subcommands."""
    parser = options.example_parser(subparsers, "maps", EXAMPLES)
    actions = parser.add_subparsers(dest="action", required=True, metavar="ACTION", parser_class=type(parser))
    _add_info(actions)
    _add_convert(actions)
    add_draw(actions)
    check = options.action_parser(
        actions, "check", "solve every task of a MovingAI .scen and compare with the optimal lengths it states"
    )
    check.add_argument("scen", metavar="FILE.scen")
    check.add_argument("--format", choices=("table", "json"), default="table")
    check.set_defaults(run=run_check)


def _add_info(actions: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    info = options.action_parser(actions, "info", "size, tasks and measures of maps in any format")
    info.add_argument("path", metavar="PATH")
    info.add_argument("--robot", metavar="NAME", default="turtlebot3_waffle")
    info.add_argument("--robot-radius", type=options.positive_number, metavar="M")
    info.add_argument("--format", choices=("table", "json"), default="table")
    info.add_argument("--limit", type=options.positive, default=20, metavar="N", help="tasks shown (default 20)")
    options.add_task_options(info)
    info.set_defaults(run=run_info)


def _add_convert(actions: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    convert = options.action_parser(
        actions, "convert", "read A in any format and write B in the format that its file name extension names"
    )
    convert.add_argument("source", metavar="A")
    convert.add_argument("target", metavar="B", help=".yaml (map_server), .png, .map (MovingAI) or .json (map set)")
    convert.set_defaults(run=run_convert)


def run_info(args: argparse.Namespace) -> int:
    """Measure the maps and print the results."""
    robot = make_robot(args.robot) if args.robot_radius is None else RobotSpec(radius=args.robot_radius)
    scenarios = load_scenarios(args.path, start=args.start, goal=args.goal)
    shown = scenarios[: args.limit]
    rows = [{"name": scenario.name, **_size(scenario), **measure_map(scenario, robot)} for scenario in shown]
    if args.format == "json":
        print(json.dumps({"tasks": len(scenarios), "maps": [_finite(row) for row in rows]}, indent=1, allow_nan=False))
        return 0
    for row in rows:
        table = Table("measure", "value", title=str(row.pop("name")))
        for name, value in row.items():
            unit = ", m" if name in METRES else ""
            table.add_row(f"{name}{unit}", f"{value:.4g}" if isinstance(value, float) else str(value))
        console.print(table)
    if len(shown) < len(scenarios):
        console.print(f"{len(shown)} of {len(scenarios)} tasks shown; --limit N shows more")
    return 0


def _size(scenario: Scenario) -> dict[str, object]:
    rows, cols = scenario.map.shape
    return {"rows": rows, "cols": cols, "resolution": scenario.map.resolution}


def run_convert(args: argparse.Namespace) -> int:
    """Convert a file and say what was written."""
    for path in write_map_file(load_maps(args.source), args.target):
        console.print(f"wrote {path}")
    return 0


def run_check(args: argparse.Namespace) -> int:
    """Solve every task; the exit code is 1 if a length differs from the stated optimum."""
    report = check_scen(args.scen)
    if args.format == "json":
        document = {**asdict(report), "path": str(report.path), "passed": report.passed}
        print(json.dumps(_finite(document), indent=1, allow_nan=False))
    else:
        print(report)
    return 0 if report.passed else 1


def _finite(row: dict[str, object]) -> dict[str, object]:
    """Replace numbers that are not finite by null: JSON has no infinity."""
    return {key: None if isinstance(value, float) and not math.isfinite(value) else value for key, value in row.items()}
