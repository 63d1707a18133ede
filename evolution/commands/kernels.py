"""``mapbench kernels``: compiled kernels as a file, with which an equal machine need not compile."""

from __future__ import annotations

import argparse
from pathlib import Path

from evolution.commands import options
from evolution.driving import export_kernels, import_kernels

EXAMPLES = """  mapbench kernels export --out kernels.tar.xz     after 'mapbench doctor' or any run has compiled them
  mapbench kernels import kernels.tar.xz           on the nodes of a cluster, or in a container"""


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the subcommand and its two actions."""
    parser = options.example_parser(subparsers, "kernels", EXAMPLES)
    actions = parser.add_subparsers(dest="action", required=True, metavar="ACTION")
    export = options.action_parser(actions, "export", "write the compiled kernels of this machine into an archive")
    export.add_argument("--out", metavar="FILE", required=True, help="a new file, .tar.xz")
    export.set_defaults(run=_export)
    taken = options.action_parser(
        actions, "import", "take the kernels of an archive, which are programs: only from people whom you trust"
    )
    taken.add_argument("archive", metavar="FILE", help="an archive of 'mapbench kernels export'")
    taken.set_defaults(run=_import)


def _export(args: argparse.Namespace) -> int:
    """Write the archive."""
    print(export_kernels(Path(args.out)))
    return 0


def _import(args: argparse.Namespace) -> int:
    """Take the archive."""
    print(import_kernels(Path(args.archive)))
    return 0
