"""A grid of cells on a page: each filled cell shows its map, and a click shows the replay."""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from PIL import Image

from gym_mapbench.world.gridmap import GridMap

THUMBNAIL = 56
"""Pixels along a side of the picture of a map."""


@dataclass(frozen=True)
class FilledCell:
    """A cell with a map.

    Args:
        group: Group of the replay that a click shows.
        title: Shown when the pointer is over the cell.
        grid: The map.
    """

    group: str
    title: str
    grid: GridMap

    @property
    def uri(self) -> str:
        """A small picture of the map as a data URI; occupied cells are opaque, free cells transparent."""
        grey = np.where(self.grid.occupancy[::-1], 255, 0).astype(np.uint8)
        opacity = Image.fromarray(grey).resize((THUMBNAIL, THUMBNAIL), Image.Resampling.BOX).quantize(8)
        picture = Image.new("LA", opacity.size, 128)
        picture.putalpha(opacity.convert("L"))
        content = io.BytesIO()
        picture.save(content, "png", optimize=True)
        return f"data:image/png;base64,{base64.b64encode(content.getvalue()).decode()}"


@dataclass(frozen=True)
class CellGrid:
    """Cells by two measures; with one measure there is one row.

    Args:
        title: Heading.
        text: One paragraph below it.
        across: The measure along a row, and its value in each column.
        up: The measure along a column, and its value in each row, from the bottom; no values if there is one row.
        rows: The rows from the bottom; None where a cell is empty.
    """

    title: str
    text: str
    across: tuple[str, Sequence[str]]
    up: tuple[str, Sequence[str]]
    rows: Sequence[Sequence[FilledCell | None]]

    @property
    def name(self) -> str:
        """The name of the grid for a screen reader: the title and the measures."""
        return f"{self.title}: {' and '.join(filter(None, [self.across[0], self.up[0]]))}"

    @property
    def lines(self) -> list[tuple[str, Sequence[FilledCell | None]]]:
        """The rows from the top, each with its value."""
        values = self.up[1] or [""] * len(self.rows)
        return list(zip(values, self.rows, strict=True))[::-1]
