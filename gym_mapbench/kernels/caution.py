"""The length of ways on which a metre counts more the nearer the walls are."""

from __future__ import annotations

import math

import numpy as np

from gym_mapbench.kernels.jit import kernel

DIAGONAL = math.sqrt(2.0)
STEP_ROW, STEP_COL = (0, -1, 0, 1, -1, -1, 1, 1), (-1, 0, 1, 0, -1, 1, 1, -1)


@kernel
def weighted_distance(costs, row, col):
    """Least cost ``(rows, cols)`` float64 of an 8-connected path from one cell; inf where there is none.

    A step costs its length, in cells, times the cost of the cell that it leads to. A diagonal step needs both cells
    beside it free.

    Args:
        costs: ``(rows, cols)`` float64 of every cell, at least 1; inf where it is blocked.
        row: Row of the cell from which the distances count; it is free whatever it costs.
        col: Its column.
    """
    rows, cols = costs.shape
    width = cols + 2
    framed = np.full((rows + 2, width), np.inf)  # a blocked frame makes bounds checks unnecessary
    framed[1:-1, 1:-1] = costs
    framed[row + 1, col + 1] = 1.0
    distance = np.full((rows + 2) * width, np.inf)
    distance[(row + 1) * width + col + 1] = 0.0
    spread_weighted(distance, framed.ravel(), width, (row + 1) * width + col + 1)
    return distance.reshape(rows + 2, width)[1:-1, 1:-1].copy()


@kernel
def spread_weighted(distance, costs, width, start):
    """Work off bucket after bucket: as every step costs at least 1, none shortens another cell of its own bucket.

    A cell that was listed again nearer is passed over in the later bucket.
    """
    highest = 1.0
    for cost in costs:
        if highest < cost < np.inf:
            highest = cost
    buckets = int(DIAGONAL * highest) + 2
    listed = np.empty((buckets, len(distance)), np.int32)
    counts = np.zeros(buckets, np.int64)
    listed[0, 0], counts[0] = start, 1
    whole = 0
    while counts.sum() > 0:
        bucket = whole % buckets
        for i in range(counts[bucket]):
            cell = listed[bucket, i]
            if distance[cell] < whole:
                continue
            for side in range(8):
                list_neighbour(distance, costs, width, cell, side, listed, counts)
        counts[bucket] = 0
        whole += 1


@kernel
def list_neighbour(distance, costs, width, cell, side, listed, counts):
    """Shorten the way to one neighbour of a cell, and list it in its bucket unless that has it already."""
    near = cell + STEP_ROW[side] * width + STEP_COL[side]
    length = distance[cell] + costs[near] * (1.0 if side < 4 else DIAGONAL)
    before = distance[near]
    if length >= before:
        return
    if side >= 4 and max(costs[cell + STEP_ROW[side] * width], costs[cell + STEP_COL[side]]) == np.inf:
        return
    distance[near] = length
    if before == np.inf or int(before) != int(length):
        later = int(length) % len(counts)
        listed[later, counts[later]] = near
        counts[later] += 1
