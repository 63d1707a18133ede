"""Re-evaluation of a map set by a benchmark: the best maps of a run, judged as one set."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from evolution.driving import RunResult
from evolution.files import Row, counted
from evolution.runs import GOOD_SET, LoadedRun, RecordedExperiment, Reevaluation, experiment_in, reevaluation_of

FIELDS = ("outcome", "time_s", "path_length_m", "reason", "seed")
KEYS = frozenset({"map", "controller", "repeat", *FIELDS})


def reevaluation_in(rows: Sequence[Row], run: LoadedRun) -> Reevaluation | None:
    """Return the re-evaluation of the best set of a run; None if a benchmark compared other controllers.

    Args:
        rows: Runs of the benchmark.
        run: The run whose best maps the benchmark used.
    """
    found: dict[tuple[str, str], list[RunResult]] = {}
    for row in rows:
        found.setdefault((row["map"], row["controller"]), []).append(_result(row))
    maps = [entry["name"] for entry in run.best_results["maps"]]
    if set(found) != {(name, controller) for name in maps for controller in run.controllers}:
        return None
    results = tuple(tuple(tuple(found[name, controller]) for controller in run.controllers) for name in maps)
    return reevaluation_of(results, run.best_results, RecordedExperiment.of(experiment_in(run)))


def reevaluation_sentence(reevaluation: Reevaluation, run: LoadedRun) -> str:
    """Return the re-evaluation of a map set in words."""
    runs = [result for of_map in reevaluation.results for of_controller in of_map for result in of_controller]
    kept = sum(reevaluation.ranks_kept)
    trials = counted(len(reevaluation.trials), "trial")
    ranks = "" if None in reevaluation.scores else f"The maps keep their rank in {kept} of {trials}. "
    return (
        f"As a map set: {_judged(reevaluation, run.best_results['fitness'])}. {ranks}"
        f"{sum(result.success for result in runs)} of {counted(len(runs), 'run')} reach the goal."
    )


def _judged(reevaluation: Reevaluation, reported: float) -> str:
    """Return the fitness of all trials and of the search in words; a fitness above 0 is a sum of penalties.

    A fitness of 0 or less does not say that all controllers solve the set: ``cluster`` and ``pairs`` may gain more by
    two maps than a failed run on the third one costs.
    """
    fitness = sorted(one.fitness for one in reevaluation.trials)
    trials, median = counted(len(fitness), "trial"), reevaluation.fitness
    if median > 0:
        searched = f"reported by the search: {reported:.2f}" if reported <= 0 else "the search found no such set"
        good = sum(one.fitness <= 0 and one.success_rate == 1 for one in reevaluation.trials)
        return f"all controllers solve it and it has the pattern in {good} of {trials} ({searched})"
    searched = f"reported by the search: {reported:.2f}" if reported <= 0 else f"the search found no set {GOOD_SET}"
    worst = f"{fitness[-1]:.2f}" if fitness[-1] <= 0 else "a sum of penalties"
    return f"median fitness {median:.2f} in {trials} (between {fitness[0]:.2f} and {worst}; {searched})"


def _result(row: Mapping[str, Any]) -> RunResult:
    metrics = {name: value for name, value in row.items() if name not in KEYS and isinstance(value, int | float)}
    return RunResult(**{name: row[name] for name in FIELDS}, metrics=metrics)
