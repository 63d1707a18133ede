"""Options that several commands share: the parser of a command, and values that are read from one argument."""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from typing import Any

from evolution.commands import COMMANDS
from gym_mapbench.generator import FAMILIES
from gym_mapbench.registry import Registry
from gym_mapbench.world.scenario import Pose

MESSAGE_OPTIONS = {
    "--quiet": "print results and errors only",
    "--verbose": "print the files, presets and seeds in use, the outcome of each run, the effect of every key of a "
    "parameter file, and the traceback of an error in code of your own",
}
"""Options of every command that change its messages and not its result."""


def example_parser(
    subparsers: argparse._SubParsersAction[argparse.ArgumentParser], name: str, examples: str
) -> argparse.ArgumentParser:
    """Add a subcommand whose help ends with examples."""
    parser = subparsers.add_parser(
        name, help=COMMANDS[name], description=COMMANDS[name], epilog="examples:\n" + examples, allow_abbrev=False
    )
    _add_common_options(parser)
    return parser


def action_parser(
    actions: argparse._SubParsersAction[argparse.ArgumentParser], name: str, what: str
) -> argparse.ArgumentParser:
    """Add an action of a subcommand, such as ``maps sample``, with its description."""
    parser = actions.add_parser(name, help=what, description=what, allow_abbrev=False)
    _add_common_options(parser)
    return parser


def _add_common_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of every command and of every action.

    They have no default here: the default of an action would replace the value before its name; see ``COMMON``.
    """
    words = parser.add_mutually_exclusive_group()
    for flag, what in MESSAGE_OPTIONS.items():
        words.add_argument(flag, action="store_true", default=argparse.SUPPRESS, help=what)
    parser.add_argument(
        "--allow-code",
        action="store_true",
        default=argparse.SUPPRESS,
        help="run the code that files name: an experiment, a study or a directory of results that names "
        "module:attribute or a model.zip is a program, and is refused without this option; names on the command line "
        "are always accepted",
    )


def written(names: Sequence[str]) -> str:
    """Return options as a user writes them, separated by commas."""
    *others, last = (f"--{name.replace('_', '-')}" for name in names)
    return f"{', '.join(others)} and {last}" if others else last


def given_of(args: argparse.Namespace, names: Sequence[str]) -> dict[str, Any]:
    """Return the values of those options that were not left out, by name."""
    return {name: value for name in names if (value := getattr(args, name)) is not None}


def names_in(registry: Registry[Any]) -> str:
    """List the values of an option that names an entry of a registry."""
    return f"{', '.join(registry.built_in)}, or module:attribute"


def add_task_options(parser: argparse.ArgumentParser) -> None:
    """Add ``--start`` and ``--goal``."""
    parser.add_argument("--start", type=pose, metavar="X,Y,YAW", help="start pose, m and rad")
    parser.add_argument("--goal", type=pose, metavar="X,Y,YAW", help="goal pose, m and rad")


def add_family_option(group: argparse._ActionsContainer, default: str) -> None:
    """Add ``--family``."""
    group.add_argument(
        "--family",
        type=names,
        metavar="A,B,..",
        help=f"families to sample maps from, with equal probability: {names_in(FAMILIES)} (default: {default})",
    )


def names(text: str) -> tuple[str, ...]:
    """Read names separated by commas."""
    parts = tuple(part.strip() for part in text.split(","))
    if not all(parts):
        raise argparse.ArgumentTypeError(f"expected names separated by commas, got {text!r}")
    return parts


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


def seconds(text: str) -> float:
    """Read a finite number of seconds, 0 or more."""
    return 0.0 if text.strip() == "0" else positive_number(text)


def share(text: str) -> float:
    """Read a number between 0 and 1."""
    value = seconds(text)
    if value > 1.0:
        raise argparse.ArgumentTypeError(f"expected a number between 0 and 1, got {text!r}")
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
