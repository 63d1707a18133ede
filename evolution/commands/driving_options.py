"""Options of the commands that run controllers, and the values built from them."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from controllers.nav2_params import NavigationParams, counterpart
from evolution.benchmark import refuse_ruled
from evolution.commands.options import MESSAGE_OPTIONS, names_in, non_negative, positive, positive_number, seconds
from evolution.commands.parameter_file import add_reading_options, describe_parameter_file, read_parameter_file
from evolution.driving import (
    DEFAULT_RESOURCES,
    EXECUTORS,
    ControllerSpec,
    DriveSettings,
    ParameterFile,
    Resources,
    chosen_robot,
    take_shape_of_robot,
    with_parameters,
    with_robot,
)
from evolution.runs import LoadedRun, experiment_in
from evolution.search import DEFAULT_CONTROLLERS, controllers_from
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.errors import ConfigError
from gym_mapbench.planners import PLANNERS
from gym_mapbench.releases import Release
from gym_mapbench.ros_params import parse_defines
from gym_mapbench.world.noise import NOISES
from gym_mapbench.world.robot import ROBOTS

RESOURCE_OPTIONS = ("workers", "executor", "scheduler", "wait", "run_timeout")
"""Options that :func:`resources_of` reads."""
DEFAULT_PARAMS = "thesis"
WORLD = EnvConfig()
OF_THE_FILE = f"the controller_plugins of the --params file; without a file, {','.join(DEFAULT_CONTROLLERS)}"
"""Default controllers, if the maps are not those of a run."""
SEVERAL_FILES = (
    "; given several times, the parameter sets are compared in pairs; a set is called LABEL, else by its file's name"
)
OF_THE_RUN = "that of the run whose maps are used, else {}"
"""Default of the options of a command that takes the maps of a run or other maps."""


def add_drive_options(
    parser: argparse.ArgumentParser, default: str = "{}", noise: str | None = None, *, several: bool = False
) -> None:
    """Add the options about the parameters, the robot and the world.

    Args:
        parser: Gets them.
        default: Default of the options; ``{}`` stands for the value without a file or a run.
        noise: Default of ``--noise``; if None, there is no noise, or that of the run.
        several: Whether ``--params`` may be given several times, each with a label.
    """
    group = parser.add_argument_group("controllers, robot and world")
    group.add_argument(
        "--params",
        action="append" if several else "store",
        metavar="[LABEL=]FILE|PRESET" if several else "FILE|PRESET",
        help="a nav2_params.yaml, whose controller_plugins are compared unless others are named, or a preset: thesis, "
        "jazzy or lyrical (examples of Humble, Jazzy and Lyrical); fair, jazzy_fair or lyrical_fair (same limits for "
        f"all) (default: {default.format(DEFAULT_PARAMS)})" + (SEVERAL_FILES if several else ""),
    )
    group.add_argument(
        "--planner", metavar="NAME", help=f"global planner: {names_in(PLANNERS)} (default: that of the parameters)"
    )
    group.add_argument(
        "--robot",
        metavar="NAME|FILE",
        help=f"{names_in(ROBOTS)}, or a YAML file with the options of a robot (default: that of the --params file; "
        f"without one {default.format(WORLD.robot.name)})",
    )
    add_reading_options(group)
    _add_world_options(group, default, noise)


def _add_world_options(group: argparse._ArgumentGroup, default: str, noise: str | None) -> None:
    """Add the options about the world; arguments as for :func:`add_drive_options`."""
    group.add_argument(
        "--robot-radius",
        type=positive_number,
        metavar="M",
        help="radius of the robot, here a disc, in the world and in its costmaps",
    )
    add_time_limit_option(group, default)
    group.add_argument(
        "--contact",
        choices=("ends", "slides"),
        help="whether contact with a wall ends the run, or the robot slides along it as in Gazebo (default: "
        f"{default.format('ends')})",
    )
    group.add_argument(
        "--noise",
        metavar="NAME",
        default=noise,
        help=f"noise of sensors, localisation, motors and start pose: {names_in(NOISES)} (default: "
        f"{default.format(noise or 'none')})",
    )


def add_time_limit_option(group: argparse._ActionsContainer, default: str = "{}") -> None:
    """Add ``--time-limit``; ``default`` as for :func:`add_drive_options`."""
    group.add_argument(
        "--time-limit",
        type=positive_number,
        metavar="S",
        help=f"simulated seconds a run may take (default: {default.format(f'{WORLD.time_limit:g}')})",
    )


def add_unknown_map_option(parser: argparse.ArgumentParser) -> None:
    """Add ``--unknown-map``."""
    parser.add_argument(
        "--unknown-map",
        action="store_true",
        help="Nav2's global costmap does not hold the map: only the sensors fill it, and paths may cross unknown cells",
    )


def add_controllers_option(parser: argparse.ArgumentParser, default: str = OF_THE_FILE) -> None:
    """Add ``--controllers`` with its default."""
    parser.add_argument(
        "--controllers",
        metavar="A,B,..",
        help="names, NAME=KIND to compare one kind twice, or NAME=model.zip, which runs code in that file, so name "
        f"only files that you trust (default: {default})",
    )


def add_seed_option(parser: argparse.ArgumentParser, default: str = "0") -> None:
    """Add ``--seed``."""
    parser.add_argument("--seed", type=non_negative, metavar="N", help=f"root of all randomness (default {default})")


def add_resource_options(parser: argparse.ArgumentParser) -> None:
    """Add :data:`RESOURCE_OPTIONS`."""
    parser.add_argument("--workers", type=positive, metavar="N", help="worker processes (default: all cores)")
    parser.add_argument(
        "--wait",
        type=seconds,
        default=DEFAULT_RESOURCES.wait_s,
        metavar="S",
        help=f"seconds to wait for another process that has locked the results (default {DEFAULT_RESOURCES.wait_s:g})",
    )
    parser.add_argument(
        "--run-timeout",
        type=positive_number,
        default=DEFAULT_RESOURCES.run_timeout_s,
        metavar="S",
        help="wall-clock seconds after which a run ends in an error and its worker is replaced (default "
        f"{DEFAULT_RESOURCES.run_timeout_s:g})",
    )
    parser.add_argument(
        "--executor",
        default=DEFAULT_RESOURCES.executor,
        metavar="NAME",
        help=f"executor of the runs: {names_in(EXECUTORS)}",
    )
    parser.add_argument(
        "--scheduler",
        metavar="ADDRESS",
        help="tcp://HOST:PORT of the scheduler, with --executor dask (default: a cluster of "
        "--workers processes on this machine)",
    )


def repeatable(given: Sequence[str]) -> list[str]:
    """Return the arguments of a command without those that do not change its result, for its page."""
    flags = {f"--{name.replace('_', '-')}" for name in RESOURCE_OPTIONS}
    kept: list[str] = []
    rest = iter(given)
    for argument in rest:
        if argument in flags:
            next(rest, None)
        elif argument not in ("--resume", *MESSAGE_OPTIONS) and argument.partition("=")[0] not in flags:
            kept.append(argument)
    return kept


def controllers_of(args: argparse.Namespace, run: LoadedRun | None = None) -> tuple[ControllerSpec, ...]:
    """Return the controllers: those named, else those of the parameter file, else those of a run, else the defaults.

    Args:
        args: The parsed options.
        run: The run whose maps are used.
    """
    if named := named_controllers(args, controllers_known_from(run, args)):
        return named
    return controllers_from(DEFAULT_CONTROLLERS) if run is None else experiment_in(run).controllers


def named_controllers(args: argparse.Namespace, known: Sequence[ControllerSpec] = ()) -> tuple[ControllerSpec, ...]:
    """Return the controllers of ``--controllers``, ``--only`` or the ``--params`` file; empty if there are none.

    Args:
        args: The parsed options.
        known: Controllers that are known by their names (see :func:`controllers_known_from`).
    """
    if args.controllers is not None:
        return listed_controllers(args.controllers, known)
    read = read_parameter_file(args)
    if read is None:
        return ()
    return controllers_from([args.only] if args.only else list(read.own_controllers))


def controllers_known_from(searched: LoadedRun | None, args: argparse.Namespace) -> tuple[ControllerSpec, ...]:
    """Return the controllers of the run whose maps are used; none without a run, or if ``--params`` is given."""
    return () if searched is None or args.params is not None else experiment_in(searched).controllers


def listed_controllers(text: str, known: Sequence[ControllerSpec] = ()) -> tuple[ControllerSpec, ...]:
    """Read ``name`` or ``name=kind``, separated by commas; the name of a known controller means that one."""
    names = [part.strip() for part in text.split(",")]
    if not all(names):
        raise ConfigError(f"--controllers: expected names separated by commas, got {text!r}")
    own = {spec.name: spec.model_dump() for spec in known}
    return controllers_from([own.get(name, name) for name in names])


def parameter_file(args: argparse.Namespace) -> ParameterFile | None:
    """Return the file of ``--params`` with the options for reading it, once read; None without one."""
    if read_parameter_file(args) is None:
        return None
    define = parse_defines(tuple(args.define or ()))
    return ParameterFile(params=args.params, nav2=args.nav2, define=define, only=args.only)


def resources_of(args: argparse.Namespace) -> Resources:
    """Return the resources that the options of :func:`add_resource_options` describe."""
    executor = args.executor if args.scheduler is None else f"{args.executor}={args.scheduler}"
    return Resources(workers=args.workers, executor=executor, wait_s=args.wait, run_timeout_s=args.run_timeout)


def refuse_beside_barn(args: argparse.Namespace) -> None:
    """Refuse the options of :func:`add_drive_options` that BARN's rules set.

    Raises:
        ConfigError: Naming the first of them.
    """
    given = {"robot": args.robot, "robot-radius": args.robot_radius, "time-limit": args.time_limit}
    refuse_ruled({f"--{name}": value for name, value in (given | {"contact": args.contact}).items()})


def drive_settings(args: argparse.Namespace, base: DriveSettings | None = None) -> DriveSettings:
    """Return the world and navigation that the options describe; everything else is as in ``base``."""
    settings = base or DriveSettings(navigation=DEFAULT_PARAMS)
    read = read_parameter_file(args)
    if read is not None:
        settings = with_parameters(settings, read)
    elif args.params is not None:
        settings = settings.replace(navigation=args.params)
    elif args.nav2 is not None:
        settings = settings.replace(navigation=_of_release(settings.navigation, args.nav2))
    settings = settings.replace(environment=_environment(args, settings.environment))
    if read is not None:
        describe_parameter_file(read, args, settings.environment)
    settings = settings.replace(navigation=_navigation(args, settings))
    return settings.replace(unknown_map=True) if vars(args).get("unknown_map") else settings


def _of_release(navigation: NavigationParams, release: Release) -> NavigationParams:
    """Return the counterpart of a preset in a release.

    Raises:
        ConfigError: If the parameters are those of no preset, and of the other release.
    """
    if navigation.release == release:
        return navigation
    found = counterpart(navigation, release)
    if found is None:
        raise ConfigError(f"--nav2 {release}: expected --params beside it, as these parameters are those of no preset")
    return found


def _environment(args: argparse.Namespace, environment: EnvConfig) -> EnvConfig:
    changes = {
        "time_limit": args.time_limit,
        "collision_ends_episode": None if args.contact is None else args.contact == "ends",
        "noise": args.noise,
    }
    robot = chosen_robot(environment.robot, args.robot, args.robot_radius, "--robot and --robot-radius")
    world = with_robot(environment, robot)
    return world.replace(**{key: value for key, value in changes.items() if value is not None})


def _navigation(args: argparse.Namespace, settings: DriveSettings) -> NavigationParams:
    """Return Nav2's parameters; a robot given on the command line also replaces the shape in the costmaps."""
    navigation = settings.navigation
    if args.planner is not None:
        timeout = navigation.planner.costmap_update_timeout
        navigation = navigation.replace(planner={"name": args.planner, "costmap_update_timeout": timeout})
    if args.robot is None and args.robot_radius is None:
        return navigation
    return take_shape_of_robot(navigation, args.robot_radius)
