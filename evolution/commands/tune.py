"""``mapbench tune``: search for better values of a controller's parameters."""

from __future__ import annotations

import argparse

from rich.progress import MofNCompleteColumn

from evolution.api import tune
from evolution.commands import driving_options, options
from evolution.commands.console import console, note, only_results_on_stdout, print_table, say
from evolution.commands.progress import Bar, StateColumn
from evolution.commands.run_notes import check_measured, note_errors
from evolution.driving import Job, RunResult
from evolution.files import counted
from evolution.report import write_report
from evolution.tuning import OBJECTIVES, AgainstSettings, Trial, TuneSettings, Tuning
from gym_mapbench.errors import ConfigError

EXAMPLES = """  mapbench tune rpp --train train.json --test test.json --out runs/rpp
  mapbench tune FollowPath --params nav2_params.yaml --train maps/*.yaml --test office.yaml --out runs/mine
  mapbench tune dwb --train train.json --test test.json --objective time --objective clearance --out runs/front
  mapbench tune mppi --train train.json --test test.json --require 'clearance>=0.1' --out runs/careful
  mapbench tune dwb --train train.json --test test.json --against evolve --out runs/hard
  mapbench tune dwb --train train.json --test test.json --space space.yaml --out runs/mine
  mapbench tune rpp --train train.json --test test.json --out runs/rpp --resume      after an interruption"""
DEFAULTS, ROUNDS = TuneSettings(), AgainstSettings()
NOISE = "nominal"


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the subcommand."""
    parser = options.example_parser(subparsers, "tune", EXAMPLES)
    parser.add_argument(
        "controller", metavar="CONTROLLER", help="name in the --params file, or dwb, mppi, rpp, graceful"
    )
    maps = "in any form that mapbench bench reads; may be several"
    parser.add_argument("--train", nargs="+", required=True, metavar="MAP", help=f"maps of the search, {maps}")
    parser.add_argument("--test", nargs="+", required=True, metavar="MAP", help=f"maps of the comparison, {maps}")
    parser.add_argument(
        "--out", metavar="DIR", required=True, help="new directory; nav2_params.yaml in it is the result"
    )
    parser.add_argument("--resume", action="store_true", help="continue the tuning in the directory of --out")
    _add_search_options(parser.add_argument_group("search"))
    driving_options.add_drive_options(parser, noise=NOISE)
    driving_options.add_seed_option(parser)
    driving_options.add_resource_options(parser)
    parser.set_defaults(run=run)


def _add_search_options(group: argparse._ArgumentGroup) -> None:
    """Add the options that replace fields of :class:`TuneSettings`."""
    group.add_argument(
        "--space", metavar="FILE", help="search space: parameters with bounds (default: that of the controller)"
    )
    group.add_argument(
        "--trials", type=options.positive, metavar="N", help=f"trials, own values included (default {DEFAULTS.trials})"
    )
    group.add_argument(
        "--runs", type=options.positive, metavar="N", help="begin no further trials after N runs (default: no limit)"
    )
    group.add_argument(
        "--objective",
        action="append",
        dest="objectives",
        choices=tuple(OBJECTIVES),
        help="what is minimised (clearance: maximised); several give a Pareto front and no early stops (default time)",
    )
    group.add_argument(
        "--require",
        action="append",
        dest="requirements",
        metavar="CONDITION",
        help="condition over the runs of a trial, such as clearance>=0.1 or collisions<=0; may be given several times",
    )
    group.add_argument(
        "--against",
        choices=("evolve",),
        help="search in rounds, and after each evolve maps against the best values, which join the training maps",
    )
    group.add_argument(
        "--rounds", type=options.positive, metavar="N", help=f"rounds with --against (default {ROUNDS.rounds})"
    )
    group.add_argument("--sampler", choices=("tpe", "random"), help="tpe (default) or random, as a control")
    group.add_argument(
        "--finalists",
        type=options.positive,
        metavar="N",
        help=f"trials that are re-run on all training maps with held-out seeds (default {DEFAULTS.finalists})",
    )
    group.add_argument(
        "--test-repeats",
        type=options.positive,
        metavar="R",
        help=f"runs on each test map (default {DEFAULTS.test_repeats})",
    )


GIVEN = ("trials", "runs", "objectives", "requirements", "sampler", "finalists", "test_repeats", "seed")
"""Options that replace fields of :class:`TuneSettings` of the same name."""


def run(args: argparse.Namespace) -> int:
    """Tune, write the page, and print the result."""
    settings = driving_options.drive_settings(args)
    given = options.given_of(args, GIVEN) | _against(args)
    with only_results_on_stdout(), TuneBar(given.get("trials", DEFAULTS.trials)) as bar:
        result = tune(
            args.controller,
            args.train,
            args.test,
            out=args.out,
            params=driving_options.parameter_file(args) or args.params,
            space=args.space,
            settings=settings,
            resume=args.resume,
            on_trial=bar.on_trial,
            on_run=bar.on_run,
            resources=driving_options.resources_of(args),
            **given,
        )
    page = write_report(result.path, on_step=note)
    _print(result)
    note_errors(result.path)
    what = "The tuned parameters are in" if result.summary.changes else "The unchanged file is"
    console.print(f"{what} {result.params}; look at {page}.")
    check_measured(result.summary.test)
    return 0


def _against(args: argparse.Namespace) -> dict[str, AgainstSettings]:
    """Return the options of the rounds with evolved maps; nothing without ``--against``."""
    if args.against is None:
        if args.rounds is not None:
            raise ConfigError("--rounds: expected --against evolve beside it")
        return {}
    return {"against": ROUNDS if args.rounds is None else ROUNDS.replace(rounds=args.rounds)}


def _print(result: Tuning) -> None:
    """Print the verdict and the changed parameters."""
    if result.summary.changes:
        print_table(result.table("changes"))
    for sentence in result.verdict:
        console.print(sentence)


class TuneBar(Bar):
    """Progress over the trials: a bar on a terminal, one line per trial in a file or pipe.

    Args:
        trials: Number of trials.
    """

    def __init__(self, trials: int) -> None:
        super().__init__("tuning", trials, MofNCompleteColumn(), StateColumn())

    def on_trial(self, trial: Trial, runs: int) -> None:
        """Show a finished trial."""
        cost = f"cost {trial.estimate[0]:.2f}" if trial.estimate else "values refused"
        state = f"trial {trial.number}: {trial.state} after {counted(len(trial.rows), 'map')}, {cost}"
        self.bar.update(self.task, advance=1, state=f"{state}, {self.speed}")
        say(f"{state}; {counted(runs, 'run')} so far")

    def on_run(self, job: Job, result: RunResult, left: int) -> None:
        """Count one run."""
        self.speed.runs += 1
