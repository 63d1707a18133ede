"""Scores of each controller over all maps, and paired differences of two controllers, with 95 % intervals."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from math import isnan
from statistics import fmean

from evolution.benchmark.paired import (
    Unit,
    Values,
    corrected,
    distinct_pairs,
    distinct_rows,
    groups_of,
    paired_rows,
    place_of,
    too_few_in_words,
    unit_of,
    wilcoxon,
)
from evolution.files import Row
from evolution.statistics import mean_interval, share_difference_interval, share_interval
from gym_mapbench.metrics import OF_EVERY_RUN, WEIGHTED_BY_SUCCESS

OF_GOALS = {
    "mean s": "time_s",
    "length m": "path_length_m",
    "clearance m": "min_clearance",
    "smoothness": "path_smoothness",
}
"""Columns that are means over the runs that reached the goal, and their fields."""
OF_ALL = {"spl": "spl", "ms": "controller_ms", "recoveries": "n_recoveries"}
"""Columns that are means over all runs: success weighted by path length, controller time per decision, recoveries.

Time and recoveries of a run that ended in an error are unknown, so only the first counts it: as the failure it is.
"""
MEANS = (*OF_GOALS, *OF_ALL)
FIELDS = {"path_length": "path_length_m"}
"""Fields of the metrics that have another name in the rows."""
SHARES = {"success": "goal", "collision": "collision", "timeout": "timeout"}
"""Columns that are shares of the runs, and the outcome whose share they are."""

RowPairs = Sequence[tuple[Row, Row]]


def score_rows(rows: Sequence[Row], controllers: Sequence[str], metrics: Sequence[str] = ()) -> list[Row]:
    """Return a row per controller: its goals, shares of outcomes, and means of measures and of further metrics.

    The mean of a further metric is that of the runs at the goal, or of all runs if it is in
    :data:`~gym_mapbench.metrics.OF_EVERY_RUN`.
    Of every share and mean there are also the ends of its interval, ``NAME from`` and ``NAME to``: Wilson's for shares,
    bootstrap for means. The units are those of :mod:`~evolution.benchmark.paired`; a mean of too few has None.
    """
    return [_score(name, [row for row in rows if row["controller"] == name], metrics) for name in controllers]


def pair_rows(rows: Sequence[Row], controllers: Sequence[str]) -> list[Row]:
    """Return a row per two controllers, over the pairs of their runs on the same map and noise.

    ``gained`` is the success of the second minus the success of the first. ``faster s`` is the time of the first minus
    the time of the second, over the ``both`` pairs in which both reach the goal. Intervals as for
    :func:`score_rows`, Newcombe's for ``gained``. ``p_time_holm`` is the p-value of Wilcoxon's test of these
    differences, corrected by Holm over all pairs of controllers; None without a pair of runs at the goal.
    """
    found = [_pair(rows, *names) for names in combinations(controllers, 2)]
    stepped = corrected([row.pop("p_time") for row in found])
    return [{**row, "p_time_holm": p} for row, p in zip(found, stepped, strict=True)]


def too_few_runs(rows: Sequence[Row], controllers: Sequence[str]) -> list[str]:
    """Return a sentence if no p-value of :func:`pair_rows` can show a difference of times; nothing otherwise."""
    sides = [[row for row in rows if row["controller"] == name] for name in controllers]
    return too_few_in_words(combinations(sides, 2))


def _score(name: str, rows: Sequence[Row], metrics: Sequence[str]) -> Row:
    goals = [row for row in rows if row["outcome"] == "goal"]
    distinct, unit = distinct_rows(rows), unit_of(map(place_of, rows))
    scored: Row = {"controller": name, "goals": len(goals), "runs": len(rows)}
    for column, outcome in SHARES.items():
        share = sum(row["outcome"] == outcome for row in rows) / len(rows)
        hits = [(place_of(row), float(row["outcome"] == outcome)) for row in distinct]
        low, high = share_interval(share, groups_of(hits, unit))
        scored |= {column: share, f"{column} from": low, f"{column} to": high}
    of_all = {metric: metric for metric in metrics if metric in OF_EVERY_RUN}
    of_goals = {metric: metric for metric in metrics if metric not in of_all}
    for chosen, columns in ((goals, OF_GOALS | of_goals), (rows, OF_ALL | of_all)):
        counted = distinct_rows(chosen) if unit == "run" else chosen
        for column, field in columns.items():
            scored |= _mean(column, _values(chosen, field), groups_of(_values(counted, field), unit))
    return scored


def value_of(row: Row, name: str) -> float | None:
    """Return a measure of a run by its name, or by its field in the row; None if it has none.

    A run that ended in an error is a failure, with a weight of 0.
    """
    weighted = row["outcome"] == "error" and name in WEIGHTED_BY_SUCCESS
    return 0.0 if weighted else row.get(FIELDS.get(name, name))


def _values(rows: Sequence[Row], field: str) -> Values:
    return [(place_of(row), value) for row in rows if (value := value_of(row, field)) is not None]


def _pair(rows: Sequence[Row], first: str, second: str) -> Row:
    sides = ([row for row in rows if row["controller"] == name] for name in (first, second))
    pairs = paired_rows(*sides)
    once, unit = distinct_pairs(pairs), unit_of(place_of(a) for a, _ in pairs)
    groups = groups_of(_faster(once if unit == "run" else pairs), unit)
    return {
        "first": first,
        "second": second,
        "pairs": len(pairs),
        **_gained(pairs, once, unit),
        "both": len(_faster(pairs)),
        **_mean("faster s", _faster(pairs), groups),
        "p_time": None if isnan(p_time := wilcoxon([*map(fmean, groups)])) else p_time,
    }


def _gained(pairs: RowPairs, once: RowPairs, unit: Unit) -> Row:
    """Return the difference of success, and the ends of its interval from the pairs without copies."""
    before, after = ([float(pair[side]["outcome"] == "goal") for pair in pairs] for side in (0, 1))
    low, high = share_difference_interval(*goals_of_groups(once, unit))
    return {"gained": fmean(after) - fmean(before) if pairs else None, "gained from": low, "gained to": high}


def goals_of_groups(pairs: RowPairs, unit: Unit) -> tuple[list[list[float]], list[list[float]]]:
    """Return 1 for each goal and 0 for each other run of both sides of pairs, by unit."""
    first, second = (
        groups_of([(place_of(pair[0]), float(pair[side]["outcome"] == "goal")) for pair in pairs], unit)
        for side in (0, 1)
    )
    return first, second


def _faster(pairs: RowPairs) -> Values:
    return [(place_of(a), a["time_s"] - b["time_s"]) for a, b in pairs if a["outcome"] == b["outcome"] == "goal"]


def _mean(name: str, values: Values, groups: Sequence[Sequence[float]]) -> Row:
    """Return the mean of values, and the ends of its interval from their units; None for too few."""
    low, high = (None if isnan(end) else end for end in mean_interval(groups))
    return {name: fmean(value for _, value in values) if values else None, f"{name} from": low, f"{name} to": high}
