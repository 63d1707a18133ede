"""Strips: the cells of a map between two parallel lines."""

from __future__ import annotations

import numpy as np

from gym_mapbench.kernels.jit import kernel


@kernel
def strip(east, north, x, y, middle, width):
    """Return which cells lie in a strip, ``(rows, cols)`` bool; its lower edge belongs to it, its upper one does not.

    Args:
        east: ``(cols,)`` x of the columns' centres, m.
        north: ``(rows,)`` y of the rows' centres, m.
        x: x of the unit vector at right angles to the strip.
        y: y of this vector.
        middle: Distance of the middle of the strip from the origin along this vector, m.
        width: Width of the strip, m.
    """
    cells = np.empty((len(north), len(east)), dtype=np.bool_)
    half = width / 2
    for row in range(len(north)):
        upward = north[row] * y
        for col in range(len(east)):
            distance = east[col] * x + upward - middle
            cells[row, col] = (distance >= -half) & (distance < half)
    return cells
