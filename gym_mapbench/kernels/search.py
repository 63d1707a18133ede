"""What best-first searches on a grid share: an open list that can move cells up, the frame, the way back.

Cells are flat indices of a grid in a one-cell frame, ``cell = row * width + col``.
"""

from __future__ import annotations

import numpy as np

from gym_mapbench.kernels.jit import kernel

NOT_LISTED = -1
STEP_ROW, STEP_COL = (0, 0, -1, 1, -1, -1, 1, 1), (-1, 1, 0, 0, -1, 1, -1, 1)


@kernel
def framed_costs(costs, cost_of):
    """Look every cell up in ``cost_of`` ``(256,)``; ``(cells,)`` float64 in a frame of inf."""
    rows, cols = costs.shape
    width = cols + 2
    framed = np.full((rows + 2) * width, np.inf)
    for row in range(rows):
        for col in range(cols):
            framed[(row + 1) * width + col + 1] = cost_of[costs[row, col]]
    return framed


@kernel
def list_cell(heap, place, key, count, cell):
    """Put a cell on the open list, or move it up after its key fell; return the list's length.

    Args:
        heap: ``(cells,)`` int32 binary heap, least key first.
        place: ``(cells,)`` int32 where a cell is in ``heap``, or NOT_LISTED.
        key: ``(cells,)`` float64.
        count: Length of the list.
        cell: What to put there.
    """
    at = place[cell]
    if at == NOT_LISTED:
        at = count
        count += 1
    while at > 0 and key[cell] < key[heap[(at - 1) // 2]]:
        heap[at] = heap[(at - 1) // 2]
        place[heap[at]] = at
        at = (at - 1) // 2
    heap[at] = cell
    place[cell] = at
    return count


@kernel
def take_first(heap, place, key, count):
    """Take the cell of least key off the open list of ``count`` cells, which is one shorter afterwards."""
    first, moved = heap[0], heap[count - 1]
    at, child = 0, 1
    while child < count - 1:
        if child + 1 < count - 1 and key[heap[child + 1]] < key[heap[child]]:
            child += 1
        if key[moved] <= key[heap[child]]:
            break
        heap[at] = heap[child]
        place[heap[at]] = at
        at, child = child, 2 * child + 1
    heap[at] = moved
    place[moved] = at
    place[first] = NOT_LISTED
    return first


@kernel
def trace_back(parent, width, end):
    """Rows and columns ``(n, 2)`` int64 on the unframed grid, from the cell that is its own parent to ``end``."""
    count, cell = 1, end
    while parent[cell] != cell:
        cell = parent[cell]
        count += 1
    trail = np.empty((count, 2), np.int64)
    cell = end
    for i in range(count - 1, -1, -1):
        trail[i, 0], trail[i, 1] = cell // width - 1, cell % width - 1
        cell = parent[cell]
    return trail
