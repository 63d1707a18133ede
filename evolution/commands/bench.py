"""``mapbench bench``: run every controller on every map."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from statistics import fmean

from evolution.api import bench
from evolution.benchmark import (
    MEASURES,
    BarnScore,
    Benchmark,
    copies_in_words,
    correlation_with,
    few_maps_in_words,
    official_lengths,
    read_rule,
    reevaluation_sentence,
    reference_of,
    runs_by_controller,
    score_runs,
    table_of_pairs,
    table_of_scores,
    too_few_runs,
)
from evolution.commands import driving_options, options
from evolution.commands.compared_parameters import add_options, is_comparison, report_broken, run_comparison
from evolution.commands.console import console, errors, note, only_results_on_stdout, print_table
from evolution.commands.progress import WorkBar
from evolution.commands.run_notes import check_measured, note_errors, note_models
from evolution.inputs import barn_source, run_of, world_of
from evolution.report import new_page, write_benchmark_report
from evolution.search import DEFAULT_CONTROLLERS
from gym_mapbench.errors import ConfigError

BARN_FACTOR = 2.0
"""Default of ``--lo``: BARN's present rule."""
EXAMPLES = """  mapbench bench runs/first --repeats 10           the best maps of a search, in its world, with new seeds
  mapbench bench office.yaml --params nav2_params.yaml --start 1,2,0 --goal 8,6,1.57
  mapbench bench a.yaml b.yaml --controllers dwb,rpp --format json > results.json
  mapbench bench maps/*.yaml --out results              each result is written as it comes; after an interruption:
  mapbench bench maps/*.yaml --out results --resume
  mapbench bench a.yaml --controllers mppi,sac=models/sac.zip
  mapbench bench maps/*.yaml --params a=old.yaml --params b=new.yaml --repeats 5 --fail-if 'b.success<a.success'
  mapbench bench maps/*.yaml --sweep mppi.temperature=0.1,0.3,0.5 --noise nominal --repeats 5
  mapbench bench maps/*.yaml --html bench.html          a page with verdict, intervals and replays
  mapbench bench maps/*.yaml --fail-if 'success<0.95' --fail-if 'mppi.collisions>0'    exit code 1, for a robot's CI"""

