"""How far every cell lies from its obstacle, as Nav2's inflation layer finds out, and the costs that follow.

Source: nav2_costmap_2d/plugins/inflation_layer.cpp. Nav2 spreads from the obstacles cell by cell, one
first-in-first-out list per distance; a cell keeps the obstacle it hears of first, which is now and then not
its nearest. Only offers nearer than all before are listed: the others would come too late.
"""

from __future__ import annotations

import numpy as np

from gym_mapbench.kernels.distance import squared_distance
from gym_mapbench.kernels.jit import kernel

INSCRIBED = 253
LETHAL = 254
UNKNOWN = 255
MIDDLE = 2**15
UP = 2**16


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
    # Waves only lead away from their obstacles: what meets in these cells has come through cells within one reach.
    first_row, first_col = max(0, row0 - reach), max(0, col0 - reach)
    last_row, last_col = min(costs.shape[0], row1 + reach), min(costs.shape[1], col1 + reach)
    sources = np.empty((last_row - first_row, last_col - first_col), np.bool_)
    for row in range(len(sources)):
        find_sources(costs[first_row + row, first_col:last_col], inflate_around_unknown, sources[row])
    squared = whole_squared_distance(sources, reach) if exact else brushfire(sources, reach)
    least = 1 if inflate_unknown else INSCRIBED
    for row in range(row0, row1):
        distances = squared[row - first_row, col0 - first_col : col1 - first_col]
        write_inflated(costs[row, col0:col1], distances, cost_of, least)


@kernel
def find_sources(costs, inflate_around_unknown, sources):
    """Say which cells of a row are obstacles; a function of rows without branches, for then it is vectorised."""
    for i in range(len(costs)):
        sources[i] = (costs[i] == LETHAL) | (inflate_around_unknown & (costs[i] == UNKNOWN))


@kernel
def widen(box, last, radius):
    """Widen a box by that of the last update, which becomes this one, and by a radius; all in m."""
    for axis in range(4):
        news = box[axis]
        box[axis] = min(last[axis], news) - radius if axis < 2 else max(last[axis], news) + radius
        last[axis] = news


@kernel
def write_inflated(costs, squared, cost_of, least):
    """Apply Nav2's write rule to a row of cells, where within reach.

    Args:
        costs: ``(cols,)`` uint8, in and out.
        squared: ``(cols,)`` int32 squared distances, cells^2.
        cost_of: ``(reach**2 + 1,)`` uint8, cost at a squared distance.
        least: Smallest cost that replaces 255.
    """
    farthest = np.uint32(len(cost_of) - 1)
    for i in range(len(costs)):
        old, distance = costs[i], np.uint32(squared[i])
        cost = cost_of[min(distance, farthest)]
        written = (distance <= farthest) & ((cost > old) | ((old == UNKNOWN) & (cost >= least)))
        costs[i] = cost if written else old


@kernel
def whole_squared_distance(sources, reach):
    """Squared distance ``(rows, cols)`` int32, cells^2, to the nearest source; ``reach**2 + 1`` for all beyond."""
    rows, cols = sources.shape
    exact, whole = squared_distance(sources), np.empty((rows, cols), np.int32)
    for row in range(rows):
        for col in range(cols):
            whole[row, col] = min(exact[row, col], reach * reach + 1)
    return whole


@kernel
def brushfire(sources, reach):
    """Squared distance ``(rows, cols)`` int32, cells^2, to the source Nav2 finds; ``reach**2 + 1`` for all beyond."""
    rows, cols = sources.shape
    width = cols + 2  # in a frame of cells that no offer beats no bounds need checking
    squared, origins = np.zeros((rows + 2, width), np.int32), np.empty(rows * cols + 1, np.uint32)
    count = np.uint32(0)
    for row in range(rows):
        _begin_row(sources[row], np.int32(reach * reach + 1), squared[row + 1, 1 : cols + 1])
        count = _list_sources(sources[row], (row + 1) * width + 1, count, origins)
    _spread(origins[:count], np.uint32(width), reach, squared.ravel())
    return squared[1:-1, 1:-1]


@kernel
def _begin_row(sources, beyond, squared):
    """Set the distances of a row: 0 at sources, ``beyond`` elsewhere; a function of rows, for then it is vectorised."""
    for i in range(len(sources)):
        squared[i] = np.int32(0) if sources[i] else beyond


@kernel
def _list_sources(sources, first, count, origins):
    """Append the sources of a row, whose first cell is ``first``; return how many are listed now."""
    for i in range(len(sources)):
        origins[count] = first + i
        count += np.uint32(sources[i])
    return count


@kernel
def _spread(sources, width, reach, squared):
    """Work off the lists of :func:`brushfire`, nearest first, lowering ``squared``.

    An entry is a cell, and where it lies, seen from the source that it was offered. It is one number, as storing takes
    most of the time: the cell in the upper half, then row and column plus ``MIDDLE`` in 16 bits each. The list of level
    ``q`` begins at place ``heads + q``, follows ``follower`` and ends at ``last[q]``; no cell hears more than four
    offers. An entry is out of date if its cell has since been offered a nearer source. Each offer is written as the
    next entry, which counts if the offer is taken: a branch would be guessed wrong every other time.
    """
    heads, levels = 4 * len(squared) + 1, (reach + 1) ** 2 + 1
    entries, follower = np.empty(heads, np.int64), np.empty(heads + levels, np.uint32)
    last, end = np.empty(levels, np.uint32), np.uint32(0)
    for q in range(levels):
        last[q] = heads + q
    for cell in sources:
        entries[end] = (np.int64(cell) << 32) + MIDDLE * UP + MIDDLE
        follower[last[0]], last[0] = end, end
        end += np.uint32(1)
    one_row, one_col = (np.int64(width) << 32) + UP, (np.int64(1) << 32) + 1
    for level in range(reach * reach):  # all offers of the next level would lie beyond reach
        place = np.uint32(heads + level)
        while place != last[level]:
            place = follower[place]
            entry = entries[place]
            if squared[np.uint64(entry >> 32)] == level:
                row, col = ((entry >> 16) & 0xFFFF) - MIDDLE, (entry & 0xFFFF) - MIDDLE
                # In the order -x, -y, +x, +y. Offers nearer than this level are none: their lists are worked off.
                for step, outwards in ((-one_col, -col), (-one_row, -row), (one_col, col), (one_row, row)):
                    if outwards >= 0:
                        near, offer = entry + step, level + 2 * outwards + 1
                        cell, offered = np.uint64(near >> 32), np.uint64(offer)
                        before, tail = squared[cell], last[offered]
                        taken = offer < before
                        entries[end], follower[tail] = near, end
                        squared[cell], last[offered] = (offer, end) if taken else (before, tail)
                        end += np.uint32(taken)
