"""Distances on a grid: straight to the nearest occupied cell, and around obstacles from one cell.

Sources: Felzenszwalb and Huttenlocher, Distance Transforms of Sampled Functions (2012), for the first;
for the second Dial, Algorithm 360 (1969): with no step shorter than 1, cells whose distances have the same whole
part cannot shorten each other, so they may be worked off in any order.
"""

from __future__ import annotations

import math

import numpy as np

from gym_mapbench.kernels.jit import kernel

DIAGONAL = math.sqrt(2.0)
BUCKETS = 3  # a step of 1 or sqrt(2) reaches the next bucket or the one after
STEP_ROW, STEP_COL = (0, -1, 0, 1, -1, -1, 1, 1), (-1, 0, 1, 0, -1, 1, 1, -1)
BLOCKED = -1.0


@kernel
def squared_distance(occupied):
    """Exact squared distance ``(rows, cols)`` float64, cells^2, to the nearest occupied cell's centre; inf if none."""
    rows, cols = occupied.shape
    squared = _squared_along_columns(occupied)
    vertex, border, parabola = np.empty(cols, np.int64), np.empty(cols + 1), np.empty(cols)
    for row in range(rows):
        for col in range(cols):
            parabola[col] = squared[row, col]
        count = _lower_envelope(parabola, vertex, border)
        if count > 0:
            _read_envelope(parabola, vertex, border, squared[row])
    return squared


@kernel
def _squared_along_columns(occupied):
    """Squared distance ``(rows, cols)`` float64 to the nearest occupied cell of the same column."""
    rows, cols = occupied.shape
    distance = np.full((rows, cols), np.inf)
    for row in range(rows):
        for col in range(cols):
            if occupied[row, col]:
                distance[row, col] = 0.0
            elif row > 0:
                distance[row, col] = distance[row - 1, col] + 1.0
    for row in range(rows - 2, -1, -1):
        for col in range(cols):
            distance[row, col] = min(distance[row, col], distance[row + 1, col] + 1.0)
    return distance * distance


@kernel
def _lower_envelope(height, vertex, border):
    """Find which parabolas of a row lie lowest, and from where on; return how many do."""
    count = 0
    for col in range(len(height)):
        if height[col] == np.inf:
            continue
        start = -np.inf
        while count > 0:
            before = vertex[count - 1]
            start = (height[col] - height[before] + col * col - before * before) / (2.0 * (col - before))
            if start > border[count - 1]:
                break
            count -= 1
        if count == 0:
            start = -np.inf
        vertex[count], border[count] = col, start
        count += 1
    border[count] = np.inf
    return count


@kernel
def _read_envelope(height, vertex, border, squared):
    """Write the lowest parabola's value of every column."""
    k = 0
    for col in range(len(squared)):
        while border[k + 1] < col:
            k += 1
        squared[col] = height[vertex[k]] + (col - vertex[k]) * (col - vertex[k])


@kernel
def geodesic_distance(blocked, row, col):
    """Length ``(rows, cols)`` float64, cells, of the shortest 8-connected path from one cell; inf where there is none.

    A diagonal step needs both cells beside it free. From a blocked cell nothing is reached but the cell itself.
    """
    rows, cols = blocked.shape
    width = cols + 2
    distance = np.full((rows + 2) * width, BLOCKED)  # a blocked frame makes bounds checks unnecessary
    for r in range(rows):
        for c in range(cols):
            if not blocked[r, c]:
                distance[(r + 1) * width + c + 1] = np.inf
    start = (row + 1) * width + col + 1
    distance[start] = 0.0
    if not blocked[row, col]:
        _spread(distance, width, start)
    reached = np.empty((rows, cols))
    for r in range(rows):
        for c in range(cols):
            length = distance[(r + 1) * width + c + 1]
            reached[r, c] = np.inf if length == BLOCKED else length
    return reached


@kernel
def _spread(distance, width, start):
    """Work off bucket after bucket; a cell that was listed again nearer is passed over in the later bucket."""
    listed = np.empty((BUCKETS, len(distance)), np.int32)
    counts = np.zeros(BUCKETS, np.int64)
    listed[0, 0], counts[0] = start, 1
    whole = 0
    while counts.sum() > 0:
        bucket = whole % BUCKETS
        for i in range(counts[bucket]):
            cell = listed[bucket, i]
            here = distance[cell]
            if here < whole:
                continue
            for side in range(8):
                near = cell + STEP_ROW[side] * width + STEP_COL[side]
                length = here + (1.0 if side < 4 else DIAGONAL)
                before = distance[near]
                if length >= before or (side >= 4 and _cuts_corner(distance, cell, width, side)):
                    continue
                distance[near] = length
                if before == np.inf or int(before) != int(length):
                    later = int(length) % BUCKETS
                    listed[later, counts[later]] = near
                    counts[later] += 1
        counts[bucket] = 0
        whole += 1


@kernel
def _cuts_corner(distance, cell, width, side):
    """Whether one of the cells beside a diagonal step is blocked."""
    return distance[cell + STEP_ROW[side] * width] == BLOCKED or distance[cell + STEP_COL[side]] == BLOCKED
