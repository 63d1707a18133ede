"""How far every cell lies from its obstacle, as Nav2's inflation layer finds out, and the costs that follow.

Source: nav2_costmap_2d/plugins/inflation_layer.cpp. Nav2 spreads from the obstacles cell by cell, one
first-in-first-out list per distance; a cell keeps the obstacle it hears of first, which is now and then not
its nearest. Only offers nearer than all before are listed: the others would come too late.
"""

from __future__ import annotations

import numpy as np

from gym_mapbench.kernels.jit import kernel

OUT_OF_REACH = 2**31 - 1
INSCRIBED = 253
LETHAL = 254
UNKNOWN = 255
STEP_ROW = (0, -1, 0, 1)
STEP_COL = (-1, 0, 1, 0)


@kernel
def inflate(costs, reach, cost_of, inflate_unknown, inflate_around_unknown, row0, col0, row1, col1):
    """Write inflated costs over ``costs`` ``(rows, cols)`` uint8, in place, in rows ``row0:row1`` and ``col0:col1``.

    Obstacles up to ``reach`` outside these rows and columns count, none beyond.

    Args:
        costs: Cost values with obstacles of 254.
        reach: Largest distance, cells.
        cost_of: ``(reach**2 + 1,)`` uint8, cost at a squared distance in cells.
        inflate_unknown: Whether any cost replaces 255, not only 253 and more.
        inflate_around_unknown: Whether cells of 255 count as obstacles.
        row0: First row to write.
        col0: First column.
        row1: Row after the last one.
        col1: Column after the last one.
    """
    rows, cols = costs.shape
    sources = np.zeros((rows, cols), np.bool_)
    for row in range(max(0, row0 - reach), min(rows, row1 + reach)):
        for col in range(max(0, col0 - reach), min(cols, col1 + reach)):
            cost = costs[row, col]
            sources[row, col] = cost == LETHAL or (inflate_around_unknown and cost == UNKNOWN)
    write_inflated(costs, brushfire(sources, reach), cost_of, inflate_unknown, row0, col0, row1, col1)


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
def brushfire(sources, reach):
    """Squared distance ``(rows, cols)`` int32, cells^2, to the source Nav2 finds; OUT_OF_REACH beyond ``reach``."""
    rows, cols = sources.shape
    width = cols + 2  # in a frame of cells that count as fixed no bounds need checking
    best = np.zeros((rows + 2) * width, np.int32)
    squared = np.full((rows + 2) * width, OUT_OF_REACH, np.int32)
    origins = np.empty(rows * cols, np.int32)
    count = 0
    for row in range(rows):
        for col in range(cols):
            cell = (row + 1) * width + col + 1
            if sources[row, col]:
                origins[count] = cell
                count += 1
            else:
                best[cell] = OUT_OF_REACH
    _spread(origins[:count], width, reach * reach, best, squared)
    return squared.reshape(rows + 2, width)[1:-1, 1:-1]


@kernel
def _spread(sources, width, farthest, best, squared):
    """Work off the lists of :func:`brushfire`, nearest first, filling ``squared``.

    ``best`` is the squared distance a cell has been offered, 0 once it is fixed, which no offer beats;
    ``d_row`` and ``d_col`` say where the offered source lies. List ``q`` runs from ``first[q]`` over
    ``follower`` to ``last[q]``.
    """
    d_row, d_col = np.zeros(len(best), np.int32), np.zeros(len(best), np.int32)
    waiting, follower = np.empty(4 * len(best), np.int32), np.empty(4 * len(best), np.int32)
    first, last = np.full(farthest + 1, -1, np.int32), np.full(farthest + 1, -1, np.int32)
    end = len(sources)
    for i in range(end):
        waiting[i], follower[i] = sources[i], i + 1
    if end > 0:
        first[0] = 0
        follower[end - 1] = -1
    for level in range(farthest + 1):
        entry = first[level]
        while entry >= 0:
            cell = waiting[entry]
            if best[cell] == level:
                best[cell], squared[cell] = 0, level
                for side in range(4):  # -x, -y, +x, +y; lists already worked off are not read again
                    row, col = d_row[cell] + STEP_ROW[side], d_col[cell] + STEP_COL[side]
                    near, q = cell + STEP_ROW[side] * width + STEP_COL[side], row * row + col * col
                    if q < best[near] and level <= q <= farthest:
                        best[near], d_row[near], d_col[near] = q, row, col
                        waiting[end], follower[end] = near, -1
                        if first[q] < 0:
                            first[q] = end
                        else:
                            follower[last[q]] = end
                        last[q] = end
                        end += 1
            entry = follower[entry]
