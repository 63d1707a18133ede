"""The effect of a world: success, time and recoveries of each controller, compared with the first world map by map."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from statistics import fmean, median

import numpy as np

from evolution.benchmark import Place, Values, distinct_pairs, goals_of_groups, groups_of, place_of, unit_of
from evolution.files import Row
from evolution.statistics import mean_interval, median_interval, share_difference_interval, share_interval


def effect_rows(rows: Sequence[Row], worlds: Sequence[str], controllers: Sequence[str]) -> list[Row]:
    """Return one row per world and controller; every interval is a 95 % interval.

    ``success`` is the success rate, with Wilson's interval. ``gained`` is that rate minus the one in the first world,
    with Newcombe's interval, and ``changed`` the share of runs that succeed in one of the two worlds only.
    ``time_ratio`` is the ratio of the time to that in the first world, over the runs that reached the goal in both: the
    median over units, each with the median of its runs. All other intervals are bootstrap intervals over units, which
    are those of a comparison (:mod:`evolution.benchmark.paired`): maps, if there are five. Copies of a pair of runs
    count once in intervals.

    Args:
        rows: The runs, with the columns ``world``, ``controller``, ``map``, ``repeat`` and those of a benchmark.
        worlds: Names of the worlds; the others are compared with the first.
        controllers: Names of the controllers.
    """
    runs = {(row["world"], row["controller"], row["map"], row["repeat"]): row for row in rows}
    return [
        _effect(_pairs(runs, worlds[0], world, controller), worlds[0], world, controller)
        for controller in controllers
        for world in worlds
    ]


def _pairs(
    runs: Mapping[tuple[str, str, str, int], Row], first: str, world: str, controller: str
) -> list[tuple[Row, Row]]:
    """Return the runs of a controller in one world, each paired with the same run in the first world."""
    return [
        (runs[first, controller, name, repeat], row)
        for (in_world, of, name, repeat), row in runs.items()
        if in_world == world and of == controller and (first, controller, name, repeat) in runs
    ]


def _effect(pairs: Sequence[tuple[Row, Row]], first: str, world: str, controller: str) -> Row:
    unit = unit_of(place_of(row) for _, row in pairs)
    distinct = distinct_pairs(pairs)
    every, once = _measures(pairs), _measures(distinct)
    medians = [median(group) for group in groups_of(every["time_ratio"], unit)]
    share = _mean(every["success"])
    ends = {
        "success": share_interval(share, groups_of(once["success"], unit)),
        "gained": (0.0, 0.0) if world == first else share_difference_interval(*goals_of_groups(distinct, unit)),
        "time_ratio": median_interval([median(group) for group in groups_of(once["time_ratio"], unit)]),
        "recoveries": mean_interval(groups_of(once["recoveries"], unit)),
    }
    values = {
        "success": share,
        "gained": _mean(every["gained"]),
        "changed": _mean([(place, abs(gain)) for place, gain in every["gained"]]),
        "solved_in_both": len(every["time_ratio"]),
        "time_ratio": median(medians) if medians else np.nan,
        "recoveries": _mean(every["recoveries"]),
    }
    return {"world": world, "controller": controller, "n": len(pairs), **_with_ends(values, ends)}


def _measures(pairs: Sequence[tuple[Row, Row]]) -> dict[str, Values]:
    """Return the values of pairs of runs by column, with their places."""
    found: dict[str, list[tuple[Place, float]]] = {
        name: [] for name in ("success", "gained", "time_ratio", "recoveries")
    }
    for first, row in pairs:
        place, before, now = place_of(row), first["outcome"] == "goal", row["outcome"] == "goal"
        found["success"].append((place, float(now)))
        found["gained"].append((place, float(now) - before))
        if before and now:
            found["time_ratio"].append((place, row["time_s"] / first["time_s"]))
        if row.get("n_recoveries") is not None:
            found["recoveries"].append((place, row["n_recoveries"]))
    return dict(found)


def _with_ends(values: Mapping[str, float], ends: Mapping[str, tuple[float, float]]) -> Row:
    """Return values by column, each followed by the ends of its interval, if it has one."""
    row: Row = {}
    for name, value in values.items():
        row[name] = value
        if name in ends:
            row[f"{name}_low"], row[f"{name}_high"] = ends[name]
    return row


def _mean(values: Values) -> float:
    return fmean(value for _, value in values) if values else np.nan
