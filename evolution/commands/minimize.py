"""``mapbench minimize``: remove the obstacles that a verdict does not need."""

from __future__ import annotations

import argparse
from pathlib import Path

from evolution.api import minimize
from evolution.commands import driving_options, options
from evolution.commands.console import console, note, only_results_on_stdout, print_table
from evolution.commands.progress import WorkBar
from evolution.commands.run_notes import note_errors
from evolution.inputs import run_of, world_of
from evolution.minimizing import TOLERANCE, MinimizeSettings
from evolution.report import write_minimized_report

EXAMPLES = """  mapbench minimize office.yaml --keep 'dwb fails' --out runs/cause
  mapbench minimize runs/first --map map_2 --keep 'dwb fails and rpp succeeds' --out runs/cause
  mapbench minimize runs/first --map map_3 --keep order --out runs/cause
  mapbench minimize hall.yaml --controllers dwb,rpp --keep ratio --tolerance 0.2 --out runs/cause
  mapbench minimize office.yaml --keep 'dwb fails' --out runs/cause --resume      after an interruption"""
DEFAULTS = MinimizeSettings()


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the subcommand."""
    parser = options.example_parser(subparsers, "minimize", EXAMPLES)
    parser.add_argument("maps", nargs=1, metavar="MAP_OR_RUN", help="a map in any form that mapbench bench reads")
    parser.add_argument("--map", metavar="NAME", help="the map, if there are several")
    parser.add_argument(
        "--keep",
        required=True,
        metavar="VERDICT",
        help="what stays true: 'CONTROLLER fails', 'CONTROLLER succeeds', several joined by 'and', order (of the "
        "controllers by time) or ratio (of the slowest to the fastest time)",
    )
    parser.add_argument(
        "--tolerance",
        type=options.positive_number,
        default=TOLERANCE,
        metavar="SHARE",
        help=f"largest relative difference of the ratio (default {TOLERANCE:g})",
    )
    for name, what in (
        ("seeds", "seeds on which the verdict must hold"),
        ("held-out-seeds", "seeds of the final check"),
    ):
        default = getattr(DEFAULTS, name.replace("-", "_"))
        parser.add_argument(
            f"--{name}", type=options.positive, default=default, metavar="N", help=f"{what} (default {default})"
        )
    driving_options.add_controllers_option(parser, "those that --keep names, else as in bench")
    options.add_task_options(parser)
    driving_options.add_drive_options(parser, driving_options.OF_THE_RUN)
    driving_options.add_seed_option(parser)
    driving_options.add_resource_options(parser)
    parser.add_argument("--out", metavar="DIR", required=True, help="new directory of the smallest map and its page")
    parser.add_argument("--resume", action="store_true", help="continue the minimization in the directory of --out")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Minimise a map and print the result."""
    searched = run_of(args.maps)
    with only_results_on_stdout(), WorkBar("minimization") as bar:
        result, plan = minimize(
            args.maps[0],
            args.keep,
            driving_options.controllers_of(args, searched),
            settings=driving_options.drive_settings(args, world_of(searched)),
            map_name=args.map,
            start=args.start,
            goal=args.goal,
            seed=args.seed or 0,
            tolerance=args.tolerance,
            seeds=args.seeds,
            held_out_seeds=args.held_out_seeds,
            out=args.out,
            resume=args.resume,
            on_step=bar.tell,
            on_run=bar.advance,
            resources=driving_options.resources_of(args),
        )
    for line in result.sentences():
        console.print(line)
    print_table(result.table())
    note_errors(args.out)
    page = Path(args.out) / "report.html"
    write_minimized_report(result, plan, page, driving_options.repeatable(args.given))
    note(f"wrote {page}; open it in any browser")
    return 0
