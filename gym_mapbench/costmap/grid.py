"""Costmap: Nav2's cost values on a grid.

Source: nav2_costmap_2d (Humble). ``costs[row, col]`` has row 0 at the bottom, as
:class:`~gym_mapbench.world.gridmap.GridMap` and Nav2's own ``my``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FREE_SPACE = 0
INSCRIBED_INFLATED_OBSTACLE = 253
LETHAL_OBSTACLE = 254
NO_INFORMATION = 255


@dataclass
class Costmap:
    """Cost values of one moment.

    Args:
        costs: ``(rows, cols)`` uint8, C-contiguous; row 0 at the bottom.
        resolution: Side of a cell, m.
        origin_x: World x of the lower-left corner of cell (0, 0), m.
        origin_y: World y of the same corner, m.
        track_unknown_space: Whether 255 means "unknown" rather than an obstacle.
    """

    costs: NDArray[np.uint8]
    resolution: float
    origin_x: float
    origin_y: float
    track_unknown_space: bool = False

    @property
    def grid(self) -> tuple[NDArray[np.uint8], float, float, float]:
        """Costs, resolution and origin, as kernels take them."""
        return self.costs, self.resolution, self.origin_x, self.origin_y

    def world_to_map(self, x: float, y: float) -> tuple[int, int] | None:
        """Return ``(row, col)`` of the cell that holds the point, None off the map (``worldToMap``)."""
        if x < self.origin_x or y < self.origin_y:
            return None
        col = int((x - self.origin_x) / self.resolution)
        row = int((y - self.origin_y) / self.resolution)
        rows, cols = self.costs.shape
        return (row, col) if row < rows and col < cols else None
