"""Tables of runs that benchmarks share: cells with intervals, and runs as CSV."""

from __future__ import annotations

import csv
import math
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from statistics import fmean
from typing import Any

import numpy as np

from evolution.benchmark.paired import PairedComparison, compare_pairs
from evolution.files import Row
from evolution.statistics import bootstrap_interval, median_interval, share_interval

MISSING = "–"
OfMaps = Sequence[tuple[str, float]]
"""Values with the names of their maps."""


def is_goal(row: Row) -> bool:
    """Whether a run reached the goal."""
    return row["outcome"] == "goal"


def of(rows: Sequence[Row], **wanted: object) -> list[Row]:
    """Return the rows with these values."""
    return [row for row in rows if all(row[name] == value for name, value in wanted.items())]


def share(rows: Sequence[Row], wanted: Callable[[Row], bool] = is_goal) -> str:
    """Return the share of wanted runs in percent with its 95 % interval."""
    return "{:.0f} ({:.0f} to {:.0f})".format(*share_and_ends(rows, wanted))


def share_and_ends(rows: Sequence[Row], wanted: Callable[[Row], bool] = is_goal) -> tuple[float, float, float]:
    """Return the share of wanted runs and the ends of its 95 % interval (Wilson, with maps as the units), in percent.

    Without runs they are not numbers.
    """
    if not rows:
        return math.nan, math.nan, math.nan
    of_maps: dict[str, list[float]] = {}
    for row in rows:
        of_maps.setdefault(str(row["map"]), []).append(float(wanted(row)))
    found = fmean(float(wanted(row)) for row in rows)
    low, high = share_interval(found, list(of_maps.values()))
    return 100 * found, 100 * low, 100 * high


def over_maps(values: OfMaps, statistic: Callable[..., Any], digits: int) -> str:
    """Return the median or the mean of the means of maps with its 95 % bootstrap interval."""
    if not values:
        return MISSING
    by_map: dict[str, list[float]] = {}
    for name, value in values:
        by_map.setdefault(name, []).append(value)
    means = np.array([fmean(some) for some in by_map.values()])
    interval = median_interval if statistic is np.median else partial(bootstrap_interval, rng=np.random.default_rng(0))
    low, high = interval(means)
    return f"{float(statistic(means)):.{digits}f} ({low:.{digits}f} to {high:.{digits}f})"


def write_runs(path: Path, rows: Sequence[Row], columns: Sequence[str]) -> None:
    """Write some columns of runs as CSV."""
    with path.open("w", encoding="utf-8", newline="") as file:
        table = csv.DictWriter(file, columns, extrasaction="ignore", lineterminator="\n", restval="")
        table.writeheader()
        table.writerows(rows)


def read_runs(path: Path) -> list[Row]:
    """Read the runs that :func:`write_runs` wrote; all cells are text."""
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def compared(before: Sequence[Row], after: Sequence[Row]) -> PairedComparison:
    """Return the paired comparison of two sides' runs of one controller, as :func:`read_runs` gives them."""
    sides = [sorted(rows, key=lambda row: (str(row["map"]), int(row["repeat"]))) for rows in (before, after)]
    timed = [[{**row, "time_s": float(row["time_s"])} for row in rows] for rows in sides]
    return compare_pairs(list(zip(*timed, strict=True)))
