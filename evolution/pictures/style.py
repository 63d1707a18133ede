"""The look of all figures: colours, markers, dashes, and how a figure is made and saved."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Okabe and Ito's palette, which colour-blind readers can tell apart, without its yellow, which is too pale in print.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
MARKERS = ("o", "s", "D", "P", "X")
DASHES: tuple[Any, ...] = ("-", (0, (4, 2.5)), (0, (1.2, 1.6)))
WIDTHS = (4.2, 2.8, 1.8)
"""Lines of trajectories: a later one is thinner and has gaps, so that one that lies below it can be seen."""
RING: dict[str, Any] = {
    "linestyle": "none",
    "marker": "o",
    "markersize": 8,
    "markerfacecolor": "none",
    "markeredgecolor": "#222222",
}
"""Marks an outlier."""
FORMATS = ("png", "svg")
HATCHES = ("", "///", "xxx", "...", "|||")
"""Fillings of bars; like :data:`MARKERS` for points, they tell names of one colour apart if there are many names."""


def colour_of(names: Sequence[str], name: str) -> str:
    """Colour of one name among ``names``: by position, so that it is the same in every figure."""
    return COLOURS[list(names).index(name) % len(COLOURS)]


def round_of(names: Sequence[str], name: str) -> int:
    """Return how often the palette was used up before a name, as an index of :data:`MARKERS` and :data:`HATCHES`."""
    return list(names).index(name) // len(COLOURS) % len(MARKERS)


def new_figure(
    columns: int = 1,
    width: float = 6.4,
    height: float = 4.2,
    sharey: bool = False,
    rows: int = 1,
    heights: Sequence[float] | None = None,
) -> tuple[Figure, NDArray[Any]]:
    """Make a figure of ``rows`` times ``columns`` axes without touching pyplot's global state.

    Args:
        columns: Number of axes in a row.
        width: Width of the figure, inches.
        height: Height of the figure, inches.
        sharey: Whether all axes share the y axis.
        rows: Number of rows.
        heights: Relative heights of the rows; equal if None.
    """
    from evolution.pictures.once_rendered import OnceRenderedFigure

    figure = OnceRenderedFigure(figsize=(width, height), layout="constrained")
    return figure, np.atleast_1d(figure.subplots(rows, columns, sharey=sharey, height_ratios=heights))


def count_along_x(axes: Axes, what: str) -> None:
    """Label an x axis that counts something: its ticks are whole numbers."""
    axes.set_xlabel(what)
    axes.locator_params(axis="x", integer=True)


def save_figure(figure: Figure, stem: Path, formats: Sequence[str] = FORMATS) -> list[Path]:
    """Write a figure in some formats, without dates or random ids, so that equal figures are equal bytes."""
    import matplotlib as mpl

    stem.parent.mkdir(parents=True, exist_ok=True)
    written = []
    with mpl.rc_context({"svg.hashsalt": stem.name, "savefig.dpi": 150}):
        for extension in formats:
            path = stem.with_suffix(f".{extension}")
            figure.savefig(path, bbox_inches="tight", metadata={"Date": None} if extension == "svg" else None)
            written.append(path)
    return written
