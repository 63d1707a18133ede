"""``mapbench train``: train a policy, to compare with Nav2's controllers."""

from __future__ import annotations

import argparse
import shlex
from typing import Any

from evolution.api import train
from evolution.commands import options
from evolution.commands.console import console, print_table, say
from evolution.commands.progress import Bar, StateColumn, TimeColumn
from evolution.files import Row, Table
from evolution.training import Training, TrainProgress, algorithm_names

EXAMPLES = """  mapbench train --algo ppo --out runs/ppo
  mapbench train --algo sac --steps 200000 --seed 3 --out runs/sac
  mapbench train --config mine.yaml --maps sampled/*.yaml --out runs/mine
  mapbench train --curriculum runs/first --out runs/curriculum
  mapbench train --resume runs/ppo                 after an interruption
  mapbench bench runs/first --controllers mppi,learned=runs/ppo/best_model.zip"""

RANDOM = "random"


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the subcommand."""
    parser = options.example_parser(subparsers, "train", EXAMPLES)
    parser.add_argument(
        "--algo", metavar="NAME", help=f"{', '.join(algorithm_names())} (default: that of --config, or ppo)"
    )
    parser.add_argument(
        "--maps",
        nargs="+",
        metavar="MAP",
        help="maps to train on, as for mapbench bench; every fifth is held out, none of fewer than five (default: new "
        "random maps)",
    )
    parser.add_argument(
        "--curriculum",
        metavar="RUN_OR_SET",
        help="the directory of a run, or a map-set file: its maps are levels of prioritized level replay; every "
        "fifth is held out, none of fewer than five",
    )
    parser.add_argument(
        "--steps",
        type=options.positive,
        metavar="N",
        help="decisions in all worlds together (default: those of --config, else of the algorithm)",
    )
    parser.add_argument(
        "--envs", type=options.positive, metavar="N", help="worlds stepped together (default: as for --steps)"
    )
    parser.add_argument("--seed", type=options.non_negative, metavar="N", help="root of all randomness (default 0)")
    parser.add_argument("--config", metavar="FILE", help="YAML that replaces some of the algorithm's settings")
    parser.add_argument("--out", metavar="DIR", help="directory of the training (default runs/ALGO-seedN)")
    parser.add_argument("--resume", metavar="DIR", help="continue the training in this directory; no other option")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Train, and print the path of the model and its learning curve."""
    maps = None if args.maps == [RANDOM] else args.maps
    given: dict[str, Any] = {name: getattr(args, name) for name in ("steps", "envs", "seed")}
    with TrainBar() as bar:
        training = train(
            args.algo,
            maps=maps,
            curriculum=args.curriculum,
            config=args.config,
            out=args.out,
            resume=args.resume,
            on_progress=bar.advance,
            **{name: value for name, value in given.items() if value is not None},
        )
    _report(training)
    return 0


def _report(training: Training) -> None:
    print_table(Table([_short(row) for row in training.curve], training.table().title))
    learned = shlex.quote(f"mppi,learned={training.best}")
    console.print(f"Compare the best model: mapbench bench MAP --controllers {learned}")


def _short(row: Row) -> Row:
    """Return the columns of a line of the learning curve that a terminal has room for."""
    return {name: value for name, value in row.items() if not name.endswith(("_low", "_high"))}


class TrainBar(Bar):
    """A bar over the steps of a training on a terminal; a line for every evaluation elsewhere."""

    def __init__(self) -> None:
        super().__init__("training", None, StateColumn(), TimeColumn())
        self._shown: Row | None = None

    def advance(self, progress: TrainProgress) -> None:
        """Show how far the training is."""
        success = "" if progress.success is None else f", success {progress.success:.0%}"
        state = f"{progress.steps}/{progress.total} steps, {progress.rate:.0f} steps/s{success}"
        self.bar.update(
            self.task, total=progress.total, completed=progress.steps, state=state + _held_out(progress.row)
        )
        if progress.row is not None and progress.row != self._shown:
            self._shown = progress.row
            left = "" if progress.left is None else f", {progress.left / 60:.0f} min left"
            say(state + _held_out(progress.row) + left)


def _held_out(row: Row | None) -> str:
    return "" if row is None else f", held out {row['success']:.1%}"
