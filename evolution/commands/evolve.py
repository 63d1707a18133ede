"""``mapbench evolve``: search for maps that tell controllers apart."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.table import Table

from controllers.nav2_params.presets import overlay
from evolution.commands import options
from evolution.commands.progress import WorkBar, console, note
from evolution.driving import Evaluator, ResultStore, run_job, try_controllers, warm_up
from evolution.pictures import write_run_figures
from evolution.runs import LoadedRun, RunDir, load_run
from evolution.search import (
    FITNESSES,
    METRIC_NAMES,
    Experiment,
    evolve,
    experiment_of,
    load_preset,
    preset_names,
    read_document,
    scenario_on,
)
from gym_mapbench.errors import ConfigError
from gym_mapbench.generator import ShapeSettings, clear_and_border
from gym_mapbench.scenario import Scenario

EXAMPLES = """  mapbench evolve --preset quick --out runs/first
  mapbench evolve --fitness cluster --pop-size 40 --evaluations 600 --seed 3
  mapbench evolve --params my_nav2_params.yaml --controllers dwb,rpp --out runs/mine
  mapbench evolve --resume runs/first              after an interruption, to exactly the same result"""

SEARCH_OPTIONS = ("fitness", "pop_size", "evaluations", "maps_per_set", "repeats", "metric", "failures", "seed")


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the subcommand."""
    parser = options.example_parser(
        subparsers, "evolve", "Search for sets of maps that tell controllers apart.", EXAMPLES
    )
    search = parser.add_argument_group("the search")
    search.add_argument("--preset", help=f"options to start from: {', '.join(preset_names())} (default thesis)")
    search.add_argument("--config", metavar="FILE", help="YAML with the sections search, controllers, run")
    search.add_argument("--fitness", metavar="NAME", help=options.names_in(FITNESSES))
    search.add_argument("--pop-size", type=options.positive, metavar="N")
    search.add_argument("--evaluations", type=options.positive, metavar="N", help="map sets evaluated in all")
    search.add_argument("--maps-per-set", type=options.positive, metavar="N")
    search.add_argument("--repeats", type=options.positive, metavar="R", help="runs of each controller on each map")
    search.add_argument(
        "--metric",
        metavar="NAME",
        help=f"quantity that is compared (default time): {', '.join(METRIC_NAMES)}, or module:attribute",
    )
    search.add_argument("--failures", choices=("exclude", "censor", "par2"), help="what a failed run counts")
    options.add_controllers_option(parser)
    options.add_drive_options(parser)
    options.add_work_options(parser)
    parser.add_argument("--out", metavar="DIR", help="run directory (default runs/FITNESS-popN-seedN)")
    parser.add_argument("--resume", metavar="DIR", help="continue the run in this directory")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Evolve, record, draw, and say where to look."""
    rundir, experiment = _resumed(args) if args.resume else _new(args)
    with (
        ResultStore(rundir.store_path) as store,
        Evaluator(
            run_job, store, workers=options.workers_of(args), warm_up=warm_up, executor=args.executor
        ) as evaluator,
        WorkBar("evolving", experiment.search.evaluations) as bar,
    ):
        evolve(experiment, evaluator, rundir, on_generation=bar.on_generation, on_run=bar.on_run)
    loaded = load_run(rundir.path)
    write_run_figures(loaded)
    _print_summary(loaded)
    _print_errors(loaded)
    return 0


def _new(args: argparse.Namespace) -> tuple[RunDir, Experiment]:
    experiment = _experiment(args)
    search = experiment.search
    fitness = search.fitness.replace(":", ".")
    default = Path("runs") / f"{fitness}-pop{search.pop_size}-seed{search.seed}"
    return RunDir.create(args.out or default, experiment), experiment


def _resumed(args: argparse.Namespace) -> tuple[RunDir, Experiment]:
    other = ("resume", "workers", "executor", "run", "command")
    given = [name for name in vars(args) if name not in other and getattr(args, name)]
    if given:
        raise ConfigError(
            f"--resume: expected no other option than --workers and --executor, got --{given[0].replace('_', '-')}"
        )
    rundir = RunDir.open(args.resume)
    return rundir, experiment_of(rundir.config)


def _experiment(args: argparse.Namespace) -> Experiment:
    """Preset, then the user's file, then the options of the command line."""
    config = {} if args.config is None else read_document(args.config)
    document = overlay(load_preset(args.preset or "thesis"), config)
    given: dict[str, Any] = {name: getattr(args, name) for name in SEARCH_OPTIONS if getattr(args, name) is not None}
    document = overlay(document, {"search": given})
    named = options.named_controllers(args)
    if named and (args.controllers is not None or "controllers" not in config):
        document["controllers"] = [spec.model_dump() for spec in named]
    experiment = experiment_of(document)
    settings = options.drive_settings(args, experiment.run)  # type: ignore[arg-type]
    if len(experiment.controllers) < 2:
        raise ConfigError(f"controllers: expected two or more to tell apart, got {experiment.plan.names[0]} alone")
    try_controllers(experiment.controllers, settings)
    options.check_room([_emptiest(experiment.search.shapes)], settings)
    return Experiment(experiment.search, experiment.controllers, settings)


def _emptiest(shapes: ShapeSettings) -> Scenario:
    """The generated map without obstacles; a robot that does not fit there fits nowhere."""
    cells = clear_and_border(np.zeros((shapes.size, shapes.size), dtype=np.bool_), shapes)
    return replace(scenario_on(cells, shapes), name="generated maps")


def _print_summary(loaded: LoadedRun) -> None:
    """Show the best map set: each controller's time on each map, and how the fitness reads the map."""
    results = loaded.best_results
    table = Table(title=f"Best map set, fitness {results['fitness']:.4f}")
    table.add_column("map")
    for name in loaded.controllers:
        table.add_column(f"{name}, s", justify="right")
    table.add_column("reading", justify="right")
    for entry in results["maps"]:
        cells = [_cell(entry["runs"][name]) for name in loaded.controllers]
        reading = "-" if entry["reading"] is None else f"{entry['reading']:.3f}"
        table.add_row(entry["name"], *cells, reading)
    console.print(table)
    console.print(f"Look at {loaded.path / 'figures'} and {loaded.path / 'README.txt'};")
    console.print(f"drive the maps again with: mapbench bench {loaded.path} --repeats 5")


def _print_errors(loaded: LoadedRun) -> None:
    """Say how many runs could not be driven to an end, and why the first."""
    reasons = [row["reason"] for row in loaded.runs if row["outcome"] == "error"]
    if reasons:
        note(f"{len(reasons)} of {len(loaded.runs)} runs ended in an error, the first because: {reasons[0]}")


def _cell(runs: list[dict[str, Any]]) -> str:
    """Mean time of the runs of one controller on one map, or how they ended."""
    failed = [one["outcome"] for one in runs if one["outcome"] != "goal"]
    if failed:
        return str(failed[0])
    return f"{sum(one['time_s'] for one in runs) / len(runs):.2f}"
