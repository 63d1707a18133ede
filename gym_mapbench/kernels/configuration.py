"""Where a footprint fits on a grid, and which of these configurations connect."""

from __future__ import annotations

import numpy as np

from gym_mapbench.kernels.jit import kernel

# Heading k is k * 45 degrees; driving forwards is this step.
HEADING_ROW, HEADING_COL = (0, 1, 1, 1, 0, -1, -1, -1), (1, 1, 0, -1, -1, -1, 0, 1)


@kernel
def stamp_footprint(occupied, offsets, blocked):
    """Mark the cells on which a footprint may not be centred.

    Args:
        occupied: ``(rows, cols)`` bool.
        offsets: ``(n, 2)`` int64 row and col of the cells the footprint touches, from the one it is centred on.
        blocked: ``(rows, cols)`` bool out; True where one of these cells is occupied. Off the map counts as free.
    """
    rows, cols = occupied.shape
    blocked[:] = occupied
    for row in range(rows):
        for col in range(cols):
            if not occupied[row, col] or _surrounded(occupied, row, col):
                continue
            for i in range(len(offsets)):
                r, c = row - offsets[i, 0], col - offsets[i, 1]
                if 0 <= r < rows and 0 <= c < cols:
                    blocked[r, c] = True


@kernel
def _surrounded(occupied, row, col):
    """Whether all eight neighbours are occupied: a footprint that touches this cell then touches one of them."""
    rows, cols = occupied.shape
    if row == 0 or col == 0 or row == rows - 1 or col == cols - 1:
        return False
    return bool(occupied[row - 1 : row + 2, col - 1 : col + 2].all())


@kernel
def connects(free, row, col, goal_row, goal_col):
    """Whether a robot that drives straight and turns on the spot gets from one cell to another.

    Args:
        free: ``(16, rows, cols)`` bool: whether the footprint fits, for headings every 22.5 degrees. The robot
            drives along the even ones; the odd ones only have to be free for turning through them.
        row: Start cell, where it may have any heading.
        col: Start cell.
        goal_row: Goal cell, any heading.
        goal_col: Goal cell.
    """
    _, rows, cols = free.shape
    seen = np.zeros((8, rows, cols), np.bool_)
    waiting = np.empty((8 * rows * cols, 3), np.int32)
    count = 0
    for heading in range(8):
        count = _visit(free, seen, waiting, count, heading, row, col)
    while count > 0:
        count -= 1
        heading, r, c = waiting[count]
        if r == goal_row and c == goal_col:
            return True
        for sign in (-1, 1):
            if free[(2 * heading + sign + 16) & 15, r, c]:
                count = _visit(free, seen, waiting, count, (heading + sign + 8) & 7, r, c)
            step_row, step_col = sign * HEADING_ROW[heading], sign * HEADING_COL[heading]
            # A diagonal step sweeps the two cells beside it.
            if _fits(free, heading, r + step_row, c) and _fits(free, heading, r, c + step_col):
                count = _visit(free, seen, waiting, count, heading, r + step_row, c + step_col)
    return False


@kernel
def _fits(free, heading, row, col):
    """Whether a configuration is on the map and free."""
    _, rows, cols = free.shape
    return 0 <= row < rows and 0 <= col < cols and free[2 * heading, row, col]


@kernel
def _visit(free, seen, waiting, count, heading, row, col):
    """Put a configuration that fits and is new on the stack; return how many wait there."""
    if not _fits(free, heading, row, col) or seen[heading, row, col]:
        return count
    seen[heading, row, col] = True
    waiting[count, 0], waiting[count, 1], waiting[count, 2] = heading, row, col
    return count + 1
