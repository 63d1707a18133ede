"""``mapbench import-results``: compare times measured in Gazebo with ours."""

from __future__ import annotations

import argparse
import math
from dataclasses import asdict

from rich.table import Table

from evolution.benchmark import (
    Benchmark,
    Comparison,
    ParameterComparison,
    check_maps,
    check_one_setup,
    compare,
    our_times,
    times_of_results,
)
from evolution.commands import options
from evolution.commands.console import console, print_json
from evolution.files import counted
from evolution.results import kind_of, load
from evolution.runs import LoadedRun
from gym_mapbench.errors import RunError
from gym_mapbench.mapio.runner_results import read_runner_results

EXAMPLES = """  mapbench import-results package/results.csv --ours runs/first
  mapbench import-results results.csv --ours results/bench.json --format json"""


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the subcommand."""
    parser = options.example_parser(subparsers, "import-results", EXAMPLES)
    parser.add_argument("csv", metavar="CSV", help="the results of the runner in the exported ROS 2 package")
    parser.add_argument(
        "--ours",
        required=True,
        metavar="RUN|BENCH",
        help="the run that was exported, or a bench.json or directory that bench --out wrote",
    )
    parser.add_argument("--format", choices=("table", "json"), default="table")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Compare and print."""
    results = read_runner_results(args.csv)
    ours = _ours(args.ours)
    check_maps(ours, results)
    check_one_setup(results)
    comparison = compare(our_times(ours), times_of_results(results))
    runs = [result for result in results if result.outcome != "error"]
    touched = sum(bool(one.contacts) for one in runs)
    if args.format == "json":
        print_json({**_document(comparison), "touched": touched})
        return 0
    _print(comparison)
    if touched:
        console.print(
            f"{touched} of their {counted(len(runs), 'run')} touched something; here contact ends a run with "
            "--contact ends"
        )
    return 0


def _ours(path: str) -> LoadedRun | Benchmark:
    """Return the run or the benchmark that was exported.

    Raises:
        RunError: If the path holds neither.
    """
    found = load(path)
    if not isinstance(found, LoadedRun | Benchmark):
        what = "comparison" if isinstance(found, ParameterComparison) else kind_of(path).directory.what
        raise RunError(f"--ours: expected a run or a benchmark, got {path}, a {what}")
    return found


def _document(comparison: Comparison) -> dict[str, object]:
    return {
        "pairs": [{**asdict(pair), "ratio": pair.ratio} for pair in comparison.pairs],
        "spearman": dict(zip(("rho", "low", "high"), comparison.correlation, strict=True)),
        "order_kept": dict(comparison.order_kept),
        "missing": list(comparison.missing),
    }


def _print(comparison: Comparison) -> None:
    table = Table(title="Runs at the goal, and their median time, s")
    for column in ("map", "controller", "our goals", "ours, s", "their goals", "theirs, s", "ratio"):
        table.add_column(column, justify="left" if column in ("map", "controller") else "right")
    for pair in comparison.pairs:
        ours, theirs = f"{pair.our_goals}/{pair.our_runs}", f"{pair.their_goals}/{pair.their_runs}"
        times = (_cell(value) for value in (pair.ours, pair.theirs, pair.ratio))
        table.add_row(pair.map, pair.controller, ours, next(times), theirs, *times)
    console.print(table)
    console.print(_correlation(comparison))
    for name, kept in comparison.order_kept.items():
        console.print(f"{name}: {'keeps' if kept else 'changes'} its rank among the maps")
    for line in comparison.missing:
        console.print(line)


def _correlation(comparison: Comparison) -> str:
    rho, low, high = comparison.correlation
    if math.isnan(rho):
        return "rank correlation: none; it takes at least two pairs that both sides solved, with different times"
    interval = "too few pairs for an interval" if math.isnan(low) else f"95 % interval {low:.3f} to {high:.3f}"
    return f"rank correlation {rho:.3f} ({interval})"


def _cell(value: float) -> str:
    return f"{value:.2f}" if math.isfinite(value) else "-"
