"""The length of ways on which a metre counts more the nearer the walls are."""

from __future__ import annotations

import math

import numpy as np

from gym_mapbench.kernels.jit import kernel

DIAGONAL = math.sqrt(2.0)


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
    for r in range(rows):
        for c in range(cols):
            framed[r + 1, c + 1] = costs[r, c]
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
    whole, left = 0, 1
    while left > 0:
        bucket = whole % buckets
        for i in range(counts[bucket]):
            cell = listed[bucket, i]
            if distance[cell] >= whole:
                left += list_neighbours(distance, costs, width, cell, listed, counts)
        left -= counts[bucket]
        counts[bucket] = 0
        whole += 1


@kernel
def list_neighbours(distance, costs, width, cell, listed, counts):
    """Shorten the ways to the neighbours of a cell; return how many were listed."""
    count = 0
    for row in (-width, width):
        count += list_neighbour(distance, costs, cell, cell + row, 1.0, listed, counts)
        for col in (-1, 1):
            if costs[cell + row] < np.inf and costs[cell + col] < np.inf:
                count += list_neighbour(distance, costs, cell, cell + row + col, DIAGONAL, listed, counts)
    for col in (-1, 1):
        count += list_neighbour(distance, costs, cell, cell + col, 1.0, listed, counts)
    return count


@kernel
def list_neighbour(distance, costs, cell, near, way, listed, counts):
    """Shorten the way to one neighbour of a cell; list it in its bucket, and return 1, unless that has it already."""
    length = distance[cell] + costs[near] * way
    before = distance[near]
    if length >= before:
        return 0
    distance[near] = length
    if before < np.inf and int(before) == int(length):
        return 0
    later = int(length) % len(counts)
    listed[later, counts[later]] = near
    counts[later] += 1
    return 1
