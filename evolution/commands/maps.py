"""``mapbench maps``: measures maps, converts them to other formats, checks their tasks, and samples new maps."""

from __future__ import annotations

import argparse
import math
from dataclasses import asdict

from rich.table import Table

from controllers.nav2_params import NavigationParams, load_preset, robot_of
from evolution.commands import options
from evolution.commands.console import console, print_json
from evolution.commands.parameter_file import add_reading_options, read_parameter_file
from evolution.commands.sampled_maps import add_draw
from evolution.files import counted
from gym_mapbench.errors import ConfigError
from gym_mapbench.mapio import load_maps, load_scenarios
from gym_mapbench.mapio.conversion import write_map_file
from gym_mapbench.mapio.movingai_check import check_scen
from gym_mapbench.metrics.map_metrics import measure_map
from gym_mapbench.world.clearance import check_clearance
from gym_mapbench.world.robot import ROBOTS, RobotSpec, make_robot
from gym_mapbench.world.scenario import Scenario

EXAMPLES = """  mapbench maps info office.yaml --start 1,2,0 --goal 8,6,0
  mapbench maps info office.yaml --params nav2_params.yaml
  mapbench maps convert arena.map.scen arena.json --split 10
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
    "inflation_radius",
    "uninflated_width",
}
"""Measures in m; all others are counts and shares."""
ROBOT = "turtlebot3_waffle"


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
        "--params",
        metavar="FILE|PRESET",
        help="a nav2_params.yaml or a preset: measures for the footprint or robot_radius of the file, and for the "
        "inflation_radius of the global costmap",
    )
    add_reading_options(info)
    info.add_argument(
        "--robot",
        metavar="NAME",
        help=f"robot to measure for: {options.names_in(ROBOTS)} (default: the robot of the --params file; without one "
        f"{ROBOT})",
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
    convert.add_argument(
        "--split",
        type=options.positive,
        default=1,
        metavar="N",
        help="split each cell into N x N cells: controllers stand still on cells of 1 m, as MovingAI's are",
    )
    convert.set_defaults(run=run_convert)


def run_info(args: argparse.Namespace) -> int:
    """Measure the maps and print the results."""
    robot, navigation = _measured_for(args)
    scenarios = load_scenarios(args.path, start=args.start, goal=args.goal)
    shown = scenarios[: args.limit]
    rows = [{"name": scenario.name, **_size(scenario), **_measures(scenario, robot, navigation)} for scenario in shown]
    if args.format == "json":
        print_json({"tasks": len(scenarios), "maps": rows})
        return 0
    for row, scenario in zip(rows, shown, strict=True):
        _print_measures(row)
        if not row["solvable"]:
            console.print(f"{scenario.name}: {_why_unsolvable(scenario, robot, row)}")
    if len(shown) < len(scenarios):
        console.print(f"{len(shown)} of {counted(len(scenarios), 'task')} shown; --limit N shows more")
    return 0


def _measured_for(args: argparse.Namespace) -> tuple[RobotSpec, NavigationParams | None]:
    """Return the robot, and the Nav2 parameters of ``--params``; None without them."""
    read = read_parameter_file(args)
    if args.robot is not None and args.robot_radius is not None:
        raise ConfigError("--robot and --robot-radius: expected one of them, got both")
    robot = make_robot(args.robot or ROBOT)
    if args.robot_radius is not None:
        robot = RobotSpec(radius=args.robot_radius)
    elif args.robot is None and read is not None:
        robot = robot_of(read, robot)
    if read is not None:
        return robot, read.navigation
    return robot, None if args.params is None else load_preset(args.params)


def _measures(scenario: Scenario, robot: RobotSpec, navigation: NavigationParams | None) -> dict[str, float]:
    """Return the measures of a map for a robot, with those of the global costmap's inflation if it is known.

    ``uninflated_width`` is the width of the lane without inflation cost in the narrowest place of the widest way, m.
    """
    measures = measure_map(scenario, robot)
    if navigation is not None:
        costmap = navigation.global_costmap
        reach = costmap.inflation_layer.inflation_radius if "inflation_layer" in costmap.plugins else 0.0
        width = max(0.0, measures["narrowest_passage"] - 2.0 * reach)
        measures |= {"inflation_radius": reach, "uninflated_width": width}
    return measures


def _size(scenario: Scenario) -> dict[str, object]:
    """Return rows, columns, resolution and bounds of a map."""
    rows, cols = scenario.map.shape
    corners = zip(("x_min", "y_min", "x_max", "y_max"), map(float, scenario.map.bounds), strict=True)
    return {"rows": rows, "cols": cols, "resolution": scenario.map.resolution, **dict(corners)}


def _print_measures(row: dict[str, object]) -> None:
    """Print the measures of one map; a measure without a value is a dash."""
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
    """Say in one line why the robot cannot reach the goal."""
    try:
        check_clearance(scenario, robot)
    except ConfigError as error:
        return str(error)
    return (
        f"no way from start to goal is wide enough for the robot ({robot.name}, radius "
        f"{robot.circumscribed_radius:g} m); the narrowest place of the widest way is "
        f"{row['narrowest_passage']:.3g} m wide"
    )


def run_convert(args: argparse.Namespace) -> int:
    """Convert a file and print the names of the new files."""
    for path in write_map_file([one.split(args.split) for one in load_maps(args.source)], args.target):
        console.print(f"wrote {path}")
    return 0


def run_check(args: argparse.Namespace) -> int:
    """Solve every task; the exit code is 1 if a length differs from the stated optimum."""
    report = check_scen(args.scen)
    if args.format == "json":
        print_json({**asdict(report), "path": str(report.path), "passed": report.passed})
    else:
        print(report)
    return 0 if report.passed else 1
