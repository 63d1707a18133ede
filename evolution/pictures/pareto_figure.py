"""The figure of a Pareto front: all evaluated sets, the front in the search and on held-out seeds, and hypervolume."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from evolution.files import Row
from evolution.pictures.style import COLOURS, count_along_x, new_figure
from evolution.runs import HELD_OUT, feasible, hypervolumes, objectives_in

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def pareto_figure(front: Sequence[Row], individuals: Sequence[Row]) -> Figure:
    """Draw the first two objectives of a search's sets, and the hypervolume over the evaluations.

    Args:
        front: Rows of ``front.csv``.
        individuals: Rows of ``individuals.csv``.
    """
    names = objectives_in(front)
    figure, (sets, volume) = new_figure(columns=2, width=10.5)
    _draw_sets(sets, front, individuals, names)
    volumes = hypervolumes(individuals, names)
    volume.step(list(volumes), list(volumes.values()), where="post", color=COLOURS[0])
    count_along_x(volume, "evaluations")
    volume.set(ylabel="hypervolume of all sets so far (1: the whole box)", ylim=(0.0, 1.0))
    volume.grid(alpha=0.3)
    return figure


def _draw_sets(axes: Axes, front: Sequence[Row], individuals: Sequence[Row], names: Sequence[str]) -> None:
    """Draw the solved sets, the front, and from each point of the front a line to its values on held-out seeds."""
    first, second = names[:2]
    solved = feasible(individuals)
    axes.plot(
        [row[first] for row in solved], [row[second] for row in solved], ".", color="#bbbbbb", label="solved sets"
    )
    line = [row[first] for row in front], [row[second] for row in front]
    axes.plot(*line, "o-", color=COLOURS[0], label="Pareto front in the search")
    again = [row for row in front if row["remains"] is not None]
    for row in again:
        ends = [row[first], row[HELD_OUT + first]], [row[second], row[HELD_OUT + second]]
        axes.plot(*ends, ":", color="#888888", linewidth=1)
    for remains, marker, label in ((1, "s", "on held-out seeds: remains"), (0, "x", "on held-out seeds: dominated")):
        shown = [row for row in again if row["remains"] == remains]
        points = [row[HELD_OUT + first] for row in shown], [row[HELD_OUT + second] for row in shown]
        if shown:
            axes.plot(*points, marker, color=COLOURS[1], label=label)
    axes.set(xlabel=f"{first} (lower is better)", ylabel=f"{second} (lower is better)")
    axes.grid(alpha=0.3)
    axes.legend(frameon=False, fontsize=8)
