"""``mapbench study``: the thesis' experiments, and any other, with baselines and statistics."""

from __future__ import annotations

import argparse
import math
from dataclasses import replace
from pathlib import Path

from rich.progress import TaskProgressColumn, TextColumn
from rich.table import Table

from evolution.commands import options
from evolution.commands.progress import Bar, console, errors, note
from evolution.report import write_report
from evolution.studies import (
    NAV2,
    StudyAnalysis,
    StudyDir,
    StudyProgress,
    StudySettings,
    analyse,
    is_study,
    load_study,
    run_study,
    study_names,
    summary_rows,
    verdict_of,
)
from gym_mapbench.errors import ConfigError, RunError

EXAMPLES = """  mapbench study quick                             a few minutes, every method once
  mapbench study thesis --out runs/thesis          chapter 5, and beyond
  mapbench study runs/thesis --resume              after an interruption
  mapbench study thesis --out runs/part --only gini_40,random --runs 8
  mapbench report runs/thesis                      the page again"""


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the subcommand."""
    parser = options.example_parser(
        subparsers, "study", "Run many searches with baselines, drive what they found again, and compare.", EXAMPLES
    )
    parser.add_argument(
        "study",
        metavar="FILE|NAME",
        help=f"a YAML file, or {' or '.join(study_names())}; with --resume also the study's directory",
    )
    parser.add_argument("--out", metavar="DIR", help="study directory (default runs/study-NAME)")
    parser.add_argument("--resume", action="store_true", help="continue the study in the directory")
    parser.add_argument("--only", metavar="A,B,..", help="run only these configurations now; the others stay missing")
    parser.add_argument("--runs", type=options.positive, metavar="N", help="run only the first N seeds now")
    options.add_workers_options(parser)
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run or continue, write tables, figures and the page, and print the verdict."""
    settings, directory = _study(args)
    only = None if args.only is None else [name.strip() for name in args.only.split(",")]
    with StudyBar(settings.name) as bar:
        results = run_study(
            settings,
            directory,
            resume=args.resume,
            only=only,
            runs=args.runs,
            workers=options.workers_of(args),
            engine=replace(NAV2, executor=args.executor),
            on_progress=bar.show,
        )
    analysis = analyse(results)
    page = write_report(directory, analysis=analysis, on_step=note)
    _print(analysis)
    console.print(f"Look at {page}, and at {directory / 'tables'} and {directory / 'figures'}.", highlight=False)
    if results.failed:
        raise RunError(f"{results.failed} runs could not be made (see missing, above); --resume tries them again")
    return 0


def _study(args: argparse.Namespace) -> tuple[StudySettings, Path]:
    """The study and its directory; a directory to be resumed says itself which study it is."""
    if args.resume and is_study(args.study):
        if args.out is not None:
            raise ConfigError(f"--out: expected none beside the study directory {args.study}")
        return StudyDir.open(args.study).settings, Path(args.study)
    settings = load_study(args.study)
    return settings, Path(args.out or Path("runs") / f"study-{settings.name}")


def _print(analysis: StudyAnalysis) -> None:
    """Show Table 5.2, the verdict, and what is missing."""
    for comparison in analysis.comparisons:
        table = Table(title=f"Best fitness of a run: {comparison.title}", title_justify="left")
        columns = ("configuration", "n", "mean", "std", "median", "ci_low", "ci_high")
        for column in columns:
            table.add_column(column, justify="left" if column == "configuration" else "right")
        for row in summary_rows(comparison):
            table.add_row(*[_cell(row[column]) for column in columns])
        console.print(table)
    for sentence in verdict_of(analysis.results, analysis):
        console.print(sentence, highlight=False, markup=False)
    for line in analysis.results.missing:
        console.print(f"missing: {line}", highlight=False, markup=False, soft_wrap=True)


def _cell(value: object) -> str:
    if not isinstance(value, float):
        return str(value)
    return "-" if math.isnan(value) else f"{value:.2f}"


class StudyBar(Bar):
    """Progress over the whole study: a bar where somebody watches, a line a run where output is kept."""

    def __init__(self, name: str) -> None:
        super().__init__(name, 1.0, TaskProgressColumn(), TextColumn("{task.fields[state]}"))

    def show(self, progress: StudyProgress) -> None:
        """Show where the study stands."""
        left = "" if progress.seconds_left is None else f", about {duration(progress.seconds_left)} left"
        state = f"{progress.configuration} seed {progress.seed}, best {progress.best:.3f}"
        speed = f"{progress.runs_per_second:.1f} runs/s"
        self.bar.update(self.task, completed=progress.fraction, state=f"{state}, {speed}{left}")
        if not errors.is_terminal and progress.step == "done":
            print(f"{state}; {100 * progress.fraction:.0f} % of the work done, {speed}{left}", flush=True)


def duration(seconds: float) -> str:
    """Say a time as a reader would: seconds, minutes, or hours and minutes."""
    if seconds < 90:
        return f"{seconds:.0f} s"
    minutes = round(seconds / 60)
    return f"{minutes} min" if minutes < 90 else f"{minutes // 60} h {minutes % 60} min"
