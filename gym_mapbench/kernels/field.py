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
    framed = np.full((rows + 2, cols + 2), np.inf)  # a frame makes bounds checks unnecessary
    framed[1:-1, 1:-1] = distance
    for row in range(rows):
        fill_row(distance[row], framed[row], framed[row + 1], -1)
    for row in range(rows - 1, -1, -1):
        fill_row(distance[row], framed[row + 2], framed[row + 1], 1)
    distance[:] = framed[1:-1, 1:-1]


@kernel
def fill_row(reached, beside, here, side):
    """Shorten the unreached cells of a row over the next cell in it, and the three in the row before.

    Args:
        reached: ``(cols,)`` inf where a cell is unreached.
        beside: ``(cols + 2,)`` the row before, framed.
        here: ``(cols + 2,)`` the row, framed, in and out.
        side: Where the next cell is: -1 to the left, 1 to the right.
    """
    cols = len(reached)
    for i in range(cols):
        col = i if side < 0 else cols - 1 - i
        if reached[col] == np.inf:
            diagonal = min(beside[col], beside[col + 2]) + DIAGONAL
            straight = min(here[col + 1 + side], beside[col + 1]) + 1.0
            here[col + 1] = min(here[col + 1], straight, diagonal)


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
