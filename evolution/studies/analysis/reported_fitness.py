"""Promises: what the searches of a study said of their best sets, and what became of it on fresh seeds."""

from __future__ import annotations

from collections.abc import Sequence
from statistics import fmean, median

import numpy as np

from evolution.driving import RunResult, SetResults
from evolution.files import Row
from evolution.search import short_names
from evolution.statistics import holm, median_interval, pairwise_mann_whitney, vargha_delaney_a12
from evolution.studies.analysis.results import StudyResults, StudyRun
from evolution.studies.settings import JUDGES

KEPT = 0.5
"""A promise is kept if the fitness on fresh seeds differs from the one the search said by no more than this."""
EQUAL = 1.2
"""Controllers are alike if one takes no longer than this many times the other."""
BOOTSTRAP_SEED = 0
OF_REPEATS = ("aggregate", "cluster_scale")
"""Options that do not decide what a single drive is worth; the scale that was used is looked at instead."""


def promise_rows(results: StudyResults) -> list[Row]:
    """Return a row for every configuration whose sets were driven again.

    ``a12`` is how often, of all pairs of runs, this configuration is better on fresh seeds than the one that it is held
    ``against``: the first one whose single drives are judged alike, in the same world. Ties count half; ``p_holm`` is
    of Mann and Whitney's test of the two, corrected by Holm over all rows that are tested.
    """
    groups = {
        name: again
        for name, runs in results.by_configuration.items()
        if (again := [run for run in runs if run.fresh is not None])
    }
    rows = [_row(name, runs, _reference(runs, groups)) for name, runs in groups.items()]
    tested = [row for row in rows if row["p_holm"] is not None]
    for row, p_value in zip(tested, holm([row["p_holm"] for row in tested]), strict=True):
        row["p_holm"] = p_value
    return rows


def _row(name: str, runs: Sequence[StudyRun], reference: Sequence[StudyRun]) -> Row:
    fresh, seen = np.array([_fresh(run) for run in runs]), np.array([run.fitness for run in runs])
    low, high = median_interval(fresh, np.random.default_rng(BOOTSTRAP_SEED))
    same = [run.seed for run in reference] == [run.seed for run in runs] and reference[0].path == runs[0].path
    others = [_fresh(run) for run in reference]
    one_scale = len({run.seen["cluster_scale"] for run in (*runs, *reference)}) == 1
    tested = not same and one_scale and len(runs) > 1 and len(others) > 1
    return {
        "configuration": name,
        "n": len(runs),
        "claimed": float(np.median(seen)),
        "fresh": float(np.median(fresh)),
        "fresh_low": low,
        "fresh_high": high,
        "off": float(np.median(np.abs(fresh - seen))),
        "kept": float(np.mean(np.abs(fresh - seen) <= KEPT)),
        "goals": fmean(run.fresh.success_rate for run in runs if run.fresh is not None),
        "order": fmean(order_share(run) for run in runs),
        "roles": fmean(fills_roles(run.fresh.results) for run in runs if run.fresh is not None),
        "against": reference[0].configuration.name if tested else "",
        "a12": vargha_delaney_a12(others, fresh) if tested else None,
        "p_holm": pairwise_mann_whitney({"a": fresh, "b": others}, [("a", "b")])[0].p_value if tested else None,
    }


def _fresh(run: StudyRun) -> float:
    assert run.fresh is not None
    return run.fresh.fitness


def _reference(runs: Sequence[StudyRun], groups: dict[str, list[StudyRun]]) -> list[StudyRun]:
    """Return the runs of the first configuration whose single drives are judged alike, in the same world."""

    def judged(run: StudyRun) -> tuple[object, ...]:
        document = run.experiment.document()
        document["run"].get("environment", {}).pop("noise", None)  # sets are driven again with the noise of the study
        search = short_names(document["search"])
        options = [search[name] for name in JUDGES if name not in OF_REPEATS]
        return options, document["controllers"], document["run"], run.configuration.fresh_noise

    return next(others for others in groups.values() if judged(others[0]) == judged(runs[0]))


def order_share(run: StudyRun) -> float:
    """Return the share of all fresh drives of a set in which every map has a score and they are in the seen order."""
    assert run.fresh is not None
    return sum(run.fresh.orders) / len(run.fresh.singles)


def fills_roles(results: SetResults) -> bool:
    """Whether a set has a map with one group of controllers, one with two, and so on, by their median times.

    Controllers of one group differ by no more than a factor of 1.2 in all; two groups are further apart than that.

    Args:
        results: Results of the set; failed runs are left out.
    """
    found = {groups_in(of_map) for of_map in results}
    return set(range(1, len(results[0]) + 1)) <= found


def groups_in(of_map: Sequence[Sequence[RunResult]]) -> int:
    """Return how many groups controllers form on a map; 0 if one never reached the goal, or groups are not clear."""
    times = [[run.time_s for run in runs if run.success] for runs in of_map]
    if not all(times):
        return 0
    ordered = sorted(median(one) for one in times)
    starts = [0, *(place for place in range(1, len(ordered)) if ordered[place] > EQUAL * ordered[place - 1])]
    ends = [*starts[1:], len(ordered)]
    clear = all(ordered[end - 1] <= EQUAL * ordered[start] for start, end in zip(starts, ends, strict=True))
    return len(starts) if clear else 0
