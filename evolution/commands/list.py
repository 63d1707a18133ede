"""``mapbench list``: the names of controllers, planners, robots and more."""

from __future__ import annotations

import argparse

from evolution.commands import options
from evolution.commands.catalogue import KINDS
from evolution.commands.console import print_json, print_table
from evolution.files import Table
from gym_mapbench.errors import refuse_unknown

EXAMPLES = """  mapbench list                       everything that has a name
  mapbench list controllers noise     some kinds
  mapbench list metrics --format json"""


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the subcommand."""
    parser = options.example_parser(subparsers, "list", EXAMPLES)
    parser.add_argument("kinds", nargs="*", metavar="KIND", help=f"{', '.join(KINDS)} (default: all)")
    parser.add_argument("--format", choices=("table", "json"), default="table")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Print a row for every name."""
    for kind in args.kinds:
        refuse_unknown("kind", kind, KINDS)
    kinds = args.kinds or list(KINDS)
    rows = {
        kind: [{"name": name, "what it is": KINDS[kind].about(name)} for name in KINDS[kind].names()] for kind in kinds
    }
    if args.format == "json":
        whole = [{"kind": kind, **row, "named in": KINDS[kind].option} for kind in kinds for row in rows[kind]]
        print_json(whole)
        return 0
    for kind in kinds:
        print_table(Table(rows[kind], f"{kind}, for {KINDS[kind].option}"))
    return 0
