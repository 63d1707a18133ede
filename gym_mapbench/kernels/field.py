"""A field of values at cell centres: filled where it has none, and read between the centres."""

from __future__ import annotations

import math

import numpy as np

from gym_mapbench.kernels.jit import kernel

DIAGONAL = math.sqrt(2.0)


@kernel
def fill_unreached(distance):
    """Give every cell of infinite distance that of its surroundings plus the way there, in place.

    Two sweeps of the 8-neighbour chamfer distance; finite cells keep their values.

    Args:
        distance: ``(rows, cols)`` float64, cells.
    """
    rows, cols = distance.shape
    unreached = distance == np.inf
    over = np.full(cols, np.inf)
    for row in range(rows):
        if row > 0:
            step_over(distance[row - 1], over)
        fill_row(unreached[row], over, distance[row])
    over[:] = np.inf
    for row in range(rows - 1, -1, -1):
        if row < rows - 1:
            step_over(distance[row + 1], over)
        fill_row(unreached[row, ::-1], over[::-1], distance[row, ::-1])


@kernel
def step_over(beside, over):
    """Write the shortest ways ``(cols,)`` into a row over the three nearest cells of the row beside it."""
    last = len(beside) - 1
    for col in range(len(beside)):
        over[col] = beside[col] + 1.0
    for col in range(last):
        over[col] = min(over[col], beside[col + 1] + DIAGONAL)
    for col in range(last):
        over[col + 1] = min(over[col + 1], beside[col] + DIAGONAL)


@kernel
def fill_row(unreached, over, distance):
    """Shorten the ways ``(cols,)`` to the unreached cells of a row, from the row beside it or the cell before."""
    before = np.inf
    for col in range(len(distance)):
        if unreached[col]:
            distance[col] = min(distance[col], over[col], before + 1.0)
        before = distance[col]


@kernel
def interpolate(field, line, column):
    """Value between the four cell centres around a point, linear along both axes; constant beyond the outer ones.

    Args:
        field: ``(rows, cols)`` values at the cell centres.
        line: Row of the point; whole numbers are cell centres.
        column: Column of the point.
    """
    rows, cols = field.shape
    line = min(max(line, 0.0), rows - 1.0)
    column = min(max(column, 0.0), cols - 1.0)
    row, col = min(int(line), max(rows - 2, 0)), min(int(column), max(cols - 2, 0))
    up, right = min(row + 1, rows - 1), min(col + 1, cols - 1)
    t, s = line - row, column - col
    below = field[row, col] * (1.0 - s) + field[row, right] * s
    above = field[up, col] * (1.0 - s) + field[up, right] * s
    return below * (1.0 - t) + above * t


@kernel
def distance_at(field, resolution, origin_x, origin_y, x, y):
    """Value at a world position of a field in cells, in m.

    Args:
        field: ``(rows, cols)`` values at the cell centres, cells.
        resolution: Side of a cell, m.
        origin_x: World x of the map's lower-left corner, m.
        origin_y: World y of the same corner, m.
        x: Position, m.
        y: Position, m.
    """
    column = (x - origin_x) / resolution - 0.5
    line = (y - origin_y) / resolution - 0.5
    return interpolate(field, line, column) * resolution
