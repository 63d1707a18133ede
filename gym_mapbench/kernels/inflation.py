"""How far every cell lies from its obstacle, as Nav2's inflation layer finds out, and the costs that follow.

Source: nav2_costmap_2d/plugins/inflation_layer.cpp. Nav2 spreads from the obstacles cell by cell, one
first-in-first-out list per distance; a cell keeps the obstacle it hears of first, which is now and then not
its nearest. Only offers nearer than all before are listed: the others would come too late.
"""

from __future__ import annotations

import numpy as np

from gym_mapbench.kernels.distance import squared_distance
from gym_mapbench.kernels.jit import inlined, kernel

OUT_OF_REACH = 2**31 - 1
INSCRIBED = 253
LETHAL = 254
UNKNOWN = 255
END = np.uint32(2**32 - 1)


@kernel
def inflate(costs, reach, cost_of, exact, inflate_unknown, inflate_around_unknown, row0, col0, row1, col1):
    """Write inflated costs over ``costs`` ``(rows, cols)`` uint8, in place, in rows ``row0:row1`` and ``col0:col1``.

    Obstacles up to ``reach`` outside these rows and columns count, none beyond.

    Args:
        costs: Cost values with obstacles of 254.
        reach: Largest distance, cells.
        cost_of: ``(reach**2 + 1,)`` uint8, cost at a squared distance in cells.
        exact: Whether the nearest obstacle counts (Lyrical), or the obstacle that the brushfire finds.
        inflate_unknown: Whether any cost replaces 255, not only 253 and more.
        inflate_around_unknown: Whether cells of 255 count as obstacles.
        row0: First row to write.
        col0: First column.
        row1: Row after the last one.
        col1: Column after the last one.
    """
    # Obstacles count up to one reach outside the cells, and their waves spread one reach beyond that.
    first_row, first_col = max(0, row0 - 2 * reach), max(0, col0 - 2 * reach)
    around = costs[first_row : row1 + 2 * reach, first_col : col1 + 2 * reach]
    row0, col0, row1, col1 = row0 - first_row, col0 - first_col, row1 - first_row, col1 - first_col
    rows, cols = around.shape
    sources = np.zeros((rows, cols), np.bool_)
    for row in range(max(0, row0 - reach), min(rows, row1 + reach)):
        for col in range(max(0, col0 - reach), min(cols, col1 + reach)):
            cost = around[row, col]
            sources[row, col] = cost == LETHAL or (inflate_around_unknown and cost == UNKNOWN)
    squared = whole_squared_distance(sources) if exact else brushfire(sources, reach)
    write_inflated(around, squared, cost_of, inflate_unknown, row0, col0, row1, col1)


@kernel
def widen(box, last, radius):
    """Widen a box by that of the last update, which becomes this one, and by a radius; all in m."""
    for axis in range(4):
        news = box[axis]
        box[axis] = min(last[axis], news) - radius if axis < 2 else max(last[axis], news) + radius
        last[axis] = news


@kernel
def write_inflated(costs, squared, cost_of, inflate_unknown, row0, col0, row1, col1):
    """Apply Nav2's write rule to these cells, where within reach; ``squared`` ``(rows, cols)`` int32, cells^2."""
    least = 1 if inflate_unknown else INSCRIBED
    for row in range(row0, row1):
        for col in range(col0, col1):
            if squared[row, col] < len(cost_of):
                cost = cost_of[squared[row, col]]
                old = costs[row, col]
                if cost > old or (old == UNKNOWN and cost >= least):
                    costs[row, col] = cost


@kernel
def whole_squared_distance(sources):
    """Squared distance ``(rows, cols)`` int32, cells^2, to the nearest source; OUT_OF_REACH without a source."""
    rows, cols = sources.shape
    exact, whole = squared_distance(sources), np.empty((rows, cols), np.int32)
    for row in range(rows):
        for col in range(cols):
            whole[row, col] = min(exact[row, col], OUT_OF_REACH)
    return whole


@kernel
def brushfire(sources, reach):
    """Squared distance ``(rows, cols)`` int32, cells^2, to the source Nav2 finds; OUT_OF_REACH beyond ``reach``."""
    rows, cols = sources.shape
    width = cols + 2  # in a frame of cells that no offer beats no bounds need checking
    squared = np.zeros((rows + 2) * width, np.int32)
    origins = np.empty(rows * cols, np.uint32)
    count = 0
    for row in range(rows):
        for col in range(cols):
            cell = (row + 1) * width + col + 1
            if sources[row, col]:
                origins[count] = cell
                count += 1
            else:
                squared[cell] = OUT_OF_REACH
    _spread(origins[:count], np.uint32(width), reach * reach, squared)
    return squared.reshape(rows + 2, width)[1:-1, 1:-1]


@kernel
def _spread(sources, width, farthest, squared):
    """Work off the lists of :func:`brushfire`, nearest first, lowering ``squared``.

    ``d_row`` and ``d_col`` say where the source lies that a cell was offered. The list of level ``q`` begins at entry
    ``heads + q``, follows ``follower`` and ends at ``last[q]``. Its other entries are cells in the order in which they
    were listed; no cell hears more than four offers. An entry is out of date if its cell has since been offered a
    nearer source.
    """
    one, heads = np.uint32(1), 4 * len(squared)  # unsigned indices, for numba would otherwise check for negative ones
    d_row, d_col = np.zeros(len(squared), np.int32), np.zeros(len(squared), np.int32)
    waiting, follower = np.empty(heads, np.uint32), np.empty(heads + farthest + 1, np.uint32)
    last = np.empty(farthest + 1, np.uint32)
    for q in range(farthest + 1):
        last[q], follower[heads + q] = heads + q, END
    end = 0
    for cell in sources:
        end = _list(cell, 0, end, waiting, follower, last)
    for level in range(farthest + 1):
        entry = follower[heads + level]
        while entry != END:
            cell = waiting[entry]
            if squared[cell] == level:
                row, col = np.int64(d_row[cell]), np.int64(d_col[cell])
                # In the order -x, -y, +x, +y. Offers nearer than this level are none: their lists are worked off.
                for near, next_row, next_col, outwards in (
                    (cell - one, row, col - 1, -col),
                    (cell - width, row - 1, col, -row),
                    (cell + one, row, col + 1, col),
                    (cell + width, row + 1, col, row),
                ):
                    offer = level + 2 * outwards + 1
                    if outwards >= 0 and offer < squared[near] and offer <= farthest:
                        squared[near], d_row[near], d_col[near] = offer, next_row, next_col
                        end = _list(near, offer, end, waiting, follower, last)
            entry = follower[entry]


@inlined
def _list(cell, level, end, waiting, follower, last):
    """Append a cell to the list of a level; return the number of entries."""
    waiting[end], follower[end] = cell, END
    follower[last[level]] = end
    last[level] = end
    return end + 1
