"""The results of a map set: written to a document, read back from it, and the errors among them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from evolution.driving import TIME, RunResult
from evolution.files import Row, counted
from evolution.runs.map_summary import summary_of_map
from evolution.search import Evaluation, MapResults, ValidationResult, result_fields
from evolution.statistics import share_interval
from gym_mapbench.world.scenario import MapSet

GOOD_SET = "that all controllers solve and that has the pattern"
"""What no map set with a fitness above 0 is, as that is a sum of penalties."""
BEGIN_ALIKE = ("gini", "cluster")
"""Fitnesses for sets whose first map makes all controllers alike."""


def named(map_set: MapSet) -> MapSet:
    """Return the same map set with its scenarios called ``map_1``, ``map_2``..."""
    return MapSet(tuple(replace(scenario, name=f"map_{i}") for i, scenario in enumerate(map_set, start=1)))


def results_document(
    evaluation: Evaluation,
    controllers: Sequence[str],
    cluster_scale: float | None,
    validation: ValidationResult | None = None,
) -> Row:
    """Return the JSON-able results of a map set: its fitness, and per map and controller every run.

    The fitness of a validated set is its held-out fitness; scores and values are those of its selection.
    """
    judgement = evaluation.judgement
    columns = zip(evaluation.map_set, judgement.scores, judgement.values, evaluation.results, strict=True)
    return {
        "map_set": evaluation.map_set.digest,
        "fitness": judgement.fitness if validation is None else validation.fitness,
        "success_rate": judgement.success_rate,
        "timeouts": judgement.timeouts,
        "pattern": judgement.pattern,
        "cluster_scale": cluster_scale,
        **({} if validation is None else {"validation": asdict(validation)}),
        "maps": [
            {
                "name": f"map_{number}",
                "map": scenario.world_digest,
                "score": score,
                "values": None if values is None else dict(zip(controllers, values, strict=True)),
                "runs": _runs_of_map(of_map, controllers),
            }
            for number, (scenario, score, values, of_map) in enumerate(columns, start=1)
        ],
    }


def _runs_of_map(of_map: Sequence[Sequence[RunResult]], controllers: Sequence[str]) -> Mapping[str, list[Row]]:
    return {
        name: [{"seed": result.seed, **result_fields(result), "metrics": dict(result.metrics)} for result in results]
        for name, results in zip(controllers, of_map, strict=True)
    }


def validation_in(results: Mapping[str, Any]) -> ValidationResult | None:
    """Return the held-out fitness in ``best_results.json``; None if there is none."""
    found = results.get("validation")
    if found is None:
        return None
    bounds = {name: tuple(found[name]) for name in ("interval", "goals_interval")}
    return ValidationResult(**{**found, **bounds})


def chosen_by(results: Mapping[str, Any], controllers: Sequence[str]) -> dict[str, Any]:
    """Return the scores and the values in ``best_results.json``: those by which the set was selected."""
    values = [entry["values"] for entry in results["maps"]]
    return {
        "scores": tuple(entry["score"] for entry in results["maps"]),
        "values": tuple(None if one is None else tuple(one[name] for name in controllers) for one in values),
    }


def validation_sentence(results: Mapping[str, Any], search: Mapping[str, Any]) -> list[str]:
    """Return the held-out fitness of a set in words; nothing if the search has no validation stage.

    Args:
        results: ``best_results.json``.
        search: Options of the search.
    """
    if not search.get("validation"):
        return []
    found = results.get("validation")
    if found is None:
        return ["No set is validated." if results["success_rate"] == 1.0 else "No set was solved by all controllers."]
    (low, high), (least, most) = found["interval"], found["goals_interval"]
    return [
        f"Held-out fitness {found['fitness']:.2f} ({counted(found['seeds'], 'seed')}; 95 % of trials between {low:.2f} "
        f"and {high:.2f}). The maps keep their rank in {100 * found['order_kept']:.0f} % of trials. "
        f"{found['goals']} of {counted(found['runs'], 'run')} reach the goal ({100 * least:.0f} to {100 * most:.0f} %)."
    ]


def table_sentence(search: Mapping[str, Any]) -> list[str]:
    """Return what times and scores of the table of the best maps are of, where they are not of the same runs.

    Args:
        search: Options of the search.
    """
    metric = search.get("judging", {}).get("metric", TIME)
    scores = "" if metric == TIME else f" of {metric}"
    if search.get("validation") is not None:
        return [f"Times: medians of all runs. Scores{scores}: when the set was selected, without the held-out runs."]
    return [f"Times: medians of all runs. Scores{scores}."] if scores else []


def contact_sentence(runs: Sequence[Row]) -> list[str]:
    """Return the share of runs with a contact in words; nothing if contacts were not counted.

    Args:
        runs: Rows of ``runs.csv``.
    """
    touches: dict[str, list[float]] = {}
    for row in runs:
        if row.get("n_contacts") is not None:
            touches.setdefault(row["map"], []).append(float(row["n_contacts"] > 0))
    if not touches:
        return []
    touched, count = sum(map(sum, touches.values())), sum(map(len, touches.values()))
    low, high = share_interval(touched / count, list(touches.values()))
    return [f"{touched:.0f} of {counted(count, 'run')} touch a wall or body ({100 * low:.1f} to {100 * high:.1f} %)."]


def failing_controller_sentence(results: Mapping[str, Any], runs: Sequence[Row]) -> list[str]:
    """Return which controller most often keeps maps from being solved, and why; nothing if the best set is solved.

    Args:
        results: ``best_results.json``.
        runs: Rows of ``runs.csv``.
    """
    outcomes: dict[str, list[bool]] = {}
    for row in runs:
        outcomes.setdefault(row["controller"], []).append(row["outcome"] == "goal")
    if results["success_rate"] == 1.0 or not outcomes:
        return []
    name, goals = min(outcomes.items(), key=lambda item: sum(item[1]) / len(item[1]))
    failed = [row for row in runs if row["controller"] == name and row["outcome"] != "goal"]
    reasons = Counter((row.get("reason") or row["outcome"]).split(";")[0] for row in failed)
    return [
        f"{name} reaches the goal in {sum(goals)} of {counted(len(goals), 'run')}. Its most frequent failure: "
        f"{reasons.most_common(1)[0][0]}."
    ]


def slow_everywhere_sentence(results: Mapping[str, Any], search: Mapping[str, Any]) -> list[str]:
    """Return which controller is slow on every map, where the fitness is for sets with a map on which all are alike.

    Args:
        results: ``best_results.json``.
        search: Options of the search.
    """
    judging = search.get("judging", {})
    maps = [summary_of_map(entry["name"], entry["runs"]) for entry in results["maps"]]
    slowest = {one.ordered[-1].controller for one in maps}
    if judging.get("fitness") not in BEGIN_ALIKE or judging.get("metric") != TIME or len(maps) < 2 or len(slowest) > 1:
        return []
    if any(one.lost or one.alike for one in maps):
        return []
    least = min(one.ratio for one in maps)
    return [
        f"On no map of the set all are alike: {slowest.pop()} always takes at least {least:.1f} times as long as the "
        "fastest. Such a map may exist for the others alone (--controllers), or with other parameters."
    ]


def typical_repeat(entry: Mapping[str, Any]) -> int:
    """Return the repeat of a map whose times are nearest to their medians, as ratios; the first where one failed.

    Controllers may have different numbers of repeats; only those that all of them have are compared.

    Args:
        entry: A map in ``best_results.json``.
    """
    of_controllers = list(entry["runs"].values())
    shared = min(map(len, of_controllers))
    if not shared or any(one["outcome"] != "goal" for runs in of_controllers for one in runs):
        return 0
    times = [np.array([one["time_s"] for one in runs]) for runs in of_controllers]
    distances = sum(np.abs(np.log(some[:shared] / np.median(some))) for some in times)
    return int(np.argmin(distances))


def results_in(document: Mapping[str, Any], controllers: tuple[str, ...]) -> tuple[MapResults, ...]:
    """Return the results in a checked document of :func:`results_document`, map by map."""
    return tuple(
        tuple(tuple(RunResult(**one) for one in entry["runs"][name]) for name in controllers)
        for entry in document["maps"]
    )


def errors_in(results: Sequence[MapResults], controllers: Sequence[str], when: str) -> list[str]:
    """Return one line about the runs on a map set that ended in an error; no line if there is none.

    Args:
        results: Results of its maps.
        controllers: Names of the controllers that drove, in order.
        when: The time of the runs, in words.
    """
    runs = [(name, one) for of_map in results for name, some in zip(controllers, of_map, strict=True) for one in some]
    failed = [(name, one) for name, one in runs if one.outcome == "error"]
    if not failed:
        return []
    name, first = failed[0]
    return [
        f"{len(failed)} of {counted(len(runs), 'run')} on the best set {when} ended in an error, the first of {name}: "
        f"{first.reason or 'no reason given'}"
    ]
