"""``mapbench maps``: measure maps, convert them to other formats, check their tasks, and draw new ones."""

from __future__ import annotations

import argparse
import json
import math
from dataclasses import asdict

from rich.table import Table

from evolution.commands import options
from evolution.commands.console import console
from evolution.commands.sampled_maps import add_draw
from gym_mapbench.errors import ConfigError
from gym_mapbench.mapio import load_maps, load_scenarios
from gym_mapbench.mapio.conversion import write_map_file
from gym_mapbench.mapio.movingai_check import check_scen
from gym_mapbench.metrics.map_metrics import measure_map
from gym_mapbench.world.clearance import check_clearance
from gym_mapbench.world.robot import ROBOTS, RobotSpec, make_robot
from gym_mapbench.world.scenario import Scenario

EXAMPLES = """  mapbench maps info office.yaml --start 1,1,0 --goal 8,6,0
  mapbench maps convert arena.map.scen arena.yaml
  mapbench maps check arena.map.scen
  mapbench maps draw --family doors,pillars --count 4 --seed 1 --out drawn"""

METRES = {
    "resolution",
    "x_min",
    "y_min",
    "x_max",
    "y_max",
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
    info.add_argument("path", metavar="PATH", help="a map in any format; see mapbench list formats")
    info.add_argument(
        "--robot",
        metavar="NAME",
        default="turtlebot3_waffle",
        help=f"robot that is to get through: {options.names_in(ROBOTS)} (default turtlebot3_waffle)",
    )
    info.add_argument(
        "--robot-radius", type=options.positive_number, metavar="M", help="radius of a robot of your own, a disc"
    )
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
    for row, scenario in zip(rows, shown, strict=True):
        _print_measures(row)
        if not row["solvable"]:
            console.print(f"{scenario.name}: {_why_unsolvable(scenario, robot, row)}")
    if len(shown) < len(scenarios):
        console.print(f"{len(shown)} of {len(scenarios)} tasks shown; --limit N shows more")
    return 0


def _size(scenario: Scenario) -> dict[str, object]:
    """Return the size in cells, and between which x and y the map lies."""
    rows, cols = scenario.map.shape
    corners = zip(("x_min", "y_min", "x_max", "y_max"), map(float, scenario.map.bounds), strict=True)
    return {"rows": rows, "cols": cols, "resolution": scenario.map.resolution, **dict(corners)}


def _print_measures(row: dict[str, object]) -> None:
    """Print what was measured of one map; what has no value is a dash."""
    table = Table(title=str(row["name"]))
    table.add_column("measure")
    table.add_column("value", justify="right")
    for name, value in row.items():
        if name != "name":
            table.add_row(f"{name}, m" if name in METRES else name, _number(value))
    console.print(table)


def _number(value: object) -> str:
    if not isinstance(value, float):
        return str(value)
    return "-" if math.isnan(value) else f"{value:.4g}"


def _why_unsolvable(scenario: Scenario, robot: RobotSpec, row: dict[str, object]) -> str:
    """Say in one line what is in the way of the robot."""
    try:
        check_clearance(scenario, robot)
    except ConfigError as error:
        return str(error)
    return (
        f"no way from start to goal is wide enough for the robot ({robot.name}, radius "
        f"{robot.circumscribed_radius:g} m); the widest has a place of {row['narrowest_passage']:.3g} m"
    )


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
