"""The figures of the thesis' chapter 5, drawn from its repetition."""

from __future__ import annotations

from collections.abc import Sequence
from statistics import fmean, stdev
from typing import Any

import numpy as np

from docs.generate.thesis_study import kept, kept_fitness
from docs.generate.thesis_tables import LABELS, THESIS_SIZES
from evolution.pictures import colour_of, new_figure


def sizes_figure() -> Any:
    """Figures 5.1 and 5.2: fitness over the budget, and of the best sets, by population size."""
    figure, (left, right) = new_figure(2, width=9.5, height=3.8)
    _draw_progress(left, list(THESIS_SIZES))
    names, found = list(THESIS_SIZES), kept_fitness()
    for place, (name, (mean, deviation, _)) in enumerate(THESIS_SIZES.items()):
        colour = colour_of(names, name)
        values = list(found[name].values())
        right.plot(np.full(len(values), place - 0.12), values, "o", color=colour, alpha=0.6)
        right.errorbar(place - 0.12, fmean(values), stdev(values), fmt="_", color=colour, markersize=18, capsize=4)
        right.errorbar(place + 0.12, mean, deviation, fmt="_", color="#888888", markersize=18, capsize=4)
    right.errorbar([], [], fmt="_", color="#888888", label="thesis (24 searches), mean and SD")
    right.set_xticks(range(len(names)), [LABELS[name] for name in names], fontsize=8)
    right.set_ylabel("reported fitness (lower is better)")
    right.legend(frameon=False, fontsize=8)
    right.grid(axis="y", alpha=0.3)
    return figure


def cluster_figure() -> Any:
    """Figure 5.4: fitness over the budget with the cluster fitness."""
    figure, (axes,) = new_figure(width=5.5, height=3.4)
    _draw_progress(axes, ["cluster"])
    return figure


def _draw_progress(axes: Any, names: Sequence[str]) -> None:
    """Draw mean and standard deviation of the best fitness so far, over map sets evaluated."""
    for name in names:
        rows = [row for row in kept("generations") if row["configuration"] == name]
        curves: dict[int, list[float]] = {}
        for row in rows:
            curves.setdefault(row["evaluations"], []).append(row["best"])
        places, values = list(curves), np.array(list(curves.values()))
        mean, deviation = values.mean(axis=1), values.std(axis=1, ddof=min(1, values.shape[1] - 1))
        colour = colour_of(names, name)
        axes.plot(places, mean, color=colour, label=f"{LABELS.get(name, name)} (n = {values.shape[1]})")
        axes.fill_between(places, mean - deviation, mean + deviation, color=colour, alpha=0.15, linewidth=0)
    axes.set_xlabel("map sets evaluated")
    axes.set_ylabel("best fitness, mean and SD")
    axes.grid(alpha=0.3)
    axes.legend(frameon=False, fontsize=8)
