"""All maps that a recorded search drove, with their results."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from evolution.jobs import RunResult
from evolution.records import RESULT_FIELDS
from evolution.rundir import LoadedRun
from evolution.study.best_set import MapResults

NOT_METRICS = frozenset({"generation", "map", "controller", "repeat", "seed", "noise_seed", *RESULT_FIELDS})


def driven_maps(run: LoadedRun, until: int | None = None) -> dict[str, MapResults]:
    """Return the results of every driven map by its digest, in order of first use.

    Wall-clock values are not among them: they are not recorded in a run directory.

    Args:
        run: A recorded search.
        until: The last generation to look at; None for all.
    """
    found: dict[str, dict[str, list[RunResult]]] = {}
    for row in run.runs:
        if until is None or row["generation"] <= until:
            found.setdefault(row["map"], {}).setdefault(row["controller"], []).append(_result(row))
    return {digest: tuple(tuple(of_map[name]) for name in run.controllers) for digest, of_map in found.items()}


def results_in(document: Mapping[str, Any], controllers: tuple[str, ...]) -> tuple[MapResults, ...]:
    """Return the results in what :func:`evolution.records.results_document` made and was checked, map by map."""
    return tuple(
        tuple(tuple(RunResult(**one) for one in entry["runs"][name]) for name in controllers)
        for entry in document["maps"]
    )


def errors_in(results: Sequence[MapResults], controllers: Sequence[str], when: str) -> list[str]:
    """Say how many runs on a map set could not be driven to an end, and why the first of them; one line, or none.

    Args:
        results: Of its maps.
        controllers: Names of those that drove, in order.
        when: When it was driven, in words.
    """
    runs = [(name, one) for of_map in results for name, some in zip(controllers, of_map, strict=True) for one in some]
    failed = [(name, one) for name, one in runs if one.outcome == "error"]
    if not failed:
        return []
    name, first = failed[0]
    return [
        f"{len(failed)} of {len(runs)} runs on the best set {when} ended in an error, the first of {name}: "
        f"{first.reason or 'no reason given'}"
    ]


def _result(row: Mapping[str, Any]) -> RunResult:
    metrics = {name: float(value) for name, value in row.items() if name not in NOT_METRICS and value is not None}
    return RunResult(**{name: row[name] for name in RESULT_FIELDS}, metrics=metrics, seed=row["seed"])
