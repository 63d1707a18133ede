"""The effect of a world: success, time and recoveries of each controller, compared with the first world map by map."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from evolution.files import Row
from evolution.statistics import bootstrap_interval, median_interval, wilson_interval

BOOTSTRAP_SEED = 0


def effect_rows(rows: Sequence[Row], worlds: Sequence[str], controllers: Sequence[str]) -> list[Row]:
    """Return one row per world and controller; every interval is a 95 % interval.

    ``success`` is the success rate, with Wilson's interval. ``gained`` is that rate minus the one in the first world,
    and ``changed`` the share of runs that succeed in one of the two worlds only. ``time_ratio`` is the median ratio of
    the time to that in the first world, over the runs that reached the goal in both. All other intervals are bootstrap
    intervals.

    Args:
        rows: The runs, with the columns ``world``, ``controller``, ``map``, ``repeat`` and those of a benchmark.
        worlds: Names of the worlds; the others are compared with the first.
        controllers: Names of the controllers.
    """
    runs = {(row["world"], row["controller"], row["map"], row["repeat"]): row for row in rows}
    return [
        _effect(_pairs(runs, worlds[0], world, controller), world, controller)
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


def _effect(pairs: Sequence[tuple[Row, Row]], world: str, controller: str) -> Row:
    before, now = (np.array([pair[side]["outcome"] == "goal" for pair in pairs]) for side in (0, 1))
    both = [(first["time_s"], row["time_s"]) for first, row in pairs if first["outcome"] == row["outcome"] == "goal"]
    ratios = [now_s / before_s for before_s, now_s in both]
    recoveries = [row["n_recoveries"] for _, row in pairs if row.get("n_recoveries") is not None]
    rng = np.random.default_rng(BOOTSTRAP_SEED)
    success_low, success_high = wilson_interval(int(now.sum()), len(now))
    gained_low, gained_high = _mean_interval(now.astype(float) - before, rng)
    time_low, time_high = median_interval(ratios)
    recoveries_low, recoveries_high = _mean_interval(recoveries, rng)
    return {
        "world": world,
        "controller": controller,
        "n": len(pairs),
        "success": float(now.mean()) if len(now) else np.nan,
        "success_low": success_low,
        "success_high": success_high,
        "gained": float((now.astype(float) - before).mean()) if len(now) else np.nan,
        "gained_low": gained_low,
        "gained_high": gained_high,
        "changed": float((now != before).mean()) if len(now) else np.nan,
        "solved_in_both": len(ratios),
        "time_ratio": float(np.median(ratios)) if ratios else np.nan,
        "time_ratio_low": time_low,
        "time_ratio_high": time_high,
        "recoveries": float(np.mean(recoveries)) if recoveries else np.nan,
        "recoveries_low": recoveries_low,
        "recoveries_high": recoveries_high,
    }


def _mean_interval(values: ArrayLike, rng: np.random.Generator) -> tuple[float, float]:
    """Return the bootstrap interval of the mean; NaN if there are no values."""
    return bootstrap_interval(values, rng) if np.size(values) else (np.nan, np.nan)
