"""Paired statistics: success and times of two sides on the same maps and noise.

The units of every test are maps, because runs on one map depend on each other. Tasks with the same walls are on one
map, such as those of a ``.scen`` file. With fewer than five maps the units are tasks, and with fewer than five tasks
runs; results are then about these maps only. Runs that are equal in every measure count once: without noise, repeats
are copies of one run. The mean of a map or task that is given with its interval is that of all its runs, since copies
make no further units of them. Success: McNemar's exact test (McNemar 1947; a unit counts for the side that reaches the
goal more often). Time: Wilcoxon's signed-rank test and a bootstrap interval of the ratio, over the pairs in which both
sides reach the goal.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from statistics import fmean
from typing import Literal, NamedTuple

from evolution.files import Row, counted
from evolution.statistics import FEWEST_FOR_INTERVAL, LEVEL, holm, mean_interval
from gym_mapbench.world.scenario import Scenario

WALLS = "walls"
"""Column with the digest of the map without its task."""
NOT_MEASURED = frozenset({"configuration", "controller", "repeat", "seed", "controller_ms"})
"""Columns in which a copy of a run may differ from it; ``controller_ms`` is wall-clock time."""
COPIES = (
    "Copies of other runs, equal to them in every measure: {} of {}. They count once in intervals and tests; with "
    "--noise runs differ."
)
TOO_FEW = (
    "No difference of times can be shown: Wilcoxon's test{} needs at least {} where both reach the goal and has at "
    "most {}."
)
FEW_MAPS = "Intervals and tests count {}s and are about {} only, as there are fewer than five maps."

DECIMALS = 9
"""Decimals to which rounding errors do not change a difference of times, s, or the logarithm of a ratio."""


class Place(NamedTuple):
    """Where a run is: the name of its task, and what tells the walls of the map apart from others."""

    task: str
    walls: str


Unit = Literal["map", "task", "run"]
"""What counts once in tests and intervals."""
Values = Sequence[tuple[Place, float]]
"""Values of runs with their places."""


@dataclass(frozen=True)
class PairedComparison:
    """The second side against the first.

    Args:
        pairs: Pairs of runs; in :func:`compare_rows` without copies of a pair.
        n: Units of the test of success: maps, tasks, or runs.
        wins: Units in which the second side reaches the goal more often.
        losses: Units in which the first side does.
        p_success: Two-sided p-value of McNemar's exact test.
        both: Pairs of runs in which both sides reach the goal.
        time_ratio: Time of the second side over that of the first, geometric mean over units; NaN without a pair. A
            run that begins at the goal takes no time, so its pair has no ratio.
        ratio_low: Lower end of its 95 % interval; NaN for fewer than five units, and for equal ratios.
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


def unit_of(places: Iterable[Place]) -> Unit:
    """Return the units of runs at some places: maps if they are at least five, else tasks if these are, else runs."""
    places = {*places}
    if len({place.walls for place in places}) >= FEWEST_FOR_INTERVAL:
        return "map"
    return "task" if len(places) >= FEWEST_FOR_INTERVAL else "run"


def units_in_words(n: int, unit: Unit) -> str:
    """Return the number of units of paired runs in words."""
    return counted(n, "pair of runs", "pairs of runs") if unit == "run" else counted(n, unit)


def maps_in_words(places: Iterable[Place], kind: str = "map") -> str:
    """Return the number of maps in words, with that of tasks if there are more tasks than maps.

    Args:
        places: A place for each task.
        kind: What a map is called.
    """
    places = {*places}
    maps = counted(len({place.walls for place in places}), kind)
    return maps if maps == counted(len(places), kind) else f"{len(places)} tasks on {maps}"


def groups_of(values: Values, unit: Unit) -> list[list[float]]:
    """Return the values of each unit.

    Args:
        values: Values with their places.
        unit: That of all runs, those without a value included.
    """
    if unit == "run":
        return [[value] for _, value in values]
    groups: dict[str, list[float]] = {}
    for place, value in values:
        groups.setdefault(place.walls if unit == "map" else place.task, []).append(value)
    return list(groups.values())


def means(values: Values, unit: Unit) -> list[float]:
    """Return the mean value of each unit; arguments as for :func:`groups_of`."""
    return [fmean(group) for group in groups_of(values, unit)]


def mcnemar(wins: int, losses: int) -> float:
    """Return the two-sided p-value of McNemar's exact test; 1 if nothing was won or lost."""
    from scipy import stats

    return float(stats.binomtest(wins, wins + losses).pvalue) if wins + losses else 1.0


def wilcoxon(differences: Sequence[float]) -> float:
    """Return the two-sided p-value of Wilcoxon's signed-rank test; 1 if all are zero, NaN if there is none.

    Differences of zero do not count (Wilcoxon 1945). SciPy leaves them out as well, but beside many of them it
    approximates the p-value of a few others by a normal distribution. Differences that only rounding errors make differ
    are ties.
    """
    from scipy import stats

    if not differences:
        return math.nan
    others = [rounded for difference in differences if (rounded := round(difference, DECIMALS))]
    return float(stats.wilcoxon(others).pvalue) if others else 1.0


