"""Options that several commands share, and what they mean."""

from __future__ import annotations

import argparse
import math
from pathlib import Path

from controllers.nav2_params import PRESETS, Nav2Params, NavigationParams, load_preset, read_nav2_params
from evolution.commands.progress import note
from evolution.driving import ControllerSpec, DriveSettings, available_cores
from evolution.search import DEFAULT_CONTROLLERS, controllers_from
from gym_mapbench.config import EnvConfig
from gym_mapbench.errors import ConfigError
from gym_mapbench.noise import NOISES
from gym_mapbench.robot import RobotSpec, make_robot
from gym_mapbench.scenario import Pose


def example_parser(
    subparsers: argparse._SubParsersAction[argparse.ArgumentParser], name: str, summary: str, examples: str
) -> argparse.ArgumentParser:
    """Add a subcommand whose help ends with examples."""
    return subparsers.add_parser(
        name,
        help=summary,
        description=summary,
        epilog="examples:\n" + examples,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )


def add_drive_options(parser: argparse.ArgumentParser) -> None:
    """Add the options that say who drives what robot in which world."""
    group = parser.add_argument_group("who drives, and how")
    group.add_argument(
        "--params",
        metavar="FILE|PRESET",
        help="a nav2_params.yaml, whose controller_plugins drive unless others are named, or the preset thesis "
        "(Nav2's examples; the default) or fair (same limits for all)",
    )
    group.add_argument("--robot", metavar="NAME", help="turtlebot3_waffle, turtlebot3_burger or jackal")
    group.add_argument(
        "--robot-radius", type=positive_number, metavar="M", help="radius of the robot's disc and of its costmaps"
    )
    group.add_argument("--time-limit", type=positive_number, metavar="S", help="simulated seconds a run may take")
    group.add_argument(
        "--contact",
        choices=("ends", "slides"),
        help="whether touching a wall ends the run or the robot slides on, as in Gazebo",
    )
    group.add_argument("--noise", choices=tuple(NOISES), help="noise of sensors, localisation, motors and start pose")


def add_unknown_map_option(parser: argparse.ArgumentParser) -> None:
    """Add ``--unknown-map``."""
    parser.add_argument(
        "--unknown-map",
        action="store_true",
        help="Nav2's global costmap does not know the map: only the sensors fill it, and paths may cross the unknown",
    )


def add_controllers_option(parser: argparse.ArgumentParser) -> None:
    """Add ``--controllers``."""
    parser.add_argument(
        "--controllers",
        metavar="A,B,..",
        help="names, NAME=KIND to compare one kind twice, or NAME=model.zip (default: the controller_plugins of the "
        f"--params file, without one {','.join(DEFAULT_CONTROLLERS)})",
    )


def add_work_options(parser: argparse.ArgumentParser) -> None:
    """Add ``--seed`` and ``--workers``."""
    parser.add_argument("--seed", type=non_negative, metavar="N", help="root of all randomness (default 0)")
    parser.add_argument("--workers", type=positive, metavar="N", help="worker processes (default: all cores)")


def add_task_options(parser: argparse.ArgumentParser) -> None:
    """Add ``--start`` and ``--goal``."""
    parser.add_argument("--start", type=pose, metavar="X,Y,YAW", help="start pose, m and rad")
    parser.add_argument("--goal", type=pose, metavar="X,Y,YAW", help="goal pose, m and rad")


def positive(text: str) -> int:
    """Read a whole number of at least 1."""
    return _whole(text, 1)


def non_negative(text: str) -> int:
    """Read a whole number of at least 0."""
    return _whole(text, 0)


def _whole(text: str, least: int) -> int:
    try:
        value = int(text)
    except ValueError:
        value = least - 1
    if value < least:
        raise argparse.ArgumentTypeError(f"expected a whole number of at least {least}, got {text!r}")
    return value


