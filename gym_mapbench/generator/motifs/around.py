"""Around: the cells of a map as seen from one element of a route."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gym_mapbench.generator.motifs.routes import Point
from gym_mapbench.generator.shapes import Cells
from gym_mapbench.kernels.strips import strip

Distances = NDArray[np.float64]


class Around(NamedTuple):
    """The cells of the map as seen from one element.

    Args:
        east: ``(cols,)`` distance of each column's centre to the right of the element, m.
        north: ``(rows,)`` distance of each row's centre above the element, m.
        forward: ``(x, y)`` unit vector along the route.
        number: Number of the element in its section, from 0.
        resolution: Side of a cell, m.
        ahead: Distance along the route of the point that the cells are seen from, from the element, m.
        aside: Distance of this point to the left of the element, m.
    """

    east: Distances
    north: Distances
    forward: Point
    number: int
    resolution: float
    ahead: float = 0.0
    aside: float = 0.0

    @property
    def along(self) -> Distances:
        """``(rows, cols)`` distance of each cell's centre along the route, m."""
        x, y = self.forward
        along: Distances = self.east * x + self.north[:, None] * y - self.ahead
        return along

    @property
    def across(self) -> Distances:
        """``(rows, cols)`` distance of each cell's centre to the left, m."""
        x, y = self.forward
        across: Distances = self.east * -y + self.north[:, None] * x - self.aside
        return across

    def within_along(self, length: float) -> Cells:
        """Return the cells at most half a length before or behind, at least one cell thick."""
        x, y = self.forward
        return self._strip(x, y, self.ahead, length)

    def within_across(self, width: float) -> Cells:
        """Return the cells at most half a width to the left or right, at least one cell wide."""
        x, y = self.forward
        return self._strip(-y, x, self.aside, width)

    def moved(self, along: float, across: float) -> Around:
        """Return the cells as seen from a point beside the element, m."""
        return self._replace(ahead=self.ahead + along, aside=self.aside + across)

    def _strip(self, x: float, y: float, middle: float, width: float) -> Cells:
        cells: Cells = strip(self.east, self.north, x, y, middle, max(width, self.resolution))
        return cells
