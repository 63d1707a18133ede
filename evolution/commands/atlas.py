"""``mapbench atlas``: fill a grid of time ratios between controllers with the simplest reliable maps."""

from __future__ import annotations

import argparse
from pathlib import Path

from evolution.api import atlas
from evolution.commands import driving_options, experiment_options, options
from evolution.commands.console import console, note, only_results_on_stdout, print_table
from evolution.commands.experiment_options import configuration_in, experiment_from
from evolution.commands.progress import WorkBar
from evolution.commands.run_notes import note_errors, note_models
from evolution.quality_diversity import REPORT, AtlasSettings
from evolution.report import write_atlas_report

EXAMPLES = """  mapbench atlas --runs 3000 --out runs/atlas
  mapbench atlas --controllers dwb,mppi --runs 1000 --out runs/pair
  mapbench atlas --controllers dwb,mppi,rpp,graceful --pairs mppi/rpp,graceful/rpp --out runs/four
  mapbench atlas --params my_nav2_params.yaml --family gates,doors --out runs/mine
  mapbench atlas --runs 3000 --out runs/atlas --resume      after an interruption"""
DEFAULTS = AtlasSettings()
SETTINGS = ("runs", "pairs", "cells", "largest_ratio", "repeats", "held_out_seeds", "fresh")
"""Options that replace fields of :class:`AtlasSettings` of the same name."""


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the subcommand."""
    parser = options.example_parser(subparsers, "atlas", EXAMPLES)
    _add_atlas_options(parser.add_argument_group("the atlas"))
    maps = parser.add_argument_group("the maps")
    experiment_options.add_preset_options(maps)
    experiment_options.add_map_options(maps)
    experiment_options.add_run_options(parser)
    parser.add_argument("--out", metavar="DIR", required=True, help="new directory of the maps and their page")
    parser.add_argument("--resume", action="store_true", help="continue the atlas in the directory of --out")
    parser.set_defaults(run=run)


def _add_atlas_options(group: argparse._ArgumentGroup) -> None:
    """Add :data:`SETTINGS`."""
    for name, kind, metavar, what in (
        ("runs", options.positive, "N", "runs of controllers in the search, which begins no map that may need more"),
        ("cells", options.positive, "N", "cells along each axis"),
        (
            "largest-ratio",
            options.positive_number,
            "R",
            "ratio at the end of each axis; larger ones are in its last cell",
        ),
        ("repeats", options.positive, "R", "runs of each controller on a map before it enters a cell"),
        ("held-out-seeds", options.positive, "N", "runs of each controller on the map of each cell after the search"),
        ("fresh", options.share, "P", "probability that a new map is sampled; else a map of a cell is mutated"),
    ):
        default = getattr(DEFAULTS, name.replace("-", "_"))
        group.add_argument(f"--{name}", type=kind, metavar=metavar, help=f"{what} (default {default})")
    group.add_argument(
        "--pairs",
        type=options.names,
        metavar="A/B,..",
        help="one or two axes: the time of A over that of B (default: the second and the third controller over the "
        "first)",
    )


def run(args: argparse.Namespace) -> int:
    """Fill the atlas, write its page, and print the result."""
    experiment = experiment_from(args, configuration_in(args), {} if args.seed is None else {"seed": args.seed})
    note_models(experiment.controllers, experiment.run)
    given = options.given_of(args, SETTINGS)
    settings = AtlasSettings.from_mapping(given, "atlas")
    with only_results_on_stdout(), WorkBar("atlas") as bar:
        result = atlas(
            experiment,
            out=args.out,
            settings=settings,
            resume=args.resume,
            on_step=bar.tell,
            on_run=bar.advance,
            resources=driving_options.resources_of(args),
        )
    print_table(result.table("coverage"))
    print_table(result.table("sets"))
    for line in result.sentences():
        console.print(line)
    note_errors(args.out)
    page = Path(args.out) / REPORT
    if result.elites:
        note("re-running the maps of the cells for the replays")
    write_atlas_report(result, page, driving_options.repeatable(args.given))
    console.print(f"The maps are in {args.out}; look at {page}.")
    return 0
