"""``mapbench bench``: drive every controller on every map."""

from __future__ import annotations

import argparse
import csv
import io
import json
from collections.abc import Sequence
from pathlib import Path
from statistics import fmean
from typing import Any

from rich.table import Table

from evolution.benchmark import (
    BENCH,
    BarnScore,
    BenchRun,
    barn_settings,
    bench,
    correlation_with,
    load_barn,
    reference_of,
    score_runs,
    summary_rows,
)
from evolution.benchmark import PREFIX as BARN
from evolution.commands import options
from evolution.commands.progress import WorkBar, console, errors
from evolution.driving import Evaluator, JobPlan, run_job, try_controllers, warm_up
from evolution.files import make_directory, write_text
from gym_mapbench.errors import ConfigError
from gym_mapbench.mapio import load_scenarios
from gym_mapbench.scenario import Scenario

EXAMPLES = """  mapbench bench runs/first --repeats 5
  mapbench bench office.yaml --params nav2_params.yaml --start 1,1,0 --goal 8,6,1.57
  mapbench bench a.yaml b.yaml --controllers dwb,rpp --format json > results.json
  mapbench bench a.yaml --controllers mppi,sac=models/sac.zip"""


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the subcommand."""
    parser = options.example_parser(subparsers, "bench", "Drive every controller on every map and compare.", EXAMPLES)
    parser.add_argument(
        "maps", nargs="+", metavar="MAP", help="map_server yaml, map-set file, run directory, .scen, barn:DIR, ..."
    )
    options.add_controllers_option(parser)
    options.add_task_options(parser)
    options.add_drive_options(parser)
    options.add_work_options(parser)
    parser.add_argument("--repeats", type=options.positive, default=1, metavar="R", help="runs of each (default 1)")
    parser.add_argument(
        "--lo",
        type=options.positive_number,
        default=2.0,
        metavar="FACTOR",
        help="only in the BARN score printed for barn:DIR: faster than FACTOR optimal times earns no more (default 2)",
    )
    parser.add_argument(
        "--metric", action="append", default=[], metavar="NAME", help="measure this too: a name or module:attribute"
    )
    parser.add_argument("--format", choices=("table", "json", "csv"), default="table")
    parser.add_argument("--out", metavar="DIR", help="also write bench.json and bench.csv there")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Drive and print."""
    scenarios = load_all(args.maps, args)
    barn = _barn_source(args.maps)
    settings = options.drive_settings(args)
    settings = settings if barn is None else barn_settings(settings)
    options.check_room(scenarios, settings)
    controllers = options.controllers_of(args)
    try_controllers(controllers, settings)
    plan = JobPlan(controllers, settings, args.seed or 0, args.repeats, tuple(args.metric))
    out = None if args.out is None else _new_directory(Path(args.out))
    total = len(scenarios) * len(plan.controllers) * args.repeats
    with (
        Evaluator(run_job, workers=options.workers_of(args), warm_up=warm_up, executor=args.executor) as evaluator,
        WorkBar("driving", total) as bar,
    ):
        runs = bench(scenarios, plan, evaluator, bar.advance)
    if out is not None:
        write_text(out / BENCH, json_of(runs))
        write_text(out / "bench.csv", csv_of(runs))
    if args.format == "table":
        _print_table(runs)
    else:
        print(json_of(runs) if args.format == "json" else csv_of(runs), end="")
    if barn is not None:
        _print_barn(score_runs(runs, barn, args.lo), barn)
    return 0


def load_all(paths: Sequence[str], args: argparse.Namespace) -> list[Scenario]:
    """Load the scenarios of all MAP arguments."""
    if _barn_source(paths) is not None:
        return load_barn(paths[0])
    return [scenario for path in paths for scenario in load_scenarios(path, start=args.start, goal=args.goal)]


def _barn_source(paths: Sequence[str]) -> str | None:
    """The ``barn:DIR`` among the maps, which has rules of its own and stands alone."""
    found = [path for path in paths if path.startswith(BARN)]
    if found and len(paths) > 1:
        raise ConfigError(f"{found[0]}: BARN's task has rules of its own; expected no other map beside it")
    return found[0] if found else None


def json_of(runs: Sequence[BenchRun]) -> str:
    """One object with ``runs``, as text."""
    return json.dumps({"runs": [one.row() for one in runs]}, indent=1, allow_nan=False) + "\n"


def csv_of(runs: Sequence[BenchRun]) -> str:
    """The same as a table, one line a run."""
    rows: list[dict[str, Any]] = [one.row() for one in runs]
    text = io.StringIO()
    writer = csv.DictWriter(text, list(dict.fromkeys(key for row in rows for key in row)), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def _print_table(runs: Sequence[BenchRun]) -> None:
    table = Table()
    for column in ("map", "controller", "goals"):
        table.add_column(column)
    for column in ("mean s", "min s", "max s", "length m", "clearance m", "recoveries", *runs[0].job.metrics):
        table.add_column(column, justify="right")
    table.add_column("otherwise")
    for row in summary_rows(runs):
        table.add_row(*row)
    console.print(table)
    for line in error_lines(runs):
        console.print(line, highlight=False, markup=False, soft_wrap=True)


def error_lines(runs: Sequence[BenchRun]) -> list[str]:
    """Why runs ended in an error, each reason once for a controller on a map."""
    failed = [one for one in runs if one.result.outcome == "error"]
    return list(
        dict.fromkeys(f"{one.job.scenario.name}/{one.job.controller.name}: {one.result.reason}" for one in failed)
    )


def _print_barn(scores: Sequence[BarnScore], source: str) -> None:
    """BARN's figures on standard error, so that standard output stays what --format says."""
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
            errors.print(f"  {one.world}: {one.time:.2f} s, score {one.score:.4f}{beside}", highlight=False)
        rho, low, high, count = correlation_with(reference, own)
        if count > 1:
            errors.print(f"  rank correlation with published DWA {rho:.3f} ({low:.3f} to {high:.3f}), {count} worlds")


def _new_directory(path: Path) -> Path:
    if path.exists() and (not path.is_dir() or any(path.iterdir())):
        raise ConfigError(f"--out: expected a new or empty directory, got {path}")
    make_directory(path)
    return path
