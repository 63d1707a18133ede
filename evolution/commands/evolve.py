"""``mapbench evolve``: search for maps that tell controllers apart."""

from __future__ import annotations

import argparse
import shlex
from collections.abc import Mapping, Sequence
from typing import Any

from evolution.api import evolve
from evolution.commands import COMMON, driving_options, experiment_options, options
from evolution.commands.console import console, note, print_table
from evolution.commands.experiment_options import configuration_in, experiment_from
from evolution.commands.progress import SearchBar
from evolution.commands.run_notes import note_models, note_reasons
from evolution.files import counted
from evolution.runs import (
    LoadedRun,
    RunDir,
    contact_sentence,
    experiment_in,
    failing_controller_sentence,
    front_lines,
    slow_everywhere_sentence,
    table_sentence,
    validation_sentence,
)
from evolution.search import FAILURES, FITNESSES, MAP_MEASURES, METRIC_NAMES, Experiment, nested_document
from gym_mapbench.errors import ConfigError

EXAMPLES = """  mapbench evolve --preset quick --out runs/first
  mapbench evolve --preset thesis --fitness cluster --pop-size 40 --evaluations 600 --seed 3
  mapbench evolve --preset thesis                  the search of the thesis: no noise, no validation
  mapbench evolve --fitness roles --family doors,pillars,shapes --runs 2000
  mapbench evolve --people 4 --out runs/people     maps with people who walk
  mapbench evolve --params my_nav2_params.yaml --controllers dwb,rpp --out runs/mine
  mapbench evolve --objectives gini,n_obstacles    differences with few obstacles: a Pareto front
  mapbench evolve --resume runs/first              after an interruption, to exactly the same result"""

