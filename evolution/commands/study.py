"""``mapbench study``: the experiments of the thesis or others, with baselines and statistics."""

from __future__ import annotations

import argparse
from math import isnan

from rich.progress import TaskProgressColumn

from evolution.api import study
from evolution.benchmark import few_maps_in_words
from evolution.commands import driving_options, options
from evolution.commands.console import console, note, print_table, say
from evolution.commands.progress import Bar, StateColumn, best_in_short, best_in_words
from evolution.commands.run_notes import check_measured, note_errors
from evolution.driving import Job, RunResult
from evolution.files import Row, Table, counted
from evolution.report import write_report
from evolution.studies import (
    StudyAnalysis,
    StudyProgress,
    StudyResults,
    SweepResults,
    analyse,
    study_in,
    study_names,
    summary_rows,
    verdict_of,
)
from gym_mapbench.errors import RunError

RUNS_PER_LINE = 100
SUMMARY = {name: name for name in ("configuration", "n", "mean", "std", "median")} | {
    "median from": "ci_low",
    "median to": "ci_high",
}
"""Columns of the table of best fitnesses, and their names in the results."""
EXAMPLES = """  mapbench study quick                             a few minutes, every method once
  mapbench study thesis --out runs/thesis          chapter 5 of the thesis, with baselines
  mapbench study noise --runs 20                   the effect of noise, on 20 maps
  mapbench study runs/thesis --resume              after an interruption
  mapbench study thesis --out runs/part --only gini_40,random --runs 8
  mapbench report runs/thesis                      the page again"""


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the subcommand."""
    parser = options.example_parser(subparsers, "study", EXAMPLES)
    parser.add_argument(
        "study",
        metavar="FILE|NAME",
        help=f"a YAML file, or one of {', '.join(study_names())}; with --resume also the study's directory",
    )
    parser.add_argument("--out", metavar="DIR", help="study directory (default runs/study-NAME)")
    parser.add_argument("--resume", action="store_true", help="continue the study in the directory")
    parser.add_argument("--only", metavar="A,B,..", help="run only these configurations (or worlds) now")
    parser.add_argument("--runs", type=options.positive, metavar="N", help="run only the first N seeds (or maps) now")
    driving_options.add_resource_options(parser)
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run or continue the study, write tables and figures, and print the results."""
    only = None if args.only is None else [name.strip() for name in args.only.split(",")]
    settings, directory = study_in(args.study, args.out, resume=args.resume)
    with StudyBar(settings.name) as bar:
        results = study(
            settings,
            out=directory,
            resume=args.resume,
            only=only,
            runs=args.runs,
            on_progress=bar.show,
            on_run=bar.advance,
            resources=driving_options.resources_of(args),
        )
    return _show_sweep(results) if isinstance(results, SweepResults) else _show_study(results)


def _show_study(results: StudyResults) -> int:
    """Write the page and print the verdict."""
    analysis = analyse(results)
    page = write_report(results.path, analysis=analysis, on_step=note)
    _print(analysis)
    console.print(f"Look at {page}, and at {results.path / 'tables'} and {results.path / 'figures'}.")
    if results.failed:
        raise RunError(f"{counted(results.failed, 'run')} failed (see missing, above); --resume repeats them")
    return 0


def _show_sweep(results: SweepResults) -> int:
    """Print the effect of every world, with 95 % intervals."""
    rows = [
        {
            "world": row["world"],
            "controller": row["controller"],
            "n": row["n"],
            **{name: _with_interval(row, name) for name in ("success", "gained", "time_ratio", "recoveries")},
            "changed": f"{row['changed']:.3f}",
        }
        for row in results.table()
    ]
    print_table(Table(rows, f"{results.settings.name}: each world compared with the first, 95 % intervals in brackets"))
    for line in few_maps_in_words(results.runs):
        console.print(line)
    console.print(f"Look at {results.path / 'figures'} and {results.path / 'effects.csv'}.")
    note_errors(results.path)
    check_measured(results.runs)
    return 0


def _with_interval(row: Row, name: str) -> str:
    value, low, high = row[name], row[f"{name}_low"], row[f"{name}_high"]
    if isnan(value):
        return "-"
    return f"{value:.3f}" if isnan(low) else f"{value:.3f} [{low:.3f}, {high:.3f}]"


def _print(analysis: StudyAnalysis) -> None:
    """Print Table 5.2, the verdict, and the missing parts."""
    for comparison in analysis.comparisons:
        rows = [{shown: row[name] for shown, name in SUMMARY.items()} for row in summary_rows(comparison)]
        print_table(Table(rows, f"Best fitness of a search, median with its 95 % interval: {comparison.title}"))
    for sentence in verdict_of(analysis):
        console.print(sentence)
    for line in analysis.results.missing:
        console.print(f"missing: {line}")


class StudyBar(Bar):
    """Progress over the whole study: a bar on a terminal, one line per run in a file or pipe."""

    def __init__(self, name: str) -> None:
        super().__init__(name, 1.0, TaskProgressColumn(), StateColumn())

    def show(self, progress: StudyProgress) -> None:
        """Show where the study stands."""
        left = "" if progress.seconds_left is None else f", {duration(progress.seconds_left)} left"
        who = f"{progress.configuration} seed {progress.seed}"
        state = f"{who}, {best_in_short(progress.best)}{left}"
        self.bar.update(self.task, completed=progress.fraction, state=state)
        if progress.step == "done":
            done = f"{100 * progress.fraction:.0f} % of the work done"
            say(f"{who}, {best_in_words(progress.best)}; {done}, {progress.runs_per_second:.1f} runs/s{left}")

    def advance(self, job: Job, result: RunResult, left: int) -> None:
        """Show one finished run of a sweep."""
        self.speed.runs += 1
        whole = self.speed.runs + left
        state = f"{job.scenario.name} {job.controller.name}: {result.outcome}, {self.speed}"
        self.bar.update(self.task, completed=self.speed.runs / whole, state=state)
        if left == 0 or self.speed.runs % RUNS_PER_LINE == 0:
            say(f"{self.speed.runs} of {counted(whole, 'run')} done, {self.speed}")


def duration(seconds: float) -> str:
    """Format a time for a reader: in seconds, minutes, or hours and minutes."""
    if seconds < 90:
        return f"{seconds:.0f} s"
    minutes = round(seconds / 60)
    return f"{minutes} min" if minutes < 90 else f"{minutes // 60} h {minutes % 60} min"
