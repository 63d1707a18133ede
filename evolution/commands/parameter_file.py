"""``--params``, the options for reading the file, and a description of its effect."""

from __future__ import annotations

import argparse
import functools
from collections.abc import Sequence
from pathlib import Path

from controllers.nav2_params import PRESETS, Nav2Params, load_preset, read_nav2_params, summarise
from evolution.commands.console import note
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.errors import ConfigError
from gym_mapbench.files.documents import read_document_text
from gym_mapbench.releases import RELEASES, Release
from gym_mapbench.ros_params import parse_defines, template_names

ONLY_FOR_FILES = ("define", "only")


def add_reading_options(group: argparse._ActionsContainer) -> None:
    """Add ``--nav2``, ``--define`` and ``--only``, the options for reading a parameter file."""
    group.add_argument(
        "--nav2",
        choices=RELEASES,
        help="ROS distribution of Nav2 (default: recognised by the keys of the file); without a file, the "
        "preset of that distribution that has the same limits as the one in use",
    )
    group.add_argument(
        "--define",
        action="append",
        metavar="NAME=VALUE",
        help="value for a placeholder of the file, <NAME> or $(var NAME); may be given several times",
    )
    group.add_argument(
        "--only",
        metavar="CONTROLLER",
        help="use this controller of the file, if its default controller is not available here",
    )


def read_parameter_file(args: argparse.Namespace) -> Nav2Params | None:
    """Read the file of ``--params``; None if it names a preset, or is not given.

    Raises:
        ConfigError: If there is no such file, it is refused, or an option for files is given without one.
    """
    if args.params is None or args.params in PRESETS:
        for name in ONLY_FOR_FILES:
            if getattr(args, name):
                raise ConfigError(f"--{name}: expected a parameter file, --params FILE, got {args.params or 'none'}")
        _refuse_other_release(args)
        return None
    return _read(args.params, args.nav2, tuple(args.define or ()), args.only, _names_controllers(args))


def shared_defines(options: Sequence[str], paths: Sequence[str]) -> dict[str, list[str]]:
    """Return the ``--define`` options of each of several parameter files: those whose template the file has.

    An option that no file has a template for is among those of all files, so that it is refused.

    Args:
        options: The options, ``NAME=VALUE``.
        paths: Files, or names of presets.
    """
    held = {path: _templates(path) for path in paths}
    known: set[str] = set().union(*held.values())
    return {
        path: [option for option in options if (name := option.partition("=")[0]) in names or name not in known]
        for path, names in held.items()
    }


def _templates(path: str) -> set[str]:
    """Return the names of a file's templates; none for a preset or a missing file."""
    return set() if path in PRESETS or not Path(path).exists() else template_names(read_document_text(path))


def describe_parameter_file(read: Nav2Params, args: argparse.Namespace, environment: EnvConfig) -> None:
    """Print the effect of the file on standard error."""
    lines = summarise(read, environment.robot, args.verbose)
    if environment.control_hz > EnvConfig().control_hz:
        lines.append(
            f"the simulation runs at the controller server's frequency: {environment.control_hz:g} commands per second"
        )
    for line in lines:
        note(f"{args.params}: {line}")


def _refuse_other_release(args: argparse.Namespace) -> None:
    """Refuse a preset of another release than ``--nav2`` asks for."""
    release = None if args.params is None else load_preset(args.params).release
    if release is not None and args.nav2 not in (None, release):
        raise ConfigError(f"--nav2 {args.nav2}: the preset {args.params} is for Nav2 {release.capitalize()}")


def _names_controllers(args: argparse.Namespace) -> bool:
    """Whether the command line names controllers."""
    return any(getattr(args, name, None) is not None for name in ("controllers", "controller"))


@functools.lru_cache(maxsize=8)
def _read(path: str, release: Release | None, defines: tuple[str, ...], only: str | None, anyone: bool) -> Nav2Params:
    """Read a user's file once; where there is no such file, the name may be that of a preset, misspelt."""
    if not Path(path).exists():
        raise ConfigError(f"--params: expected a file or one of the presets {', '.join(PRESETS)}, got {path!r}")
    return read_nav2_params(path, release=release, defines=parse_defines(defines), only=only, anyone=anyone)