BESIDE_RESUME = (*driving_options.RESOURCE_OPTIONS, *COMMON)
"""Options that do not change the result."""
SELECTED_BY_ERRORS = (
    "--resume does not repeat them, as the search has selected by them. To repeat them, begin again in a new directory."
)
SEARCH_OPTIONS = ("fitness", "pop_size", "evaluations", "runs", "maps_per_set", "repeats", "metric", "failures", "seed")


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the subcommand."""
    parser = options.example_parser(subparsers, "evolve", EXAMPLES)
    _add_search_options(parser.add_argument_group("the search"))
    experiment_options.add_run_options(parser)
    parser.add_argument("--out", metavar="DIR", help="run directory (default runs/FITNESS-popN-seedN)")
    parser.add_argument(
        "--resume",
        metavar="DIR",
        help=f"continue the run in this directory; beside it, only {options.written(BESIDE_RESUME)} may be given",
    )
    parser.set_defaults(run=run)


def _add_search_options(search: argparse._ArgumentGroup) -> None:
    """Add the options of the search itself."""
    experiment_options.add_preset_options(search)
    search.add_argument("--fitness", metavar="NAME", help=options.names_in(FITNESSES))
    search.add_argument(
        "--objectives",
        type=options.names,
        metavar="A,B,..",
        help=f"several objectives, all minimised, by NSGA-II: a fitness, and {', '.join(MAP_MEASURES)} or metrics, in "
        "which the fitness is computed once more",
    )
    search.add_argument("--pop-size", type=options.positive, metavar="N", help="map sets in the population")
    search.add_argument("--evaluations", type=options.positive, metavar="N", help="map sets evaluated in total")
    search.add_argument("--runs", type=options.positive, metavar="N", help="runs of controllers in total")
    search.add_argument("--maps-per-set", type=options.positive, metavar="N", help="maps in a map set")
    search.add_argument("--repeats", type=options.positive, metavar="R", help="runs of each controller on each map")
    search.add_argument(
        "--metric",
        metavar="NAME",
        help=f"quantity that is compared (default time): {', '.join(METRIC_NAMES)}, or module:attribute",
    )
    search.add_argument(
        "--failures",
        metavar="NAME",
        help=f"what a failed run counts: {options.names_in(FAILURES)}; with exclude, its map has no value; with "
        "censor, the time limit; with par2, twice the time limit",
    )
    experiment_options.add_map_options(search)


def run(args: argparse.Namespace) -> int:
    """Run the search, draw its figures, and print where the results are."""
    if args.resume:
        _refuse_others(args)
        experiment = experiment_in(RunDir.open(args.resume))
    else:
        experiment = _experiment(args)
    note_models(experiment.controllers, experiment.run)
    with SearchBar(experiment.search) as bar:
        found = evolve(
            None if args.resume else experiment,
            out=args.out,
            resume=args.resume,
            on_generation=bar.on_generation,
            on_run=bar.on_run,
            resources=driving_options.resources_of(args),
        )
    print_table(found.table())
    results, runs = found.best_results, found.runs
    search = found.config["search"]
    sentences = table_sentence(search) + validation_sentence(results, search)
    sentences += failing_controller_sentence(results, runs) + slow_everywhere_sentence(results, search)
    for line in (*sentences, *front_lines(found), *contact_sentence(runs)):
        console.print(line)
    console.print(f"Pictures are in {found.path / 'figures'}; {found.path / 'README.txt'} explains the other files.")
    run = shlex.quote(str(found.path))
    console.print(f"A page with replays: mapbench report {run}")
    console.print(f"The maps on other seeds: mapbench bench {run} --repeats 5")
    _print_early_end(found)
    reasons = [row["reason"] for row in runs if row["outcome"] == "error"]
    note_reasons(reasons, len(runs), SELECTED_BY_ERRORS)
    return 0


def _refuse_others(args: argparse.Namespace) -> None:
    """Refuse options beside ``--resume``: a run is continued with its own options."""
    other = ("resume", "run", "command", "given", *BESIDE_RESUME)
    given = [name for name, value in vars(args).items() if name not in other and _is_given(value)]
    if given:
        allowed, came = options.written(BESIDE_RESUME), options.written(given[:1])
        raise ConfigError(f"--resume: expected no other option than {allowed}, got {came}")


def _is_given(value: object) -> bool:
    """Return whether an option has another value than one that was left out; 0 is given."""
    return value is not None and value is not False and value != []


def _experiment(args: argparse.Namespace) -> Experiment:
    """Build the experiment of a new run."""
    config = configuration_in(args)
    given = options.given_of(args, SEARCH_OPTIONS)
    if args.objectives is not None:
        given |= _objectives(args.objectives, args.fitness, config)
    return experiment_from(args, config, given)


def _objectives(names: Sequence[str], fitness: str | None, config: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options of a search with several objectives, one of which is a fitness.

    Args:
        names: The objectives.
        fitness: The value of ``--fitness``, which need not be repeated among the objectives.
        config: Content of ``--config``; an algorithm that it names is kept.

    Raises:
        ConfigError: If no fitness is named, or several, or a name occurs twice.
    """
    if len(set(names)) < len(names):
        raise ConfigError(f"--objectives: expected different names, got {', '.join(names)}")
    fitnesses = dict.fromkeys([*(name for name in names if name in FITNESSES), *([fitness] if fitness else [])])
    if len(fitnesses) != 1:
        raise ConfigError(
            f"--objectives: expected one fitness among them ({', '.join(FITNESSES)}), or another one with --fitness, "
            f"got {', '.join(fitnesses) or ', '.join(names)}"
        )
    algorithm = nested_document(config).get("search", {}).get("ga", {}).get("algorithm", "nsga2")
    further = [name for name in names if name not in fitnesses]
    return {"fitness": next(iter(fitnesses)), "objectives": further, "algorithm": algorithm if further else "ga"}


def _print_early_end(loaded: LoadedRun) -> None:
    """Say that a search ended before its number of map sets, where no limit of runs is the reason."""
    done, wanted = len(loaded.individuals), loaded.config["search"]["evaluations"]
    if loaded.config["search"]["runs"] is None and done < wanted:
        note(f"ended after {done} of {counted(wanted, 'map set')}, as no new one was found")
