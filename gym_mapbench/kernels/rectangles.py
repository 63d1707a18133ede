"""Cells merged into few rectangles: what walls are built from, in the simulation and in exported meshes."""

from __future__ import annotations

import numpy as np

from gym_mapbench.kernels.jit import kernel


@kernel
def merge_rectangles(occupancy):
    """Cover the occupied cells with rectangles that do not overlap, greedily.

    Every rectangle starts at the first cell not covered yet (row by row) and takes the larger of
    the widest-first and the tallest-first rectangle of cells not covered yet.

    Args:
        occupancy: ``(rows, cols)`` bool.

    Returns:
        ``(n, 4)`` int64: row and col of the lower-left cell, height and width in cells.
    """
    rectangles = np.empty((256, 4), dtype=np.int64)
    n = cover(occupancy.copy(), rectangles)
    if n > len(rectangles):
        rectangles = np.empty((n, 4), dtype=np.int64)
        cover(occupancy.copy(), rectangles)
    return rectangles[:n].copy()


@kernel
def cover(cells, rectangles):
    """Take rectangles from ``cells`` until none is left; write as many as fit, return how many there are."""
    rows, cols = cells.shape
    n = 0
    for row in range(rows):
        for col in range(cols):
            if not cells[row, col]:
                continue
            height, width = largest_from(cells, row, col)
            take(cells, row, col, height, width)
            if n < len(rectangles):
                rectangles[n, 0], rectangles[n, 1] = row, col
                rectangles[n, 2], rectangles[n, 3] = height, width
            n += 1
    return n


@kernel
def largest_from(cells, row, col):
    """Height and width of the larger of two rectangles of true cells whose lower-left cell is ``(row, col)``."""
    width = run_right(cells, row, col, cells.shape[1] - col)
    height = 1
    while row + height < cells.shape[0] and run_right(cells, row + height, col, width) == width:
        height += 1
    tall = 1
    while row + tall < cells.shape[0] and cells[row + tall, col]:
        tall += 1
    narrow = width
    for offset in range(1, tall):
        narrow = run_right(cells, row + offset, col, narrow)
    if tall * narrow > height * width:
        return tall, narrow
    return height, width


@kernel
def run_right(cells, row, col, longest):
    """Number of true cells from ``(row, col)`` to the right, at most ``longest``."""
    length = 0
    while length < longest and cells[row, col + length]:
        length += 1
    return length


@kernel
def take(cells, row, col, height, width):
    """Set the cells of a rectangle to False."""
    for r in range(row, row + height):
        for c in range(col, col + width):
            cells[r, c] = False