def positive_number(text: str) -> float:
    """Read a finite number above 0."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0 < value < math.inf:
        raise argparse.ArgumentTypeError(f"expected a finite number above 0, got {text!r}")
    return value


def pose(text: str) -> Pose:
    """Read ``x,y,yaw`` or ``x,y``."""
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) not in (2, 3) or not all(map(math.isfinite, numbers)):
        raise argparse.ArgumentTypeError(f"expected x,y,yaw in m and rad, all finite, got {text!r}")
    return Pose(*numbers)


def controllers_of(args: argparse.Namespace) -> tuple[ControllerSpec, ...]:
    """Who drives: the named, or else the controllers of the parameter file, or else the defaults."""
    return named_controllers(args) or controllers_from(DEFAULT_CONTROLLERS)


def named_controllers(args: argparse.Namespace) -> tuple[ControllerSpec, ...]:
    """Controllers of ``--controllers``, or else of the file of ``--params``; empty if neither names any."""
    if args.controllers is not None:
        return listed_controllers(args.controllers)
    if args.params is None or args.params in PRESETS:
        return ()
    read = _read_file(args.params)
    return controllers_from(
        [name for name in read.navigation.controllers if f"controllers.{name}" not in read.defaulted]
    )


def listed_controllers(text: str) -> tuple[ControllerSpec, ...]:
    """Read ``name`` or ``name=kind``, separated by commas."""
    names = [part.strip() for part in text.split(",")]
    if not all(names):
        raise ConfigError(f"--controllers: expected names separated by commas, got {text!r}")
    return controllers_from(names)


def workers_of(args: argparse.Namespace) -> int:
    """Number of worker processes: as asked for, or all cores."""
    return args.workers or available_cores()


def drive_settings(args: argparse.Namespace, base: DriveSettings | None = None) -> DriveSettings:
    """World and navigation as the options say, everything else as in ``base``."""
    settings = base or DriveSettings(navigation="thesis")
    if args.params is not None:
        settings = settings.replace(navigation=_read_params(args.params))
    return settings.replace(environment=_environment(args, settings)).replace(navigation=_navigation(args, settings))


def _read_params(name: str) -> NavigationParams:
    """Load a preset or a user's file; says what of it has no effect here and why, and what a preset fills in."""
    if name in PRESETS:
        return load_preset(name)
    read = _read_file(name)
    for what, names in (
        ("ignored, because only ROS reads them", read.ignored),
        ("ignored, because Nav2 does not use them either", read.unused),
        ("not modelled here, though they may change how the real robot drives", read.unmodelled),
        ("not given there, taken from the preset thesis", read.defaulted),
    ):
        if names:
            note(f"{name}: {what}: {', '.join(names)}")
    return read.navigation


def _read_file(name: str) -> Nav2Params:
    """Read a user's file; a name of no file may be a misspelt preset."""
    if not Path(name).exists():
        raise ConfigError(f"--params: expected a file or one of the presets {', '.join(PRESETS)}, got {name!r}")
    return read_nav2_params(name)


def _environment(args: argparse.Namespace, settings: DriveSettings) -> EnvConfig:
    if args.robot is not None and args.robot_radius is not None:
        raise ConfigError("--robot and --robot-radius: expected one of them, got both")
    robot = make_robot(args.robot) if args.robot is not None else _robot_of(settings, args.params is not None)
    if args.robot_radius is not None:
        robot = robot.replace(name="custom", radius=args.robot_radius, footprint=None)
    changes = {
        "robot": robot,
        "time_limit": args.time_limit,
        "collision_ends_episode": None if args.contact is None else args.contact == "ends",
        "noise": args.noise,
    }
    return settings.environment.replace(**{key: value for key, value in changes.items() if value is not None})


def _robot_of(settings: DriveSettings, from_params: bool) -> RobotSpec:
    """The robot: its shape is the costmaps' where a parameter file gives one."""
    robot = settings.environment.robot
    costmap = settings.navigation.local_costmap
    if not from_params or (costmap.robot_radius is None and costmap.footprint is None):
        return robot
    shape = (
        {"footprint": costmap.footprint} if costmap.footprint else {"radius": costmap.robot_radius, "footprint": None}
    )
    return robot.replace(name="custom", **shape)


def _navigation(args: argparse.Namespace, settings: DriveSettings) -> object:
    """Nav2's parameters; a robot named on the command line also shapes the costmaps."""
    navigation = settings.navigation
    if args.robot is None and args.robot_radius is None:
        return navigation
    shape = {"robot_radius": args.robot_radius, "footprint": None}
    return navigation.replace(
        local_costmap=navigation.local_costmap.replace(**shape),
        global_costmap=navigation.global_costmap.replace(**shape),
    )
