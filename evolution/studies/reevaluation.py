"""Re-evaluation of the best set of a run on held-out seeds (thesis, Tables 5.3 and 5.4)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from evolution.driving import Evaluator
from evolution.files import make_directory, read_json, write_json
from evolution.runs import (
    LoadedRun,
    RecordedExperiment,
    Reevaluation,
    check_results,
    present_results,
    reevaluation_of,
    results_document,
    results_in,
)
from evolution.search import Evaluation, Experiment
from gym_mapbench.errors import RunError


def reevaluate(run: LoadedRun, experiment: Experiment, fresh: Experiment, evaluator: Evaluator) -> dict[str, Any]:
    """Run the best set of a run on held-out seeds; return a document like ``best_results.json``.

    Args:
        run: A finished run.
        experiment: The experiment of the run.
        fresh: World and seeds of the re-evaluation.
        evaluator: Drives the runs.
    """
    (results,) = evaluator.evaluate([run.best], fresh.plan)
    fitness = replace(experiment.fitness, cluster_scale=run.checkpoint["cluster_scale"])
    evaluation = Evaluation(run.best, results, fitness(results))
    noise = fresh.document()["run"]["environment"]["noise"]
    return {"noise": noise, **results_document(evaluation, fresh.plan.names, fitness.cluster_scale)}


def write_reevaluation(path: Path, document: Mapping[str, Any]) -> None:
    """Write what :func:`reevaluate` returned."""
    make_directory(path.parent)
    write_json(path, document)


def read_reevaluation(
    path: Path, reported: Mapping[str, Any], experiment: RecordedExperiment, seeds: int
) -> Reevaluation:
    """Read a re-evaluation, and judge it by the fitness of the search.

    Args:
        path: Its file.
        reported: ``best_results.json`` of the run.
        experiment: The experiment of the run.
        seeds: Runs of every controller on every map.

    Raises:
        RunError: If the file is missing or damaged, or belongs to another map set.
    """
    document, names = present_results(read_json(path)), experiment.names
    check_results(document, path, names, len(reported["maps"]), seeds)
    if document["map_set"] != reported["map_set"]:
        raise RunError(f"{path}: belongs to another map set than the best one of the run")
    return reevaluation_of(results_in(document, names), reported, experiment)
