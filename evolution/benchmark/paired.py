"""Paired statistics: success and times of two sides on the same maps and noise.

The units of every test are maps, because runs on one map depend on each other. With fewer than five maps the units are
runs, and runs that are equal in every measure count once: without noise, repeats are copies of one run. Success:
McNemar's exact test (McNemar 1947; a map counts for the side that reaches the goal more often). Time: Wilcoxon's
signed-rank test and a bootstrap interval of the ratio, over the pairs in which both sides reach the goal.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from statistics import fmean
from typing import NamedTuple

import numpy as np

from evolution.files import Row, counted
from evolution.statistics import FEWEST_FOR_INTERVAL, bootstrap_interval

BOOTSTRAP_SEED = 0
NOT_MEASURED = frozenset({"configuration", "controller", "repeat", "seed", "controller_ms"})
"""Columns in which a copy of a run may differ from it; ``controller_ms`` is wall-clock time."""
COPIES = (
    "Copies of other runs, equal to them in every measure: {} of {}. They count once in intervals and tests; with "
    "--noise runs differ."
)


class Trial(NamedTuple):
    """One run: its map, whether it reached the goal, and its time, s (NaN if it has none)."""

    map: str
    success: bool
    time: float


@dataclass(frozen=True)
class PairedComparison:
    """The second side against the first.

    Args:
        pairs: Pairs of runs; in :func:`compare_rows` without copies of a pair.
        n: Units of the test of success: maps, or runs if there are fewer than five maps.
        wins: Units in which the second side reaches the goal more often.
        losses: Units in which the first side does.
        p_success: Two-sided p-value of McNemar's exact test.
        both: Pairs of runs in which both sides reach the goal.
        time_ratio: Time of the second side over that of the first, geometric mean over units; NaN without a pair. A
            run that begins at the goal takes no time, so its pair has no ratio.
        ratio_low: Lower end of its 95 % interval; NaN for fewer than five units.
        ratio_high: Upper end.
        p_time: Two-sided p-value of Wilcoxon's test of the logarithms of the ratios; NaN without a pair.
    """

    pairs: int
    n: int
    wins: int
    losses: int
    p_success: float
    both: int
    time_ratio: float
    ratio_low: float
    ratio_high: float
    p_time: float


def compare_paired(first: Sequence[Trial], second: Sequence[Trial], rng: np.random.Generator) -> PairedComparison:
    """Compare two sides run by run.

    Args:
        first: Runs of one side.
        second: Runs of the other side on the same maps and noise, in the same order.
        rng: Samples the bootstrap.
    """
    pairs = list(zip(first, second, strict=True))
    many = many_maps(a.map for a, _ in pairs)
    gains = units([(a.map, float(b.success) - float(a.success)) for a, b in pairs], many)
    wins, losses = sum(gain > 0 for gain in gains), sum(gain < 0 for gain in gains)
    both = [(a, b) for a, b in pairs if a.success and b.success]
    logs = units([(a.map, math.log(b.time / a.time)) for a, b in both if min(a.time, b.time) > 0], many)
    low, high = bootstrap_interval(logs, rng) if len(logs) >= FEWEST_FOR_INTERVAL else (math.nan, math.nan)
    return PairedComparison(
        pairs=len(pairs),
        n=len(gains),
        wins=wins,
        losses=losses,
        p_success=mcnemar(wins, losses),
        both=len(both),
        time_ratio=math.exp(fmean(logs)) if logs else math.nan,
        ratio_low=math.exp(low),
        ratio_high=math.exp(high),
        p_time=wilcoxon(logs),
    )


def many_maps(names: Iterable[str]) -> bool:
    """Whether runs on maps of these names are on at least five maps, which are then the units."""
    return len({*names}) >= FEWEST_FOR_INTERVAL


def units_in_words(n: int, many: bool) -> str:
    """Return the number of units in words.

    Args:
        n: Their number.
        many: As for :func:`units`.
    """
    return counted(n, "map") if many else counted(n, "pair of runs", "pairs of runs")


def units(values: Sequence[tuple[str, float]], many: bool) -> list[float]:
    """Return the mean of each map's values if the units are maps, else the values.

    Args:
        values: Values with the names of their maps.
        many: Whether :func:`many_maps` holds for all runs, those without a value included.
    """
    if not many:
        return [value for _, value in values]
    groups: dict[str, list[float]] = {}
    for name, value in values:
        groups.setdefault(name, []).append(value)
    return [fmean(group) for group in groups.values()]


def mcnemar(wins: int, losses: int) -> float:
    """Return the two-sided p-value of McNemar's exact test; 1 if nothing was won or lost."""
    from scipy import stats

    return float(stats.binomtest(wins, wins + losses).pvalue) if wins + losses else 1.0


def wilcoxon(differences: Sequence[float]) -> float:
    """Return the two-sided p-value of Wilcoxon's signed-rank test; 1 if all are zero, NaN if there is none."""
    from scipy import stats

    if not differences:
        return math.nan
    return float(stats.wilcoxon(differences).pvalue) if any(differences) else 1.0


def paired_rows(first: Sequence[Row], second: Sequence[Row]) -> list[tuple[Row, Row]]:
    """Return the runs of two sides that have the same map and repeat, in the order of the first side."""
    now = {(row["map"], row.get("repeat")): row for row in second}
    before = {(row["map"], row.get("repeat")): row for row in first}
    return [(row, now[key]) for key, row in before.items() if key in now]


def distinct_rows(rows: Sequence[Row]) -> list[Row]:
    """Return the runs of one side each once: runs that are equal in every measure are one."""
    return list({_measures(row): row for row in rows}.values())


def distinct_pairs(pairs: Sequence[tuple[Row, Row]]) -> list[tuple[Row, Row]]:
    """Return pairs of runs each once: pairs of which both runs are equal are one."""
    return list({(_measures(a), _measures(b)): (a, b) for a, b in pairs}.values())


def copies_in_words(rows: Sequence[Row]) -> list[str]:
    """Return a sentence that says how many runs of a benchmark or comparison are copies; nothing if no run is."""
    copies = len(rows) - len({(row.get("configuration"), row["controller"], _measures(row)) for row in rows})
    return [COPIES.format(copies, counted(len(rows), "run"))] if copies else []


def _measures(row: Row) -> frozenset[tuple[str, object]]:
    return frozenset((name, value) for name, value in row.items() if name not in NOT_MEASURED)


def trial_of(row: Row) -> Trial:
    """Return a run of a benchmark as a trial."""
    return Trial(row["map"], row["outcome"] == "goal", row["time_s"])


def compare_rows(first: Sequence[Row], second: Sequence[Row]) -> PairedComparison:
    """Return the comparison of two sides of a benchmark without copies; the bootstrap has a seed of its own."""
    pairs = distinct_pairs(paired_rows(first, second))
    sides = [trial_of(a) for a, _ in pairs], [trial_of(b) for _, b in pairs]
    return compare_paired(*sides, np.random.default_rng(BOOTSTRAP_SEED))