WHO = (
    "the controller_plugins of the --params file; without a file, those of the run whose maps are used, else "
    f"{','.join(DEFAULT_CONTROLLERS)}"
)
KNOWN_MAP = """  The global costmap holds the whole map from the start, unlike that of the published DWA;
  --unknown-map runs without the map."""


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the subcommand."""
    parser = options.example_parser(subparsers, "bench", EXAMPLES)
    parser.add_argument(
        "maps", nargs="+", metavar="MAP", help="map_server yaml, map-set file, run directory, .scen, barn:DIR, ..."
    )
    driving_options.add_controllers_option(parser, WHO)
    options.add_task_options(parser)
    driving_options.add_drive_options(parser, driving_options.OF_THE_RUN, several=True)
    driving_options.add_unknown_map_option(parser)
    driving_options.add_seed_option(parser, "0; for the maps of a run, its seed plus 1")
    driving_options.add_resource_options(parser)
    parser.add_argument("--repeats", type=options.positive, default=1, metavar="R", help="runs of each (default 1)")
    parser.add_argument(
        "--lo",
        type=options.positive_number,
        metavar="FACTOR",
        help="BARN score, only for barn:DIR: a run faster than FACTOR optimal times scores no more (default "
        f"{BARN_FACTOR:g})",
    )
    parser.add_argument(
        "--metric",
        action="append",
        default=[],
        metavar="NAME",
        help="a further metric: a name or module:attribute; may be given several times",
    )
    parser.add_argument("--format", choices=("table", "json", "csv"), default="table")
    parser.add_argument(
        "--out",
        metavar="DIR",
        help="a new directory for every result as it comes, and for bench.json and bench.csv at the end",
    )
    parser.add_argument("--html", metavar="FILE", help="write one page with verdict, intervals, replays and all runs")
    parser.add_argument(
        "--fail-if",
        action="append",
        default=[],
        metavar="RULE",
        help="exit with code 1 if this holds for a controller over all maps: MEASURE<NUMBER (or <=, >, >=, ==, !=), or "
        "CONTROLLER.MEASURE<NUMBER; of parameter sets, LABEL.MEASURE<LABEL.MEASURE, too; measures are "
        f"{', '.join(MEASURES)} and all metrics; may be given several times",
    )
    add_options(parser)
    parser.add_argument("--resume", action="store_true", help="continue the benchmark in the directory of --out")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the benchmark and print it; return 1 if a rule of ``--fail-if`` is broken.

    Raises:
        RunError: If every run ended in an error.
    """
    if args.resume and args.out is None:
        raise ConfigError("--resume: expected the directory to continue, --out DIR")
    lengths = _official_lengths(args)
    if is_comparison(args):
        return run_comparison(args)
    searched = run_of(args.maps)
    controllers = driving_options.controllers_of(args, searched)
    settings = driving_options.drive_settings(args, world_of(searched))
    note_models(controllers, settings)
    rules = [read_rule(text, [one.name for one in controllers], args.metric) for text in args.fail_if]
    page = None if args.html is None else new_page(args.html)
    with only_results_on_stdout(), WorkBar("benchmark") as bar:
        result = bench(
            args.maps,
            controllers,
            settings=settings,
            start=args.start,
            goal=args.goal,
            repeats=args.repeats,
            seed=args.seed,
            metrics=args.metric,
            out=args.out,
            resume=args.resume,
            on_run=bar.advance,
            resources=driving_options.resources_of(args),
        )
    as_set = [reevaluation_sentence(result.reevaluation, searched)] if result.reevaluation and searched else []
    print_benchmark(result, args.format, as_set)
    if barn := barn_source(args.maps):
        _print_barn(score_runs(result, lengths, args.lo or BARN_FACTOR), barn)
        if not args.unknown_map:
            note(KNOWN_MAP)
    if args.out is not None:
        note_errors(args.out)
    if page is not None:
        write_benchmark_report(result, page, driving_options.repeatable(args.given), as_set)
        note(f"wrote {page}; open it in any browser")
    check_measured(result.rows)
    return report_broken(rules, runs_by_controller(result.rows, [one.name for one in controllers]))


def _official_lengths(args: argparse.Namespace) -> dict[str, float]:
    """Return the path lengths that BARN scores with, by world, m; empty for other maps."""
    barn = barn_source(args.maps)
    if barn:
        driving_options.refuse_beside_barn(args)
        return official_lengths(barn)
    if args.lo is not None:
        raise ConfigError(f"--lo: expected barn:DIR beside it, got {args.maps[0]}")
    return {}


def print_benchmark(result: Benchmark, form: str, notes: Sequence[str] = ()) -> None:
    """Print the runs on standard output: as tables and sentences, or as JSON or CSV."""
    if form != "table":
        print(result.to_json() if form == "json" else result.table("runs").to_csv(), end="")
        return
    print_table(result.table())
    if len({row["map"] for row in result.rows}) > 1:
        print_table(table_of_scores(result.table("controllers"), result.metrics))
        print_table(table_of_pairs(result.table("pairs")))
        controllers = [row["controller"] for row in result.table("controllers")]
        notes = [*few_maps_in_words(result.rows), *too_few_runs(result.rows, controllers), *notes]
    for line in [*result.failures, *copies_in_words(result.rows), *notes]:
        console.print(line)


def _print_barn(scores: Sequence[BarnScore], source: str) -> None:
    """Print BARN's scores on standard error, so that standard output holds only what --format asks for."""
    reference = reference_of(source)
    for name in dict.fromkeys(one.controller for one in scores):
        own = [one for one in scores if one.controller == name]
        times = [one.time for one in own if one.success]
        errors.print(
            f"BARN {name}: {len(times)}/{len(own)} successful, score {fmean(one.score for one in own):.4f}"
            + (f", mean time {fmean(times):.2f} s" if times else "")
        )
        for one in own:
            published = reference.get(one.world)
            beside = "" if published is None else f" (published DWA {published:.2f} s)"
            errors.print(f"  {one.world}: {one.time:.2f} s, score {one.score:.4f}{beside}")
        rho, low, high, count = correlation_with(reference, own)
        if count > 1:
            errors.print(f"  rank correlation with published DWA {rho:.3f} ({low:.3f} to {high:.3f}), {count} worlds")
