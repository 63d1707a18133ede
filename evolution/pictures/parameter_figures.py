"""Figures of a sweep: lines with intervals for one parameter, heat maps for two."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from statistics import fmean
from typing import TYPE_CHECKING, Any

import numpy as np

from evolution.pictures.style import COLOURS, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MEASURES = (("success", "runs at the goal, %", 100.0), ("mean s", "mean time at the goal, s", 1.0))

Rows = Sequence[Mapping[str, Any]]


def sweep_figure(rows: Rows, names: Sequence[str], own: Mapping[str, float]) -> Figure:
    """Success and mean time over one parameter with 95 % intervals, or over two parameters as heat maps.

    Args:
        rows: One per configuration: the values by name, and the columns of ``score_rows``.
        names: Names of the parameters; the first two are shown. A cell has the mean over the others.
        own: The user's own values.
    """
    figure, axes = new_figure(columns=2, width=9.0, height=3.8)
    for place, (column, label, factor) in zip(axes, MEASURES, strict=True):
        if len(names) == 1:
            _lines(place, rows, names[0], column, factor)
            place.axvline(own[names[0]], color="#222222", linestyle="--", linewidth=1, label="own value")
            place.set_ylabel(label)
            place.legend(frameon=False, fontsize=8)
        else:
            _heat(figure, place, rows, names[:2], column, factor)
            place.plot(*([own[name]] for name in names[:2]), "x", color="#d62728", markersize=9, label="own values")
            place.set_title(label, fontsize=10)
    return figure


def _lines(axes: Axes, rows: Rows, name: str, column: str, factor: float) -> None:
    shown = sorted((row for row in rows if row[column] is not None), key=lambda row: float(row[name]))
    x, y = ([row[key] for row in shown] for key in (name, column))
    axes.plot(x, np.multiply(y, factor), "o-", color=COLOURS[0], markersize=4)
    bounded = [row for row in shown if row[f"{column} from"] is not None]
    low, high = (np.multiply([row[f"{column} {end}"] for row in bounded], factor) for end in ("from", "to"))
    axes.fill_between([row[name] for row in bounded], low, high, color=COLOURS[0], alpha=0.15, linewidth=0)
    axes.set_xlabel(name)
    axes.grid(alpha=0.3)


def _heat(figure: Figure, axes: Axes, rows: Rows, names: Sequence[str], column: str, factor: float) -> None:
    """Draw a cell for each pair of values of a grid, or points where they are no grid; the text is the value."""
    of_pair: dict[tuple[float, float], list[float]] = {}
    for row in rows:
        if row[column] is not None:
            of_pair.setdefault((row[names[0]], row[names[1]]), []).append(row[column] * factor)
    points = {pair: fmean(values) for pair, values in of_pair.items()}
    x, y, values = [a for a, _ in points], [b for _, b in points], list(points.values())
    xs, ys = sorted(set(x)), sorted(set(y))
    if len(points) > 1 and len(xs) * len(ys) <= 2 * len(points):
        cells = np.array([[points.get((a, b), np.nan) for a in xs] for b in ys])
        drawn: Any = axes.pcolormesh(xs, ys, cells, shading="nearest", cmap="viridis")
    else:
        drawn = axes.scatter(x, y, c=values, cmap="viridis", s=60)
    for a, b, value in zip(x, y, values, strict=True):
        axes.annotate(
            f"{value:.3g}", (a, b), ha="center", va="bottom", fontsize=7, color="#ffffff", path_effects=_edge()
        )
    if column == "success" and len(set(values)) == 1:  # else the bar would reach beyond 100 %
        drawn.set_clim(0.0, factor)
    figure.colorbar(drawn, ax=axes)
    axes.set(xlabel=names[0], ylabel=names[1])


def _edge() -> list[Any]:
    """Return a dark edge around white text."""
    from matplotlib import patheffects

    return [patheffects.withStroke(linewidth=1.5, foreground="#000000")]
