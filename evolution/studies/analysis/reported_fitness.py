"""Reported fitness: the fitness that a search reports for its best set, compared with its held-out fitness."""

from __future__ import annotations

from collections.abc import Sequence
from statistics import fmean, median

import numpy as np

from evolution.driving import RunResult, SetResults
from evolution.files import Row
from evolution.search import short_names
from evolution.statistics import BOOTSTRAP_SEED, holm, median_interval, pairwise_mann_whitney, vargha_delaney_a12
from evolution.studies.analysis.results import StudyResults, StudyRun
from evolution.studies.former_names import StudyRow
from evolution.studies.settings import JUDGES

CLOSE = 0.5
"""Largest difference between reported and held-out fitness that counts as agreement."""
EQUAL = 1.2
"""Largest ratio of two times at which two controllers count as equally fast."""
RESAMPLES = 10_000
"""Pairs of resampled re-evaluations of a set."""
OF_REPEATS = ("aggregate", "cluster_scale")
"""Options that do not change the fitness of one trial; the cluster scale of the results is compared instead."""


def reported_fitness_rows(results: StudyResults) -> list[Row]:
    """Return a row for every configuration with re-evaluated runs.

    ``mean_trial`` is the median over the runs of the mean held-out trial (:attr:`Reevaluation.mean_trial`).
    ``within_half`` is the share of runs whose reported and held-out fitness differ by 0.5 at most, and
    ``within_half_repeated`` that of two re-evaluations of the same set (:func:`repeatability`).
    ``rank_agreement`` is the share of all trials in which every map has a score and its rank in the search.
    ``a12`` is the fraction of pairs of runs in which this configuration has the better held-out fitness than the
    configuration ``against``: the first one with the same fitness of a trial and the same world. Ties count half.
    ``p_holm`` is the p-value of the Mann-Whitney test of the two, with Holm's correction over all tested rows.
    """
    groups = results.reevaluated
    rows = [_row(name, runs, _reference(runs, groups)) for name, runs in groups.items()]
    tested = [row for row in rows if row["p_holm"] is not None]
    for row, p_value in zip(tested, holm([row["p_holm"] for row in tested]), strict=True):
        row["p_holm"] = p_value
    return rows


def _row(name: str, runs: Sequence[StudyRun], reference: Sequence[StudyRun]) -> Row:
    reevaluations = [run.held_out for run in runs]
    held_out, reported = np.array([run.held_out.fitness for run in runs]), np.array([run.fitness for run in runs])
    low, high = median_interval(held_out)
    same = [run.seed for run in reference] == [run.seed for run in runs] and reference[0].path == runs[0].path
    others = [run.held_out.fitness for run in reference]
    one_scale = len({run.best_results["cluster_scale"] for run in (*runs, *reference)}) == 1
    tested = not same and one_scale and len(runs) > 1 and len(others) > 1
    return StudyRow(
        {
            "configuration": name,
            "n": len(runs),
            "reported_fitness": float(np.median(reported)),
            "held_out_fitness": float(np.median(held_out)),
            "held_out_low": low,
            "held_out_high": high,
            "mean_trial": float(np.median([one.mean_trial for one in reevaluations])),
            "absolute_error": float(np.median(np.abs(held_out - reported))),
            "within_half": float(np.mean(np.abs(held_out - reported) <= CLOSE)),
            "within_half_repeated": fmean(
                repeatability([one.fitness for one in again.trials]) for again in reevaluations
            ),
            "held_out_success_rate": fmean(one.success_rate for one in reevaluations),
            "rank_agreement": fmean(sum(one.ranks_kept) / len(one.trials) for one in reevaluations),
            "roles": fmean(fills_roles(one.results) for one in reevaluations),
            "against": reference[0].configuration.name if tested else "",
            "a12": vargha_delaney_a12(others, held_out) if tested else None,
            "p_holm": pairwise_mann_whitney({"a": held_out, "b": others}, [("a", "b")])[0].p_value if tested else None,
        }
    )


def repeatability(trials: Sequence[float]) -> float:
    """Return the share of pairs of re-evaluations of a set whose fitness differs by 0.5 at most.

    Both are resampled from the trials of the set, with as many seeds. A search whose report has no selection bias, and
    as many seeds, would be as near to the held-out fitness as that.

    Args:
        trials: The fitness of each held-out trial.
    """
    rng = np.random.default_rng(BOOTSTRAP_SEED)
    first, second = np.median(rng.choice(np.array(trials), (2, RESAMPLES, len(trials))), axis=-1)
    return float(np.mean(np.abs(first - second) <= CLOSE))


def _reference(runs: Sequence[StudyRun], groups: dict[str, list[StudyRun]]) -> list[StudyRun]:
    """Return the runs of the first configuration with the same fitness of a trial and the same world."""

    def judged(run: StudyRun) -> tuple[object, ...]:
        document = run.experiment.document()
        document["run"].get("environment", {}).pop("noise", None)  # the re-evaluation has the noise of the study
        search = short_names(document["search"])
        options = [search[name] for name in JUDGES if name not in OF_REPEATS]
        return options, document["controllers"], document["run"], run.configuration.fresh_noise

    return next(others for others in groups.values() if judged(others[0]) == judged(runs[0]))


def fills_roles(results: SetResults) -> bool:
    """Whether a set has a map with one group of controllers, a map with two groups, and so on, by median times.

    The controllers of a group differ by a factor of 1.2 at most; two groups differ by more.

    Args:
        results: Results of the set; failed runs are ignored.
    """
    found = {groups_in(of_map) for of_map in results}
    return set(range(1, len(results[0]) + 1)) <= found


def groups_in(of_map: Sequence[Sequence[RunResult]]) -> int:
    """Return the number of groups of controllers on a map; 0 if one never reached the goal, or groups overlap."""
    times = [[run.time_s for run in runs if run.success] for runs in of_map]
    if not all(times):
        return 0
    ordered = sorted(median(one) for one in times)
    starts = [0, *(place for place in range(1, len(ordered)) if ordered[place] > EQUAL * ordered[place - 1])]
    ends = [*starts[1:], len(ordered)]
    clear = all(ordered[end - 1] <= EQUAL * ordered[start] for start, end in zip(starts, ends, strict=True))
    return len(starts) if clear else 0