def corrected(p_values: Sequence[float | None]) -> list[float | None]:
    """Return p-values corrected by Holm; a test that was not possible has none and does not count."""
    stepped = iter(holm([p for p in p_values if p is not None]))
    return [None if p is None else next(stepped) for p in p_values]


def paired_rows(first: Sequence[Row], second: Sequence[Row]) -> list[tuple[Row, Row]]:
    """Return the runs of two sides that have the same map and repeat, in the order of the first side."""
    now = {(row["map"], row.get("repeat")): row for row in second}
    before = {(row["map"], row.get("repeat")): row for row in first}
    return [(row, now[key]) for key, row in before.items() if key in now]


def distinct_rows(rows: Sequence[Row]) -> list[Row]:
    """Return the runs of one side each once: runs that are equal in every measure are one."""
    return list({measures_of(row): row for row in rows}.values())


def distinct_pairs(pairs: Sequence[tuple[Row, Row]]) -> list[tuple[Row, Row]]:
    """Return pairs of runs each once: pairs of which both runs are equal are one."""
    return list({(measures_of(a), measures_of(b)): (a, b) for a, b in pairs}.values())


def few_maps_in_words(rows: Sequence[Row]) -> list[str]:
    """Return a sentence on what results on fewer than five maps are about; nothing for more maps, or no run."""
    unit = unit_of(map(place_of, rows))
    return [FEW_MAPS.format(unit, _these(rows))] if rows and unit != "map" else []


def too_few_in_words(sides: Iterable[tuple[Sequence[Row], Sequence[Row]]]) -> list[str]:
    """Return a sentence if no test of times can show a difference, whatever the times are; nothing otherwise.

    The least p-value of Wilcoxon's test of n units is 2 ** (1 - n), and Holm multiplies it by the number of tests.

    Args:
        sides: The runs of both sides of each test; a test without a pair of runs at the goal does not count.
    """
    tests = [found for both in sides if (found := _timed(distinct_pairs(paired_rows(*both))))[0]]
    if not tests:
        return []
    most, unit = max(tests)
    fewest = math.floor(math.log2(len(tests) / LEVEL)) + 2
    by_holm = f" with Holm's correction over {len(tests)} pairs" if len(tests) > 1 else ""
    return [] if most >= fewest else [TOO_FEW.format(by_holm, units_in_words(fewest, unit), most)]


def _timed(pairs: Sequence[tuple[Row, Row]]) -> tuple[int, Unit]:
    """Return the number of units in which both sides reach the goal, and what the units are."""
    unit = unit_of(place_of(a) for a, _ in pairs)
    return len(groups_of([(place_of(a), 1.0) for a, b in pairs if _solved(a) and _solved(b)], unit)), unit


def on_few_maps(rows: Sequence[Row]) -> str:
    """Return the maps of a result in words that continue a sentence; nothing if the maps are the units."""
    return "" if unit_of(map(place_of, rows)) == "map" else f" on {_these(rows)}"


def _these(rows: Sequence[Row]) -> str:
    return "this map" if len({place_of(row).walls for row in rows}) == 1 else "these maps"


def copies_in_words(rows: Sequence[Row]) -> list[str]:
    """Return a sentence that says how many runs of a benchmark or comparison are copies; nothing if no run is."""
    copies = len(rows) - len({(row.get("configuration"), row["controller"], measures_of(row)) for row in rows})
    return [COPIES.format(copies, counted(len(rows), "run"))] if copies else []


def measures_of(row: Row) -> frozenset[tuple[str, object]]:
    """Return what a seed reproduces of a run on a map: its outcome and its measures."""
    return frozenset((name, value) for name, value in row.items() if name not in NOT_MEASURED)


def place_of(row: Row) -> Place:
    """Return where a run of a benchmark is; in results of an earlier version each task has a map of its own."""
    return Place(row["map"], row.get(WALLS) or row["map"])


def place_of_task(scenario: Scenario) -> Place:
    """Return where the runs of a task are."""
    return Place(scenario.name, scenario.map.digest)


def compare_rows(first: Sequence[Row], second: Sequence[Row]) -> PairedComparison:
    """Return the comparison of two sides of a benchmark without copies."""
    return compare_pairs(distinct_pairs(paired_rows(first, second)))


def compare_pairs(pairs: Sequence[tuple[Row, Row]]) -> PairedComparison:
    """Return the comparison of the second runs of some pairs with the first ones."""
    unit = unit_of(place_of(a) for a, _ in pairs)
    gains = means([(place_of(a), float(_solved(b)) - float(_solved(a))) for a, b in pairs], unit)
    wins, losses = sum(gain > 0 for gain in gains), sum(gain < 0 for gain in gains)
    both = [(place_of(a), a["time_s"], b["time_s"]) for a, b in pairs if _solved(a) and _solved(b)]
    logs = means([(place, math.log(after / before)) for place, before, after in both if min(before, after) > 0], unit)
    low, high = mean_interval([[log] for log in logs])
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


def _solved(row: Row) -> bool:
    return bool(row["outcome"] == "goal")
