"""The figures of the study ``evolve``: evolution against random sampling, drawn from its CSV file."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import brentq
from scipy.stats import norm

from evolution.pictures import colour_of, new_figure
from evolution.statistics import median_interval, vargha_delaney_a12

RESULTS = Path(__file__).parents[1] / "concepts" / "evolve.csv"
COMPARISONS = {
    "families of the default search": ("ours", "random"),
    "wide families, 1000 runs": ("ours_wide", "random_wide"),
    "wide families, 300 runs": ("ours_wide_300", "random_wide_300"),
    "wide families, 3000 runs": ("ours_wide_3000", "random_wide_3000"),
    "shapes of the thesis, 1000 runs": ("without_families", "random_without_families"),
    "Nav2 Jazzy": ("ours_jazzy", "random_jazzy"),
    "fitness roles": ("ours_roles", "random_roles"),
    "fitness pairs": ("ours_pairs", "random_pairs"),
    "parameters of the thesis": ("ours_thesis", "random_thesis"),
    "ppo.zip beside MPPI": ("ours_policy", "random_policy"),
}
"""Searches by evolution and by random sampling, under the name of what both have in common."""
MEASURES = {
    "held_out_fitness": "held-out fitness (lower is better)",
    "mean_trial": "mean held-out trial (lower is better)",
}
"""Measures of the named sets, by column of the CSV file, with the labels of their axis."""
BUDGETS = {300: "_300", 1000: "", 3000: "_3000"}
"""Runs of a search of wide families, and how its name in the study ends."""
METHODS = {"random_wide": "random sampling", "ours_wide": "offspring of the archive"}
"""The searches of wide families, without the ending for their runs, and their labels."""
CONFIDENCE = 0.95
TINY = 1e-9
"""Keeps the search for an end of an interval away from the estimate, at which it may be 0, too."""


class Shown(NamedTuple):
    """How evolution compares with random sampling in one measure.

    Args:
        a12: Chance that a search by evolution has the lower value.
        low: Lower end of its 95 % interval.
        high: Upper end.
        better: Seeds on which evolution has the lower value.
        seeds: Seeds of both.
    """

    a12: float
    low: float
    high: float
    better: int
    seeds: int


def values_of(search: str, measure: str) -> dict[int, float]:
    """Return a measure of the named sets of a search, by seed."""
    rows = csv.DictReader(RESULTS.read_text(encoding="utf-8").splitlines())
    return {int(row["seed"]): float(row[measure]) for row in rows if row["search"] == search}


def compared(names: tuple[str, str], measure: str) -> Shown:
    """Compare evolution with random sampling in one measure, lower values being better."""
    evolved, sampled = (values_of(name, measure) for name in names)
    a12 = vargha_delaney_a12(list(sampled.values()), list(evolved.values()))
    both = evolved.keys() & sampled.keys()
    better = sum(evolved[seed] < sampled[seed] for seed in both)
    return Shown(a12, *a12_interval(a12, len(evolved), len(sampled)), better, len(both))


def a12_interval(a12: float, first: int, second: int) -> tuple[float, float]:
    """Return the 95 % interval of an A12 of two samples.

    Args:
        a12: Its estimate, 0 to 1.
        first: Size of one sample.
        second: Size of the other one.

    Source: Newcombe, 2006, Statistics in Medicine 25, method 5: the variance of Hanley and McNeil at the end itself,
    both sizes in its terms replaced by their mean.
    """
    z, more = norm.ppf(0.5 + CONFIDENCE / 2), (first + second) / 2 - 1

    def excess(end: float) -> float:
        spread = end * (1 - end) * (1 + more * ((1 - end) / (2 - end) + end / (1 + end)))
        return float((end - a12) ** 2 - z**2 * spread / (first * second))

    low = brentq(excess, 0.0, a12 - TINY) if a12 > 0.0 else 0.0
    return low, brentq(excess, a12 + TINY, 1.0) if a12 < 1.0 else 1.0


def comparisons_figure() -> Any:
    """Draw the chance that evolution is better than random sampling, in two measures, with its interval."""
    figure, panels = new_figure(len(MEASURES), width=9.5, height=4.4, sharey=True)
    for axes, (measure, label), own in zip(panels, MEASURES.items(), "ab", strict=True):
        for place, names in enumerate(COMPARISONS.values()):
            one = compared(names, measure)
            away = [[one.a12 - one.low], [one.high - one.a12]]
            axes.errorbar(one.a12, place, xerr=away, fmt="D", color=colour_of("ab", own), capsize=3)
        axes.axvline(0.5, color="#888888", linewidth=1.0, zorder=0)
        axes.set_xlim(0.0, 1.0)
        axes.set_xlabel(f"chance that evolution is better (A12)\n{label.split(' (')[0]}")
        axes.grid(axis="x", alpha=0.3)
    sizes = [compared(names, "held_out_fitness").seeds for names in COMPARISONS.values()]
    labels = [f"{name} (n = {seeds})" for name, seeds in zip(COMPARISONS, sizes, strict=True)]
    panels[0].set_yticks(range(len(labels)), labels, fontsize=8)
    panels[0].invert_yaxis()
    return figure


def budgets_figure() -> Any:
    """Draw two measures of the sets of wide families by the runs of a search: medians with intervals, and each set."""
    figure, panels = new_figure(len(MEASURES), width=9.0, height=3.8)
    for axes, (measure, label) in zip(panels, MEASURES.items(), strict=True):
        for side, (name, method), own in zip((-0.06, 0.06), METHODS.items(), "ab", strict=True):
            found = {runs: list(values_of(name + ending, measure).values()) for runs, ending in BUDGETS.items()}
            _draw_budgets(axes, found, side, colour_of("ab", own), method)
        axes.set_xscale("log")
        axes.set_xticks(list(BUDGETS), [str(runs) for runs in BUDGETS])
        axes.minorticks_off()
        axes.set_xlabel("runs of a search")
        axes.set_ylabel(label)
        axes.grid(axis="y", alpha=0.3)
    panels[0].legend(loc="upper center", frameon=False, fontsize=8)
    return figure


def _draw_budgets(axes: Any, found: Mapping[int, Sequence[float]], side: float, colour: str, method: str) -> None:
    """Draw the values of one method by runs of a search, a little to one side of them."""
    places = [runs * (1.0 + side) for runs in found]
    middles = [float(np.median(values)) for values in found.values()]
    away = np.abs(np.transpose([median_interval(values) for values in found.values()]) - middles)
    axes.errorbar(places, middles, away, fmt="D-", color=colour, capsize=3, label=method)
    for place, values in zip(places, found.values(), strict=True):
        axes.plot([place] * len(values), values, ".", color=colour, alpha=0.35, markersize=4)
