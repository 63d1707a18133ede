"""Re-evaluation: the best set of a run, driven again with seeds that no search used (thesis, Tables 5.3 and 5.4)."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from evolution.driving import Evaluator, OnRun
from evolution.files import make_directory, read_json, write_json
from evolution.runs import (
    DrivenAgain,
    LoadedRun,
    check_results,
    driven_again,
    fitness_of,
    present_results,
    results_document,
    results_in,
)
from evolution.search import Evaluation, Experiment
from gym_mapbench.errors import RunError


def reevaluate(
    run: LoadedRun, experiment: Experiment, fresh: Experiment, evaluator: Evaluator, on_run: OnRun | None = None
) -> dict[str, Any]:
    """Drive the best set of a run again; returns a document like ``best_results.json``.

    Args:
        run: A finished run.
        experiment: What it was run with.
        fresh: World and seeds of the re-evaluation.
        evaluator: Drives the runs.
        on_run: Called after each driven run.
    """
    (results,) = evaluator.evaluate([run.best], fresh.plan, on_run)
    fitness = fitness_of(experiment, run.checkpoint["cluster_scale"])
    evaluation = Evaluation(run.best, results, fitness(results))
    noise = fresh.document()["run"]["environment"]["noise"]
    return {"noise": noise, **results_document(evaluation, fresh.plan.names, fitness.cluster_scale)}


def write_reevaluation(path: Path, document: Mapping[str, Any]) -> None:
    """Write what :func:`reevaluate` returned."""
    make_directory(path.parent)
    write_json(path, document)


def read_reevaluation(path: Path, seen: Mapping[str, Any], experiment: Experiment, seeds: int) -> DrivenAgain:
    """Read a re-evaluation and judge it as the search would have.

    Args:
        path: Its file.
        seen: ``best_results.json`` of the run.
        experiment: What the search was run with.
        seeds: Runs of every controller on every map.

    Raises:
        RunError: If the file is missing or damaged, or belongs to another map set.
    """
    document, names = present_results(read_json(path)), experiment.plan.names
    check_results(document, path, names, len(seen["maps"]), seeds)
    if document["map_set"] != seen["map_set"]:
        raise RunError(f"{path}: belongs to another map set than the best one of the run")
    return driven_again(results_in(document, names), seen, experiment)
