"""Fresh minus seen: the fitness of a study's best sets on fresh seeds, minus the fitness their searches saw.

The difference includes the luck of the selection and, where the new runs have other noise than the searches
had, the effect of that noise; it does not tell the two apart.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from evolution.files import Row
from evolution.studies.analysis.results import StudyResults, StudyRun
from gym_mapbench.world.noise import read_noise


def selected_sets(runs: Sequence[StudyRun]) -> list[StudyRun]:
    """Return the re-evaluated runs that selected their set by driving, each set of a seed only once."""
    found: dict[tuple[int, str], StudyRun] = {}
    for run in runs:
        if run.fresh is not None and run.configuration.method != "path_length":
            found.setdefault((run.seed, run.seen["map_set"]), run)
    return list(found.values())


def order_kept(runs: Sequence[StudyRun]) -> tuple[float, float]:
    """Return how often the maps of a set keep the order the search saw, and how often that can be judged.

    Sets without an order in the search, because a map had no value, are left out.

    Returns:
        Share of the fresh seeds with the order kept, among those on which every map has a value (NaN if there are
        none); and the share of these among all fresh seeds (NaN if no set has an order).
    """
    ordered = [run.fresh for run in runs if run.fresh is not None and None not in run.fresh.scores]
    judged = [kept for fresh in ordered for kept in fresh.orders]
    seeds = sum(len(fresh.singles) for fresh in ordered)
    return float(np.mean(judged)) if judged else float("nan"), len(judged) / seeds if seeds else float("nan")


def conditions(run: StudyRun, results: StudyResults) -> str:
    """Say in words how the runs on fresh seeds differ from those of the search."""
    noise = results.settings.reevaluation_noise(run.configuration)
    searched = run.experiment.document()["run"]["environment"]["noise"]
    if noise is None or searched == noise:
        return "new seeds"
    if searched == read_noise(noise, "reevaluation.noise").model_dump(mode="json"):
        return "new seeds"
    if noise == "none":
        return "new seeds without noise"
    return f"new seeds and {noise if isinstance(noise, str) else 'other'} noise"


def fresh_rows(results: StudyResults) -> list[Row]:
    """Return fresh minus seen for every configuration that was driven again, however its sets were selected."""
    again = {
        name: [(run, run.fresh) for run in runs if run.fresh is not None]
        for name, runs in results.by_configuration.items()
    }
    rows = []
    for name, pairs in again.items():
        if not pairs:
            continue
        runs = [run for run, _ in pairs]
        kept, solved = order_kept(runs)
        rows.append(
            {
                "configuration": name,
                "repeats": runs[0].experiment.search.repeats,
                "n": len(runs),
                "seen": float(np.median([run.fitness for run in runs])),
                "fresh": float(np.median([fresh.fitness_as_searched for _, fresh in pairs])),
                "winners_curse": float(np.median([run.winners_curse for run in runs])),
                "solved": solved,
                "order_kept": kept,
                "fresh_success_rate": float(np.mean([fresh.success_rate for _, fresh in pairs])),
            }
        )
    return rows
