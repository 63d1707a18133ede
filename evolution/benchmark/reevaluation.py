"""The best maps of a run in a benchmark: judged as the map set that they are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from evolution.driving import RunResult
from evolution.files import Row
from evolution.runs import DrivenAgain, LoadedRun, driven_again, experiment_in

FIELDS = ("outcome", "time_s", "path_length_m", "reason", "seed")
KEYS = frozenset({"map", "controller", "repeat", *FIELDS})


def again_in(rows: Sequence[Row], run: LoadedRun) -> DrivenAgain | None:
    """Return the best set of a run as driven by a benchmark; None if the controllers are not those of the run.

    Args:
        rows: Runs of the benchmark.
        run: The run whose best maps it drove.
    """
    found: dict[tuple[str, str], list[RunResult]] = {}
    for row in rows:
        found.setdefault((row["map"], row["controller"]), []).append(_result(row))
    maps = [entry["name"] for entry in run.best_results["maps"]]
    if set(found) != {(name, controller) for name in maps for controller in run.controllers}:
        return None
    results = tuple(tuple(tuple(found[name, controller]) for controller in run.controllers) for name in maps)
    return driven_again(results, run.best_results, experiment_in(run))


def again_sentence(again: DrivenAgain, run: LoadedRun) -> str:
    """Say what became of a map set that was driven again."""
    totals = sorted(one.fitness for one in again.singles)
    runs = [result for of_map in again.results for of_controller in of_map for result in of_controller]
    order = (
        f"its maps keep their order in {sum(again.orders)} of {_drives(len(again.singles))}, "
        if None not in again.scores
        else ""
    )
    return (
        f"As a map set: fitness {again.fitness:.2f} in the median of {_drives(len(totals))} ({totals[0]:.2f} to "
        f"{totals[-1]:.2f}; the search said {run.best_results['fitness']:.2f}), {order}"
        f"{sum(result.success for result in runs)} of {len(runs)} runs reach the goal."
    )


def _drives(count: int) -> str:
    return f"{count} drive" + "s" * (count != 1)


def _result(row: Mapping[str, Any]) -> RunResult:
    metrics = {name: value for name, value in row.items() if name not in KEYS and isinstance(value, int | float)}
    return RunResult(**{name: row[name] for name in FIELDS}, metrics=metrics)
