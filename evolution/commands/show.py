"""``mapbench show``: the content of a preset, a study, a robot or a noise level."""

from __future__ import annotations

import argparse

import yaml

from evolution.commands import options
from evolution.commands.catalogue import KINDS
from gym_mapbench.errors import unknown_name

EXAMPLES = """  mapbench show robust --kind presets     the options of a search, for evolve --config
  mapbench show thesis --kind params      Nav2's parameters, as in a nav2_params.yaml
  mapbench show nominal                   the values of a noise level"""

SHOWN = {name: kind for name, kind in KINDS.items() if kind.content is not None}


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the subcommand."""
    parser = options.example_parser(subparsers, "show", EXAMPLES)
    parser.add_argument("name", metavar="PRESET", help=f"a name among {', '.join(SHOWN)} (see mapbench list)")
    parser.add_argument(
        "--kind",
        choices=tuple(SHOWN),
        metavar="KIND",
        help=f"{', '.join(SHOWN)}: which of them, where several have this name (default: all)",
    )
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Print a YAML document for each kind that has this name."""
    kinds = {name: kind for name, kind in SHOWN.items() if args.kind in (None, name)}
    found = [name for name, kind in kinds.items() if args.name in kind.names()]
    if not found:
        everything = {one for kind in kinds.values() for one in kind.names()}
        raise unknown_name(args.kind or "preset", args.name, everything)
    for number, name in enumerate(found):
        content = kinds[name].content
        assert content is not None  # SHOWN holds no other
        print("---\n" * (number > 0) + f"# {name}: {args.name} ({kinds[name].option} {args.name})")
        print(yaml.safe_dump(dict(content(args.name)), sort_keys=False), end="")
    return 0
