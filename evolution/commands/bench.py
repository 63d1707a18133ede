"""``mapbench bench``: drive every controller on every map."""

from __future__ import annotations

import argparse
import csv
import io
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.table import Table

from evolution.bench import BenchRun, bench, summary_rows
from evolution.commands import options
from evolution.commands.progress import WorkBar, console
from evolution.driving import run_job
from evolution.evaluator import Evaluator
from evolution.jobs import JobPlan
from evolution.rundir import write_text
from evolution.warmup import warm_up
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
    parser.add_argument("--format", choices=("table", "json", "csv"), default="table")
    parser.add_argument("--out", metavar="DIR", help="also write bench.json and bench.csv there")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Drive and print."""
    out = None if args.out is None else _new_directory(Path(args.out))
    scenarios = load_all(args.maps, args)
    plan = JobPlan(options.controllers_of(args.controllers), options.drive_settings(args), args.seed or 0, args.repeats)
    total = len(scenarios) * len(plan.controllers) * args.repeats
    with (
        Evaluator(run_job, workers=options.workers_of(args), warm_up=warm_up) as evaluator,
        WorkBar("driving", total) as bar,
    ):
        runs = bench(scenarios, plan, evaluator, bar.advance)
    if out is not None:
        write_text(out / "bench.json", json_of(runs))
        write_text(out / "bench.csv", csv_of(runs))
    if args.format == "table":
        _print_table(runs)
    else:
        print(json_of(runs) if args.format == "json" else csv_of(runs), end="")
    return 0


def load_all(paths: Sequence[str], args: argparse.Namespace) -> list[Scenario]:
    """Load the scenarios of all MAP arguments."""
    return [scenario for path in paths for scenario in load_scenarios(path, start=args.start, goal=args.goal)]


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
    for column in ("mean s", "min s", "max s", "length m", "clearance m", "recoveries"):
        table.add_column(column, justify="right")
    table.add_column("otherwise")
    for row in summary_rows(runs):
        table.add_row(*row)
    console.print(table)


def _new_directory(path: Path) -> Path:
    if path.exists() and (not path.is_dir() or any(path.iterdir())):
        raise ConfigError(f"--out: expected a new or empty directory, got {path}")
    path.mkdir(parents=True, exist_ok=True)
    return path
