"""Measures along a path on a grid of blocked cells.

Source: Perille et al., "Benchmarking Metric Ground Navigation", 2020: closest obstacle, average
visibility, dispersion and characteristic dimension, in cells.
"""

from __future__ import annotations

import numpy as np

from gym_mapbench.kernels.distance import BLOCKED, DIAGONAL, nearest_occupied
from gym_mapbench.kernels.jit import kernel

STEP_ROW, STEP_COL = (0, -1, 0, 1, -1, -1, 1, 1), (-1, 0, 1, 0, -1, 1, 1, -1)
# Clockwise, every 22.5 degrees; those between axis and diagonal are knight's moves.
FAN_ROW = (0, 1, 1, 2, 1, 2, 1, 1, 0, -1, -1, -2, -1, -2, -1, -1)
FAN_COL = (1, 2, 1, 1, 0, -1, -1, -2, -1, -2, -1, -1, 0, 1, 1, 2)


@kernel
def descend(distance, row, col):
    """Walk down a geodesic distance field to its source.

    Args:
        distance: ``(rows, cols)`` from :func:`~gym_mapbench.kernels.distance.framed_distance`.
        row: Where to begin; its distance must be finite.
        col: Where to begin.

    Returns:
        ``(n, 2)`` int64 row and col of the cells, both ends included.
    """
    rows, cols = distance.shape
    path = np.empty((rows * cols, 2), np.int64)
    path[0, 0], path[0, 1] = row, col
    count = 1
    while distance[row, col] > 0.0:
        best, step = np.inf, 0
        for side in range(8):
            length = _length_through(distance, row, col, side)
            if length < best:
                best, step = length, side
        row, col = row + STEP_ROW[step], col + STEP_COL[step]
        path[count, 0], path[count, 1] = row, col
        count += 1
    return path[:count].copy()


@kernel
def _length_through(distance, row, col, side):
    """Length of the way over one neighbour; inf where that step is not allowed."""
    r, c = row + STEP_ROW[side], col + STEP_COL[side]
    if distance[r, c] == BLOCKED:
        return np.inf
    if side < 4:
        return distance[r, c] + 1.0
    if distance[row, c] == BLOCKED or distance[r, col] == BLOCKED:
        return np.inf
    return distance[r, c] + DIAGONAL


@kernel
def measure_path(blocked, along_columns, path, radius):
    """Average the four measures over a path.

    Args:
        blocked: ``(rows, cols)`` bool in a frame of blocked cells.
        along_columns: ``(rows, cols)`` from :func:`~gym_mapbench.kernels.distance.distance_along_columns`.
        path: ``(n, 2)`` int64 free cells.
        radius: Radius of the dispersion, cells.

    Returns:
        ``(4,)`` closest obstacle, average visibility, dispersion (a count), characteristic dimension; cells.
    """
    totals = np.zeros(4)
    for i in range(len(path)):
        row, col = path[i]
        totals[0] += nearest_occupied(along_columns, row, col)
        totals[1] += visibility(blocked, row, col)
        totals[2] += dispersion(blocked, row, col, radius)
        totals[3] += characteristic_dimension(blocked, row, col)
    return totals / len(path)


@kernel
def free_steps(blocked, row, col, step_row, step_col):
    """How many steps in one direction stay on free cells."""
    steps = 0
    while not blocked[row + step_row, col + step_col]:
        row, col = row + step_row, col + step_col
        steps += 1
    return steps


@kernel
def visibility(blocked, row, col):
    """Mean distance to the first blocked cell in the eight directions."""
    total = 0.0
    for side in range(8):
        steps = free_steps(blocked, row, col, STEP_ROW[side], STEP_COL[side]) + 1
        total += steps * (1.0 if side < 4 else DIAGONAL)
    return total / 8.0


@kernel
def characteristic_dimension(blocked, row, col):
    """Free length along the shortest of the four axes through a cell, the cell itself not counted."""
    shortest = np.inf
    for side in (0, 1, 4, 5):
        step_row, step_col = STEP_ROW[side], STEP_COL[side]
        steps = free_steps(blocked, row, col, step_row, step_col) + free_steps(blocked, row, col, -step_row, -step_col)
        shortest = min(shortest, steps * (1.0 if side < 4 else DIAGONAL))
    return shortest


@kernel
def dispersion(blocked, row, col, radius):
    """How often open and closed alternate, once around, among 16 directions within ``radius`` cells."""
    changes = 0
    before = sees_wall(blocked, row, col, FAN_ROW[15], FAN_COL[15], radius)
    for side in range(16):
        wall = sees_wall(blocked, row, col, FAN_ROW[side], FAN_COL[side], radius)
        changes += wall != before
        before = wall
    return changes


@kernel
def sees_wall(blocked, row, col, step_row, step_col, radius):
    """Whether a blocked cell lies within ``radius`` in one direction; a knight's move counts as two cells."""
    rows, cols = blocked.shape
    length = max(abs(step_row), abs(step_col))
    gone = 0
    while gone < radius:
        row, col = row + step_row, col + step_col
        if not (0 <= row < rows and 0 <= col < cols):
            return False
        if blocked[row, col]:
            return True
        gone += length
    return False
