"""Figures of a tuning, drawn from the rows of its trials."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from evolution.pictures.style import COLOURS, count_along_x, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST_SHOWN = 12
"""Largest number of parameters in the figure of importances."""

Rows = Sequence[Mapping[str, Any]]


def history_figure(trials: Rows, column: str) -> Figure:
    """Cost of each trial over its number, the lowest cost so far, and the cost of the user's own values.

    Args:
        trials: One row per trial, with ``trial``, ``state`` and the cost in ``column``; the first has the own values.
        column: Name of the cost.
    """
    figure, (axes,) = new_figure(width=7.0)
    for state, marker, colour in (("complete", "o", COLOURS[0]), ("stopped", "x", "#999999")):
        shown = [row for row in trials if row["state"] == state]
        points = [row["trial"] for row in shown], [row[column] for row in shown]
        axes.plot(*points, marker, color=colour, markersize=4, label=f"{state} ({len(shown)})")
    done = [row for row in trials if row["state"] == "complete"]
    lowest = np.minimum.accumulate([row[column] for row in done])
    axes.step([row["trial"] for row in done], lowest, where="post", color=COLOURS[1], label="lowest so far")
    axes.axhline(trials[0][column], color="#222222", linestyle="--", linewidth=1, label="own values")
    if min(row[column] for row in done) > 0:
        axes.set_yscale("log")
        low, high = axes.get_ylim()
        if high > 10 * low:  # labels at all multiples would overlap
            axes.yaxis.get_minor_locator().set_params(subs=(2.0, 5.0))
        axes.yaxis.set_minor_formatter("{x:g}")
    axes.yaxis.set_major_formatter("{x:g}")
    count_along_x(axes, "trial")
    axes.set_ylabel(f"{column} (lower is better)")
    axes.grid(alpha=0.3, which="both")
    figure.legend(loc="outside lower center", frameon=False, fontsize=8, ncols=4)
    return figure


def importance_figure(rows: Rows) -> Figure:
    """Importance of the parameters for each objective, the largest on top.

    Args:
        rows: One per parameter, with ``parameter`` and a column for each objective.
    """
    shown = list(rows)[:MOST_SHOWN]
    objectives = [name for name in shown[0] if name != "parameter"]
    figure, (axes,) = new_figure(width=7.0, height=1.0 + 0.3 * len(shown))
    height = 0.8 / len(objectives)
    for place, name in enumerate(objectives):
        at = np.arange(len(shown)) + height * (place - (len(objectives) - 1) / 2)
        axes.barh(at, [row[name] for row in shown], height * 0.9, color=COLOURS[place], label=name)
    axes.set_yticks(range(len(shown)), [row["parameter"] for row in shown], fontsize=8)
    axes.invert_yaxis()
    axes.set_xlabel("importance (PED-ANOVA), all parameters together 1")
    if len(objectives) > 1:
        axes.legend(frameon=False)
    return figure


def front_figure(trials: Rows, finalists: Rows, front: Sequence[int], columns: Sequence[str]) -> Figure:
    """First two costs of the complete trials, and of the finalists on held-out seeds with the Pareto front.

    Args:
        trials: One row per trial.
        finalists: One row per finalist, with ``trial`` and the costs.
        front: Numbers of the finalists on the front, by the first cost.
        columns: Names of the costs.
    """
    figure, (axes,) = new_figure()
    first, second = columns[:2]
    done = [row for row in trials if row["state"] == "complete"]
    axes.plot([row[first] for row in done], [row[second] for row in done], ".", color="#bbbbbb", label="trials")
    of_trial = {row["trial"]: row for row in finalists}
    line = [of_trial[number] for number in front]
    axes.plot([row[first] for row in line], [row[second] for row in line], "o-", color=COLOURS[0], label="Pareto front")
    axes.plot(of_trial[0][first], of_trial[0][second], "s", color=COLOURS[1], label="own values")
    for row in line:
        axes.annotate(str(row["trial"]), (row[first], row[second]), (4, 4), textcoords="offset points", fontsize=8)
    axes.set(xlabel=f"{first} (lower is better)", ylabel=f"{second} (lower is better)")
    axes.grid(alpha=0.3)
    axes.legend(frameon=False)
    return figure
