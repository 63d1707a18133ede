"""Re-evaluation: the best set of a run, driven again with seeds that no search used (thesis, Tables 5.3 and 5.4).

A search keeps the set whose runs went best, luck included, so the fitness it saw is better than that of
the same set when driven again: the winner's curse. It is stated as a number: fresh minus seen.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import fmean, median
from typing import Any

import numpy as np

from evolution.driving import Evaluator, OnRun, SetResults
from evolution.files import make_directory, read_json, write_json
from evolution.runs import LoadedRun, check_results, results_document, results_in
from evolution.search import Evaluation, Experiment, Fitness, FitnessBreakdown
from gym_mapbench.errors import RunError


@dataclass(frozen=True)
class Reevaluation:
    """A map set on fresh seeds.

    Args:
        results: ``results[map][controller][seed]``.
        singles: The fitness with each fresh seed alone, as one more drive of the set would show it.
        as_searched: The fitness from as many repeats at a time as the search used.
        readings: The reading of each map in the search.
    """

    results: SetResults
    singles: tuple[FitnessBreakdown, ...]
    as_searched: tuple[FitnessBreakdown, ...]
    readings: tuple[float | None, ...]

    @property
    def fitness(self) -> float:
        """Median fitness over the fresh seeds, one run of each controller on each map at a time."""
        return median(one.total for one in self.singles)

    @property
    def fitness_as_searched(self) -> float:
        """Median fitness over the fresh seeds, from as many repeats at a time as the search used."""
        return median(one.total for one in self.as_searched)

    @property
    def success_rate(self) -> float:
        """Share of runs that reached the goal."""
        return fmean(one.success_rate for one in self.singles)

    @property
    def orders(self) -> tuple[bool, ...]:
        """For each fresh seed on which all maps have a reading, whether these are in the order the search saw.

        Empty if a map had no reading in the search.
        """
        seen = _order(self.readings)
        found = [_order(one.readings) for one in self.singles] if seen is not None else []
        return tuple(order == seen for order in found if order is not None)

    @property
    def order_kept(self) -> float:
        """Share of the seeds in :attr:`orders` on which the order is kept; NaN if there are none."""
        return fmean(self.orders) if self.orders else float("nan")


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


def fitness_of(experiment: Experiment, cluster_scale: float | None) -> Fitness:
    """Return the fitness a search used, with the scale it ended with."""
    return Fitness(experiment.search, experiment.run.time_limit, cluster_scale)


def write_reevaluation(path: Path, document: Mapping[str, Any]) -> None:
    """Write what :func:`reevaluate` returned."""
    make_directory(path.parent)
    write_json(path, document)


def read_reevaluation(path: Path, seen: Mapping[str, Any], experiment: Experiment, seeds: int) -> Reevaluation:
    """Read a re-evaluation and judge it as the search would have.

    Args:
        path: Its file.
        seen: ``best_results.json`` of the run.
        experiment: What the search was run with.
        seeds: Runs of every controller on every map.

    Raises:
        RunError: If the file is missing or damaged, or belongs to another map set.
    """
    document, names = read_json(path), experiment.plan.names
    check_results(document, path, names, len(seen["maps"]), seeds)
    if document["map_set"] != seen["map_set"]:
        raise RunError(f"{path}: belongs to another map set than the best one of the run")
    results = results_in(document, names)
    fitness = fitness_of(experiment, seen["cluster_scale"])
    readings = tuple(entry["reading"] for entry in seen["maps"])
    as_searched = judge(results, fitness, experiment.search.repeats)
    return Reevaluation(results, judge(results, fitness, 1), as_searched, readings)


def judge(results: SetResults, fitness: Fitness, repeats: int) -> tuple[FitnessBreakdown, ...]:
    """Judge a set once for every ``repeats`` of its runs; a shorter rest is left out, unless there is nothing else."""
    count = len(results[0][0])
    starts = range(0, max(count - repeats, 0) + 1, repeats)
    return tuple(fitness(_part(results, start, start + repeats)) for start in starts)


def _part(results: SetResults, start: int, end: int) -> SetResults:
    return tuple(tuple(runs[start:end] for runs in of_map) for of_map in results)


def _order(readings: Sequence[float | None]) -> tuple[int, ...] | None:
    """Return the positions of the maps in order of their readings; None if a map has no reading."""
    known = [reading for reading in readings if reading is not None]
    return tuple(int(i) for i in np.argsort(known, kind="stable")) if len(known) == len(readings) else None
