"""The tables of the thesis' chapter 5 beside those of its repetition."""

from __future__ import annotations

from statistics import fmean, median, stdev

from docs.generate.markdown import table
from docs.generate.thesis_study import best_times, kept, kept_fitness
from evolution.files import Row
from evolution.statistics import kruskal_wallis

THESIS_SIZES = {"gini_20": (-8.57, 1.20, -8.54), "gini_40": (-8.77, 0.85, -8.64), "gini_60": (-8.59, 1.39, -8.69)}
"""Mean, standard deviation and median of the fitness of 24 searches (thesis, Table 5.2), by configuration."""
THESIS_TIMES = {
    "gini_40": (
        ((37.65, 9.15, 139.4), (6.54, 5.95, 7.75), (4.93, 4.66, 5.26)),
        ((8.13, 8.0, 8.2), (7.03, 6.5, 7.65), (11.73, 5.23, 14.84)),
        ((8.47, 8.4, 8.55), (7.8, 7.19, 8.08), (8.87, 5.46, 15.31)),
    ),
    "cluster": (
        ((7.79, 7.65, 8.05), (7.95, 7.48, 9.9), (11.11, 5.63, 20.32)),
        ((7.57, 7.55, 7.6), (6.26, 6.05, 6.49), (4.77, 4.54, 5.14)),
        ((13.91, 13.83, 13.98), (6.11, 5.83, 6.39), (8.3, 4.59, 14.47)),
    ),
}
"""Mean, least and greatest time of ten runs, s, ``[map][controller]`` (thesis, Tables 5.3 and 5.4)."""
CONTROLLERS = ("dwb", "mppi", "rpp")
"""The controllers of these tables, in their order."""
NO_PATTERN = 100.0
"""Fitness from which on a set has no pattern, or its runs failed."""
LABELS = {"gini_20": "population 20", "gini_40": "population 40", "gini_60": "population 60"}
"""Configurations of the study ``thesis`` in words."""


def thesis_sizes() -> str:
    """Return Table 5.2 of the thesis beside ours, the Kruskal-Wallis test of both, and what held-out seeds leave."""
    found = kept_fitness()
    rows = []
    for name, theirs in THESIS_SIZES.items():
        ours = list(found[name].values())
        numbers = (fmean(ours), stdev(ours), median(ours))
        again = [row for row in kept("runs") if row["configuration"] == name]
        held_out = median(row["held_out_fitness"] for row in again)
        left = _number(held_out) if held_out < NO_PATTERN else "no pattern"
        goals = f"{fmean(row['held_out_success_rate'] for row in again):.0%}"
        rows.append([LABELS[name], _summary(*theirs), str(len(ours)), _summary(*numbers), left, goals])
    test = kruskal_wallis({name: list(found[name].values()) for name in THESIS_SIZES})
    heads = ["thesis: mean (SD), median", "here: n", "mean (SD), median", "held-out, median", "goals there"]
    return (
        table(["", *heads], rows) + "\n\n*Reported fitness; 24 searches of each kind in the thesis. Kruskal-Wallis: "
        f"H = 0.44, p = 0.80 in the thesis, H = {test.statistic:.2f}, p = {test.p_value:.2f} here.*"
    )


def thesis_times(configuration: str) -> str:
    """Return Table 5.3 or 5.4 of the thesis above that of the best kept set: times of ten runs on each map."""
    theirs = [
        [f"thesis, map {number}", *map(_times, of_map)]
        for number, of_map in enumerate(THESIS_TIMES[configuration], start=1)
    ]
    ours = [[f"here, {name}", *map(_held_out, of_map)] for name, of_map in best_times(configuration).items()]
    return table(["", *(f"{name.upper()}, s" for name in CONTROLLERS)], [*theirs, *ours])


def thesis_speeds() -> str:
    """Return the least times of ten runs on the maps of best sets, and their ratio to RPP's, there and here."""
    theirs = {
        name: [of_map[place][1] for maps in THESIS_TIMES.values() for of_map in maps]
        for place, name in enumerate(CONTROLLERS)
    }
    ours = {
        name: [row["min_s"] for row in kept("times") if row["controller"] == name and row["goals"]]
        for name in CONTROLLERS
    }
    rows = []
    for name in CONTROLLERS:
        cells = [(f"{median(of[name]):.1f}", f"{median(of[name]) / median(of['rpp']):.2f}") for of in (theirs, ours)]
        rows.append([name.upper(), *(cell for pair in cells for cell in pair), str(len(ours[name]))])
    heads = ("thesis: least time, s", "ratio to RPP", "here: least time, s", "ratio to RPP", "maps here")
    return table(["", *heads], rows) + "\n\n*Medians over maps of the least time of ten runs.*"


def _held_out(row: Row) -> str:
    """Return the times of a controller on a map, and how many runs reached the goal unless all did."""
    times = _times((row["mean_s"], row["min_s"], row["max_s"])) if row["goals"] else "none"
    return times if row["goals"] == row["runs"] else f"{times}, {row['goals']} of {row['runs']} runs"


def _times(spread: tuple[float, float, float]) -> str:
    """Return mean, least and greatest time, s."""
    mean, least, greatest = spread
    return f"{mean:.1f} ({least:.1f} to {greatest:.1f})"


def _summary(mean: float, deviation: float, middle: float) -> str:
    return f"{_number(mean)} ({_number(deviation)}), {_number(middle)}"


def _number(value: float) -> str:
    return f"{value:.2f}"
