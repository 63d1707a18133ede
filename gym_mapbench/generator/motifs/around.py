"""Around: the cells of a map as seen from one element of a route."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gym_mapbench.generator.shapes import Cells

Distances = NDArray[np.float64]


class Around(NamedTuple):
    """The cells of the map as seen from one element.

    Args:
        along: ``(rows, cols)`` distance of each cell's centre from the element along the route, m.
        across: ``(rows, cols)`` distance to the left of the element, m.
        number: Number of the element in its section, from 0.
        resolution: Side of a cell, m.
    """

    along: Distances
    across: Distances
    number: int
    resolution: float

    def within_along(self, length: float) -> Cells:
        """Return the cells at most half a length before or behind the element, at least one cell thick."""
        return _within(self.along, max(length, self.resolution))

    def within_across(self, width: float) -> Cells:
        """Return the cells at most half a width beside the element, at least one cell wide."""
        return _within(self.across, max(width, self.resolution))

    def moved(self, along: float, across: float) -> Around:
        """Return the cells as seen from a point beside the element, m."""
        return self._replace(along=self.along - along, across=self.across - across)


def _within(distances: Distances, width: float) -> Cells:
    return (distances >= -width / 2) & (distances < width / 2)
