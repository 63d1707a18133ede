"""The subcommands of ``mapbench``, one file each, whose ``add_parser`` adds its options."""

from __future__ import annotations

import argparse
from importlib import import_module
from types import ModuleType
from typing import Any

from evolution.commands.help_text import HelpText

__all__ = ["COMMANDS", "COMMON", "WITH_WORKERS", "HelpText", "add_commands", "complain", "load_command", "set_messages"]

COMMANDS = {
    "evolve": "Search for sets of maps that tell controllers apart.",
    "study": "Run many searches and baselines, re-evaluate their best map sets, and compare.",
    "atlas": "Fill a grid of time ratios with the simplest reliable maps (pip install 'gym-mapbench[qd]').",
    "report": "Write one HTML page about a run or a study, or a film of a replay.",
    "bench": "Run every controller on every map and compare.",
    "tune": "Search for better values of a controller's parameters (pip install 'gym-mapbench[tune]').",
    "minimize": "Remove and shrink the obstacles of a map while a verdict holds.",
    "train": "Train a policy with Stable-Baselines3 (pip install 'gym-mapbench[rl]').",
    "drive": "Run one controller once and watch.",
    "play": "Draw a map, change parameters, and watch the controllers at once (pip install 'gym-mapbench[play]').",
    "maps": "Measure maps, convert them, check their tasks, or sample new ones.",
    "params": "Check a nav2_params.yaml, or convert it.",
    "export": "Write maps for ROS 2, Gazebo and other programs.",
    "import-results": "Compare times measured in Gazebo and Nav2 with ours.",
    "validate": "Compare costmaps, layers, plans, commands and runs with recorded Nav2 results.",
    "list": "List names: controllers, planners, robots, presets, metrics and more.",
    "show": "Print the content of a preset, a study, a robot or a noise level.",
    "doctor": "Report what is installed and compiled, the speed, and what is missing.",
    "kernels": "Export compiled kernels, or import them on an equal machine.",
    "completion": "Print a completion script for a shell.",
}
"""Summary of each command, in the order of the help."""

WITH_WORKERS = frozenset(("evolve", "study", "atlas", "bench", "tune", "minimize", "play", "validate"))
"""The commands that drive in worker processes."""

COMMON = {"quiet": False, "verbose": False, "allow_code": False}
"""The options that every command has, as they are where they are not given."""


def load_command(name: str) -> ModuleType:
    """Import the module of a command, and with it all that the command needs."""
    return import_module(f"{__name__}.{name.replace('-', '_')}")


def add_commands(subparsers: argparse._SubParsersAction[Any], chosen: str | None = None) -> None:
    """Add every command to a parser; only the chosen one, or all if it is None, with its options."""
    for name, summary in COMMANDS.items():
        if chosen in (None, name):
            load_command(name).add_parser(subparsers)
        else:
            subparsers.add_parser(name, help=summary)


def set_messages(*, quiet: bool, verbose: bool) -> None:
    """Print from now on neither notes nor progress, or where everything comes from and how each run ends as well."""
    from evolution.commands.console import be_quiet, be_verbose

    be_quiet(quiet)
    be_verbose(verbose)


def complain(line: str) -> None:
    """Print a line on standard error; a terminal gets it broken between words."""
    from evolution.commands.console import errors

    errors.print(line)
