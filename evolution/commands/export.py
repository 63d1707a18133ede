"""``mapbench export``: maps as files for other programs, up to a ROS 2 package for Gazebo and Nav2."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from controllers.nav2_params import NavigationParams, mask_files, parameters_of_ours, write_nav2_params
from evolution.commands import driving_options, options
from evolution.commands.console import console
from evolution.commands.parameter_file import read_parameter_file
from evolution.driving import ControllerSpec, DriveSettings
from evolution.files import counted
from evolution.inputs import run_of
from evolution.runs import experiment_in
from evolution.search import DEFAULT_CONTROLLERS
from gym_mapbench.errors import ConfigError, unknown_name
from gym_mapbench.mapio import TaskedMap, group_scenarios, load_maps, load_scenarios
from gym_mapbench.mapio.conversion import write_maps
from gym_mapbench.mapio.formats import FORMATS, WRITTEN
from gym_mapbench.mapio.gazebo import export_gazebo
from gym_mapbench.mapio.gazebo_navigation import BundledNavigation
from gym_mapbench.mapio.mesh import WALL_HEIGHT
from gym_mapbench.world.scenario import Scenario

GAZEBO = "gazebo"
"""The format that needs more than maps."""
EXAMPLES = """  mapbench export runs/first --format gazebo --out package
  mapbench export maps.mapset.json --format map_server --out maps
  mapbench export runs/first --map map_1,map_3 --format gazebo --out package
  mapbench export office.yaml --format gazebo --params nav2_params.yaml --out package
  mapbench export office.yaml --format gazebo --nav2 jazzy --out package"""

WHO = (
    "the controller_plugins of the --params file; without a file, the controllers of the exported run, else "
    f"{','.join(DEFAULT_CONTROLLERS)}"
)


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the subcommand."""
    parser = options.example_parser(subparsers, "export", EXAMPLES)
    parser.add_argument("source", metavar="RUN_OR_MAPSET", help="run directory, map-set file, or any map")
    parser.add_argument("--format", required=True, metavar="NAME", help=f"one of {GAZEBO}, {', '.join(WRITTEN)}")
    parser.add_argument("--out", required=True, metavar="DIR", help="a new or empty directory")
    parser.add_argument(
        "--map", type=options.names, metavar="A,B,..", help="names of the maps that are written (default: all)"
    )
    parser.add_argument(
        "--wall-height",
        type=options.positive_number,
        default=WALL_HEIGHT,
        metavar="M",
        help=f"height of the walls in Gazebo (default {WALL_HEIGHT:g})",
    )
    driving_options.add_controllers_option(parser, WHO)
    options.add_task_options(parser)
    driving_options.add_drive_options(parser, "that of the exported run, else {}")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Write the files and print their number."""
    if args.format == GAZEBO:
        written = _export_gazebo(args)
    else:
        FORMATS.get(args.format, others=(GAZEBO,))
        written = write_maps(_maps(args), args.out, args.format)
    console.print(f"wrote {counted(len(written), 'file')} to {args.out}")
    return 0


def _maps(args: argparse.Namespace) -> list[TaskedMap]:
    """Return the chosen maps, with the start and goal of the command line in place of those of the files."""
    if args.start is not None or args.goal is not None:
        return group_scenarios(_scenarios(args))
    maps = load_maps(args.source)
    names = _chosen(args.map, [name for one in maps for name in one.names])
    kept = (one for one in maps if not names.isdisjoint(one.names))
    return [replace(one, tasks=tuple(task for task in one.tasks if task.name in names)) for one in kept]


def _scenarios(args: argparse.Namespace) -> list[Scenario]:
    """Return the chosen maps with their tasks."""
    scenarios = load_scenarios(args.source, start=args.start, goal=args.goal)
    names = _chosen(args.map, [scenario.name for scenario in scenarios])
    return [scenario for scenario in scenarios if scenario.name in names]


def _chosen(wanted: Sequence[str] | None, names: Sequence[str]) -> set[str]:
    """Return the names given, or all.

    Raises:
        ConfigError: If a name given is none of ``names``.
    """
    for name in wanted or ():
        if name not in names:
            raise ConfigError(f"--map: {unknown_name('map', name, names)}")
    return set(names if wanted is None else wanted)


def _export_gazebo(args: argparse.Namespace) -> list[Path]:
    """Write the ROS 2 package; without other options, with the controllers and the parameters of the exported run."""
    run = run_of([args.source])
    settings = driving_options.drive_settings(args, None if run is None else experiment_in(run).run)
    specs = driving_options.controllers_of(args, run)
    read = read_parameter_file(args)
    return export_gazebo(
        _scenarios(args),
        args.out,
        navigation=bundled(settings, specs, {} if read is None else read.ros_only),
        robot=settings.environment.robot,
        lidar=settings.environment.lidar,
        wall_height=args.wall_height,
        time_limit=settings.time_limit,
    )


def bundled(
    settings: DriveSettings, specs: tuple[ControllerSpec, ...], ros_only: Mapping[str, Any]
) -> BundledNavigation:
    """Return the navigation of a ROS 2 package.

    Args:
        settings: Its navigation is used.
        specs: The controllers that are compared.
        ros_only: By node, the parameters of a user's file that mean something in ROS only.

    Raises:
        ConfigError: If a controller is not one of Nav2's, or ROS has no counterpart of a setting.
    """
    navigation = compared(settings, specs)
    kept = {**ros_only, "controller_server": _renamed(ros_only.get("controller_server", {}), settings, specs)}
    return BundledNavigation(
        params=write_nav2_params(navigation, robot=settings.environment.robot, ros_only=kept),
        controllers=list(navigation.controllers),
        tree=navigation.bt.model_dump(),
        release=navigation.release,
        masks=mask_files(navigation),
        besides=parameters_of_ours(navigation),
    )


def _renamed(server: Mapping[str, Any], settings: DriveSettings, specs: tuple[ControllerSpec, ...]) -> dict[str, Any]:
    """Move the ROS-only parameters of a file's controllers to the compared ones, which may have other names."""
    named = settings.navigation.controllers
    kept = {key: value for key, value in server.items() if key not in named}
    for spec in specs:
        plugin = settings.navigation.controller(spec.registered_name)
        source = next((name for name, one in named.items() if one is plugin), "")
        kept |= {spec.name: server[source]} if source in server else {}
    return kept


def compared(settings: DriveSettings, specs: tuple[ControllerSpec, ...]) -> NavigationParams:
    """Return the navigation with one controller plugin per compared controller, under the name used in the comparison.

    Raises:
        ConfigError: If one of them is not a controller of Nav2.
    """
    plugins = {}
    for spec in specs:
        plugin = settings.navigation.controller(spec.registered_name)
        plugins[spec.name] = plugin.replace(params={**plugin.params, **spec.params})
    return settings.navigation.replace(controllers=plugins)
