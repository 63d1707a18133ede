"""Held-out fitness of the best sets of a study, and the selection bias: held-out minus reported fitness.

Where the re-evaluation has other noise than the search, the difference includes the effect of that noise.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from evolution.files import Row
from evolution.studies.analysis.results import StudyResults, StudyRun, reevaluated
from evolution.studies.former_names import StudyRow
from gym_mapbench.world.noise import read_noise


def selected_sets(runs: Sequence[StudyRun]) -> list[StudyRun]:
    """Return the re-evaluated runs whose search ran controllers, each set of a seed once."""
    found: dict[tuple[int, str], StudyRun] = {}
    for run in reevaluated(runs):
        if run.configuration.method != "path_length":
            found.setdefault((run.seed, run.best_results["map_set"]), run)
    return list(found.values())


def rank_agreement(runs: Sequence[StudyRun]) -> tuple[float, float]:
    """Return the rank agreement of some sets, and the fraction of trials in which it is defined.

    Sets in which a map had no score in the search are left out.

    Returns:
        Fraction of trials in which the maps have the ranks of the search, of the trials in which every map has a score
        (NaN if there are none); and the fraction of these among all trials (NaN if no set has ranks).
    """
    ranked = [run.held_out for run in reevaluated(runs) if None not in run.held_out.scores]
    kept = [kept for reevaluation in ranked for kept in reevaluation.ranks_kept]
    trials = sum(len(reevaluation.trials) for reevaluation in ranked)
    return float(np.mean(kept)) if kept else float("nan"), len(kept) / trials if trials else float("nan")


def conditions(run: StudyRun, results: StudyResults) -> str:
    """Return in words how the re-evaluation of a run differs from its search."""
    noise = results.settings.reevaluation_noise(run.configuration)
    searched = run.experiment.world["environment"]["noise"]
    if noise is None or searched == noise:
        return "held-out seeds"
    if searched == read_noise(noise, "reevaluation.noise").model_dump(mode="json"):
        return "held-out seeds"
    if noise == "none":
        return "held-out seeds without noise"
    return f"held-out seeds and {noise if isinstance(noise, str) else 'other'} noise"


def held_out_rows(results: StudyResults) -> list[Row]:
    """Return a row for every configuration with re-evaluated runs: reported and held-out fitness, and their bias."""
    return [_row(name, runs) for name, runs in results.reevaluated.items()]


def _row(name: str, runs: Sequence[StudyRun]) -> Row:
    kept, solved = rank_agreement(runs)
    return StudyRow(
        {
            "configuration": name,
            "repeats": runs[0].experiment.search.repeats,
            "n": len(runs),
            "reported_fitness": float(np.median([run.fitness for run in runs])),
            "held_out_fitness": float(np.median([run.held_out.fitness_as_searched for run in runs])),
            "selection_bias": float(np.median([run.selection_bias for run in runs])),
            "solved": solved,
            "rank_agreement": kept,
            "held_out_success_rate": float(np.mean([run.held_out.success_rate for run in runs])),
        }
    )
