"""The results of a map set: written to a document, read back from it, and the errors among them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from evolution.driving import RunResult
from evolution.files import Row
from evolution.search import Confirmation, Evaluation, MapResults, result_fields
from gym_mapbench.world.scenario import MapSet


def named(map_set: MapSet) -> MapSet:
    """Return the same map set with its scenarios called ``map_1``, ``map_2``..."""
    return MapSet(tuple(replace(scenario, name=f"map_{i}") for i, scenario in enumerate(map_set, start=1)))


def results_document(
    evaluation: Evaluation,
    controllers: Sequence[str],
    cluster_scale: float | None,
    confirmation: Confirmation | None = None,
) -> Row:
    """Return the JSON-able results of a map set: its fitness, and per map and controller every run.

    The fitness of a confirmed set is the one on new seeds; readings and values are those it was chosen by.
    """
    fitness = evaluation.fitness
    columns = zip(evaluation.map_set, fitness.readings, fitness.values, evaluation.results, strict=True)
    return {
        "map_set": evaluation.map_set.digest,
        "fitness": fitness.total if confirmation is None else confirmation.fitness,
        "success_rate": fitness.success_rate,
        "timeouts": fitness.timeouts,
        "pattern": fitness.pattern,
        "cluster_scale": cluster_scale,
        **({} if confirmation is None else {"confirmation": asdict(confirmation)}),
        "maps": [
            {
                "name": f"map_{number}",
                "map": scenario.map.digest,
                "reading": reading,
                "values": None if values is None else dict(zip(controllers, values, strict=True)),
                "runs": _runs_of_map(of_map, controllers),
            }
            for number, (scenario, reading, values, of_map) in enumerate(columns, start=1)
        ],
    }


def _runs_of_map(of_map: Sequence[Sequence[RunResult]], controllers: Sequence[str]) -> Mapping[str, list[Row]]:
    return {
        name: [{"seed": result.seed, **result_fields(result), "metrics": dict(result.metrics)} for result in results]
        for name, results in zip(controllers, of_map, strict=True)
    }


def confirmation_in(results: Mapping[str, Any]) -> Confirmation | None:
    """Return what ``best_results.json`` says of the confirmation; None if it says nothing."""
    found = results.get("confirmation")
    if found is None:
        return None
    bounds = {name: tuple(found[name]) for name in ("interval", "goals_interval")}
    return Confirmation(**{**found, **bounds})


def chosen_by(results: Mapping[str, Any], controllers: Sequence[str]) -> dict[str, Any]:
    """Return the readings and the values in ``best_results.json``: those by which the set was chosen."""
    values = [entry["values"] for entry in results["maps"]]
    return {
        "readings": tuple(entry["reading"] for entry in results["maps"]),
        "values": tuple(None if one is None else tuple(one[name] for name in controllers) for one in values),
    }


def confirmed_sentence(results: Mapping[str, Any], search: Mapping[str, Any]) -> list[str]:
    """Say what a confirmed set is worth, or that none could be confirmed; nothing if that was not asked for.

    Args:
        results: ``best_results.json``.
        search: Options of the search.
    """
    if not search.get("confirmation"):
        return []
    found = results.get("confirmation")
    if found is None:
        return ["No set is confirmed." if results["success_rate"] == 1.0 else "No set was solved by all controllers."]
    (low, high), (least, most) = found["interval"], found["goals_interval"]
    return [
        f"Driven with {found['seeds']} new seeds that chose nothing, the set has fitness {found['fitness']:.2f} "
        f"(95 % of single drives {low:.2f} to {high:.2f}); its maps keep their order in "
        f"{100 * found['order_kept']:.0f} % of the drives, and {found['goals']} of {found['runs']} runs reach the goal "
        f"({100 * least:.0f} to {100 * most:.0f} %)."
    ]


def typical_repeat(entry: Mapping[str, Any]) -> int:
    """Return the repeat of a map whose times are nearest to their medians, as ratios; the first where one failed.

    Args:
        entry: A map in ``best_results.json``.
    """
    times = [[one["time_s"] for one in runs if one["outcome"] == "goal"] for runs in entry["runs"].values()]
    repeats = max(map(len, entry["runs"].values()))
    if min(map(len, times)) < max(repeats, 1):
        return 0
    table = np.array(times)
    distances = np.abs(np.log(table / np.median(table, axis=1, keepdims=True))).sum(axis=0)
    return int(np.argmin(distances))


def results_in(document: Mapping[str, Any], controllers: tuple[str, ...]) -> tuple[MapResults, ...]:
    """Return the results in a checked document of :func:`results_document`, map by map."""
    return tuple(
        tuple(tuple(RunResult(**one) for one in entry["runs"][name]) for name in controllers)
        for entry in document["maps"]
    )


def errors_in(results: Sequence[MapResults], controllers: Sequence[str], when: str) -> list[str]:
    """Say how many runs on a map set ended in an error, and why the first did; returns one line, or none.

    Args:
        results: Results of its maps.
        controllers: Names of the controllers that drove, in order.
        when: When the set was driven, in words.
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
