"""``mapbench params``: report the effect of a parameter file, or convert it for another distribution."""

from __future__ import annotations

import argparse
from pathlib import Path

from controllers.nav2_params import advise, parse_nav2_params, robot_of, summarise
from controllers.nav2_params.file.document import read_document
from controllers.nav2_params.file.tree import kept_trees, moved_trees
from controllers.nav2_params.migration import Migration, migrate_file
from evolution.commands import options
from evolution.commands.console import console, note
from evolution.commands.parameter_file import add_reading_options, read_parameter_file
from evolution.files import counted, write_text
from gym_mapbench.errors import ConfigError
from gym_mapbench.files.documents import parse_yaml
from gym_mapbench.releases import RELEASES
from gym_mapbench.world.robot import RobotSpec, make_robot

EXAMPLES = """  mapbench params check nav2_params.yaml
  mapbench params check rosbot.yaml --define min_x=-0.1 --define max_x=0.1 --define min_y=-0.12 --define max_y=0.12
  mapbench params convert nav2_params.yaml --nav2 lyrical --out nav2_params_lyrical.yaml"""


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the subcommand and its two actions."""
    parser = options.example_parser(subparsers, "params", EXAMPLES)
    actions = parser.add_subparsers(dest="action", required=True, metavar="ACTION")
    check = options.action_parser(actions, "check", "report the effect of a file, without a run")
    check.add_argument("params", metavar="FILE")
    add_reading_options(check)
    check.add_argument(
        "--robot", metavar="NAME", help="robot for the values that the file leaves out (default turtlebot3_waffle)"
    )
    check.set_defaults(run=_check)
    convert = options.action_parser(actions, "convert", "migrate a file to another distribution")
    convert.add_argument("file", metavar="FILE")
    convert.add_argument("--to", choices=RELEASES, help="ROS distribution to convert it for; --nav2 without it")
    convert.add_argument(
        "--nav2",
        choices=RELEASES,
        help="ROS distribution to convert it for; beside --to, the one it was written for (default: recognised "
        "by its keys)",
    )
    convert.add_argument("--out", metavar="FILE", help="a new file (default: standard output)")
    convert.set_defaults(run=_convert)


def _check(args: argparse.Namespace) -> int:
    """Read the file and print its effect."""
    read = read_parameter_file(args)
    if read is None:
        raise ConfigError(f"expected a parameter file, got the preset {args.params!r}")
    base = RobotSpec(name="turtlebot3_waffle") if args.robot is None else make_robot(args.robot)
    for line in summarise(read, robot_of(read, base), args.verbose):
        console.print(line)
    for line in advise(read):
        console.print(f"may get slow or stop: {line}")
    return 0


def _convert(args: argparse.Namespace) -> int:
    """Write the file for another distribution; the report goes to standard error."""
    if args.to is None and args.nav2 is None:
        raise ConfigError(f"expected --nav2 with the distribution to convert for, {' or '.join(RELEASES)}, got none")
    if args.out is not None and Path(args.out).exists():
        raise ConfigError(f"--out: expected a new file, got {args.out!r}, which exists")
    migration = migrate_file(args.file, args.to or args.nav2, args.nav2 if args.to else None)
    if args.out is None:
        print(migration.text, end="")
    else:
        write_text(Path(args.out), migration.text)
        _move_trees(Path(args.file), Path(args.out))
    _report(args.file, migration)
    _tell_trees(Path(args.file), migration)
    if args.out is not None:
        _read_again(args.out, migration)
    return 0


def _move_trees(source: Path, target: Path) -> None:
    """Write the trees that the new file names, and would not find from its folder, beside it."""
    values = read_document(target).values
    for name, xml in moved_trees(values, source.parent, target.parent).items():
        write_text(target.parent / name, xml)
        note(f"{target.parent / name}: the behaviour tree of {source}")


def _tell_trees(source: Path, migration: Migration) -> None:
    """Say which behaviour trees the file names: they stay those of the distribution for which they were written."""
    if migration.source == migration.target:
        return
    values, _ = parse_yaml(migration.text, source)
    for name, why in kept_trees(values, source.parent, migration.target).items():
        refusal = f"; Nav2 {migration.target.capitalize()} does not take it: {why}" if why else ""
        stays = f"it stays one of Nav2 {migration.source.capitalize()}{refusal}"
        note(f"{name}: the behaviour tree is not converted, {stays}")


def _report(name: str, migration: Migration) -> None:
    """Print the changes, and the keys without a counterpart."""
    source, target = migration.source.capitalize(), migration.target.capitalize()
    counts = f"{counted(len(migration.done), 'change')}, {counted(len(migration.lost), 'loss', 'losses')}"
    note(f"{name}: from Nav2 {source} to {target}: {counts}")
    for line in migration.done:
        note(f"  {line}")
    for line in migration.lost:
        note(f"  lost: {line}")


def _read_again(name: str, migration: Migration) -> None:
    """Warn where the new file would be refused here, as the old one may have been."""
    try:
        parse_nav2_params(read_document(name), release=migration.target)
    except ConfigError as error:
        note(f"{name}: still refused here: {error}")
