"""``mapbench bench`` with several ``--params``, or with ``--sweep``: a comparison of parameter sets."""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from controllers.nav2_params import PRESETS
from evolution.api import compare
from evolution.benchmark import (
    Configuration,
    ParameterComparison,
    Rule,
    broken,
    differences_in_words,
    read_rule,
    read_sweep,
    sweep,
    swept_controllers,
    table_of_compared,
    table_of_comparisons,
    table_of_scores,
    verdict_of_comparison,
)
from evolution.commands import driving_options, options
from evolution.commands.console import console, errors, note, only_results_on_stdout, print_table
from evolution.commands.parameter_file import shared_defines
from evolution.commands.progress import WorkBar
from evolution.commands.run_notes import check_measured, note_errors, note_models
from evolution.driving import JobPlan
from evolution.files import Row
from evolution.inputs import barn_source, run_of, seed_of, world_of
from evolution.report import new_page, write_comparison_report
from evolution.runs import LoadedRun
from gym_mapbench.errors import ConfigError

RULE_BROKEN = 1
MOST_COLUMNS = 4
"""Largest number of configurations that are columns of a table; more are rows."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add ``--sweep`` and ``--sweep-samples``."""
    group = parser.add_argument_group("comparison of parameter sets")
    group.add_argument(
        "--sweep",
        action="append",
        default=[],
        metavar="NAME=A,B,..",
        help="compare these values of a parameter with the own value: CONTROLLER.PARAMETER, or local_costmap. or "
        "global_costmap. in front; given several times, the whole grid is run; the set with the own values is called "
        "own, or LABEL of --params",
    )
    group.add_argument(
        "--sweep-samples",
        type=options.positive,
        metavar="N",
        help="run N Sobol points between the lowest and the highest values of --sweep instead of the grid",
    )


def is_comparison(args: argparse.Namespace) -> bool:
    """Whether the options ask for a comparison of parameter sets; else a single ``--params`` is unpacked.

    Raises:
        ConfigError: If options of a comparison are given without one.
    """
    given = args.params or []
    if len(given) > 1 or args.sweep:
        return True
    if args.sweep_samples is not None:
        raise ConfigError("--sweep-samples: expected the parameters to sweep, --sweep NAME=LOW,HIGH")
    args.params = _labelled(given[0])[1] if given else None
    return False


def run_comparison(args: argparse.Namespace) -> int:
    """Run all configurations and print the comparison; return 1 if a rule of ``--fail-if`` is broken."""
    if barn_source(args.maps):
        raise ConfigError("--params: expected one parameter file with barn:DIR, whose rules replace parts of the file")
    searched = run_of(args.maps)
    configurations = _swept(args, searched) if args.sweep else _of_files(args, searched)
    owners = [one.label for one in configurations]
    owners += [f"{one.label}.{name}" for one in configurations for name in one.plan.names if len(one.plan.names) > 1]
    rules = [read_rule(text, owners, args.metric) for text in args.fail_if]
    page = None if args.html is None else new_page(args.html)
    with only_results_on_stdout(), WorkBar("comparison") as bar:
        result = compare(
            args.maps,
            configurations,
            start=args.start,
            goal=args.goal,
            against_first=bool(args.sweep),
            metrics=args.metric,
            out=args.out,
            resume=args.resume,
            on_run=bar.advance,
            resources=driving_options.resources_of(args),
        )
    _print(result, args.format)
    if args.out is not None:
        note_errors(args.out)
    if page is not None:
        write_comparison_report(result, page, driving_options.repeatable(args.given))
        note(f"wrote {page}; open it in any browser")
    check_measured(result.rows)
    return report_broken(rules, {**result.sides, **result.by_label})


def report_broken(rules: Iterable[Rule], runs: Mapping[str, Sequence[Row]]) -> int:
    """Print the rules of ``--fail-if`` that runs break, by owner; return the exit code."""
    failed = broken(rules, runs)
    for line in failed:
        errors.print(f"mapbench bench: --fail-if {line}")
    return RULE_BROKEN if failed else 0


def _of_files(args: argparse.Namespace, searched: LoadedRun | None) -> list[Configuration]:
    """Return a configuration for each ``--params``."""
    named = [_label_and_file(text) for text in args.params]
    defines = shared_defines(args.define or (), [file for _, file in named])
    return [Configuration(label, _plan(_with_params(args, file, defines[file]), searched)) for label, file in named]


def _swept(args: argparse.Namespace, searched: LoadedRun | None) -> list[Configuration]:
    """Return the configurations of ``--sweep``."""
    if args.params and len(args.params) > 1:
        raise ConfigError(f"--sweep: expected at most one --params, got {len(args.params)}")
    swept = [read_sweep(text) for text in args.sweep]
    label, file = _labelled(args.params[0]) if args.params else ("", None)
    own = _with_params(args, file, args.define)
    if own.controllers is None:
        own.controllers = ",".join(swept_controllers(swept)) or None
    first, *others = sweep(_plan(own, searched), swept, args.sweep_samples)
    return [replace(first, label=label or first.label), *others]


def _with_params(args: argparse.Namespace, file: str | None, define: Sequence[str] | None) -> argparse.Namespace:
    """Return the options of a benchmark with one parameter file."""
    return argparse.Namespace(**{**vars(args), "params": file, "define": define})


def _plan(args: argparse.Namespace, searched: LoadedRun | None) -> JobPlan:
    """Return the runs that the options of a benchmark with one parameter file describe."""
    controllers = driving_options.controllers_of(args, searched)
    settings = driving_options.drive_settings(args, world_of(searched))
    note_models(controllers, settings)
    return JobPlan(controllers, settings, seed_of(args.seed, searched), args.repeats, tuple(args.metric))


def _label_and_file(text: str) -> tuple[str, str]:
    """Read ``LABEL=FILE``; without a label, a file is called by its name without the ending."""
    label, file = _labelled(text)
    return label or (file if file in PRESETS else Path(file).stem), file


def _labelled(text: str) -> tuple[str, str]:
    """Read ``LABEL=FILE``; without a label, it is empty."""
    label, sign, file = text.partition("=")
    if not sign or Path(text).exists():
        return "", text
    if not label.strip() or not file:
        raise ConfigError(f"--params: expected LABEL=FILE, got {text!r}")
    return label.strip(), file


def _print(result: ParameterComparison, form: str) -> None:
    """Print the verdict and the tables, or JSON or CSV."""
    if form != "table":
        print(result.to_json() if form == "json" else result.table("runs").to_csv(), end="")
        return
    _print_lines(verdict_of_comparison(result))
    if len(result.sides) <= MOST_COLUMNS:
        print_table(table_of_scores(result.table(), result.metrics))
        print_table(result.table("maps"))
    else:
        print_table(table_of_compared(result))
    print_table(table_of_comparisons(result))
    if not result.against_first:
        _print_lines(differences_in_words(result.parameters))


def _print_lines(lines: Sequence[str]) -> None:
    for line in lines:
        console.print(line)
