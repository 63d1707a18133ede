"""Tables of runs that benchmarks share: cells with intervals, and runs as CSV."""

from __future__ import annotations

import csv
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from statistics import fmean
from typing import Any

import numpy as np

from evolution.files import Row
from evolution.statistics import bootstrap_interval, median_interval, wilson_interval

MISSING = "–"
OfMaps = Sequence[tuple[str, float]]
"""Values with the names of their maps."""


def is_goal(row: Row) -> bool:
    """Whether a run reached the goal."""
    return row["outcome"] == "goal"


def of(rows: Sequence[Row], **wanted: str) -> list[Row]:
    """Return the rows with these values."""
    return [row for row in rows if all(row[name] == value for name, value in wanted.items())]


def share(count: int, of: int) -> str:
    """Return a share in percent with its 95 % interval (Wilson)."""
    low, high = wilson_interval(count, of)
    return f"{100 * count / of:.0f} ({100 * low:.0f} to {100 * high:.0f})"


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
