"""Theta*: a search whose paths are not bound to the grid's directions.

Sources: nav2_theta_star_planner/src/theta_star.cpp (Humble); Daniel, Nash, Koenig and Felner, Theta*: Any-Angle Path
Planning on Grids (2010). A line of sight is Nav2's walk over the cells near it, not over every cell that it touches.
"""

from __future__ import annotations

import math

import numpy as np

from gym_mapbench.kernels.jit import kernel
from gym_mapbench.kernels.search import framed_costs, trace_back

NO_CELL = -1
STEP_ROW, STEP_COL = (1, -1, 0, 0, -1, 1, 1, -1), (0, 0, 1, -1, 1, -1, 1, -1)
"""The neighbours in the order in which Nav2 looks at them, which decides among equals."""


@kernel
def search_corners(costs, step_cost, line_cost, start_row, start_col, goal_row, goal_col, corners, w_euc, w_heur):
    """Cells ``(n, 2)`` row, col where a cheap path of straight pieces turns, start to goal; empty if there is none.

    Args:
        costs: ``(rows, cols)`` uint8.
        step_cost: ``(256,)`` float64, traversal cost of a cell stepped onto; inf where blocked.
        line_cost: ``(256,)`` float64, traversal cost of a cell on a line of sight; inf where it ends.
        start_row: Start.
        start_col: Start.
        goal_row: Goal.
        goal_col: Goal.
        corners: 4 or 8 neighbours.
        w_euc: Cost of a cell's length.
        w_heur: The same in the estimate of what is left.
    """
    width = costs.shape[1] + 2
    step, line = framed_costs(costs, step_cost), framed_costs(costs, line_cost)
    start, goal = (start_row + 1) * width + start_col + 1, (goal_row + 1) * width + goal_col + 1
    parent = np.full(len(step), NO_CELL, np.int32)
    parent[start] = start
    if not _search(step, line, width, start, goal, corners, w_euc, w_heur, parent):
        return np.empty((0, 2), np.int64)
    return trace_back(parent, width, goal)


@kernel
def _search(step, line, width, start, goal, corners, w_euc, w_heur, parent):
    """Fill ``parent``; return whether the goal was reached.

    As in Nav2, the key of a listed cell may fall without moving it up the heap, and the start is expanded twice. The
    search fails once no other cell is listed, even if the last one is the goal or the only way on.
    """
    length, key = np.full(len(step), np.inf), np.full(len(step), np.inf)
    heap, listed = np.empty(len(step) + 1, np.int32), np.zeros(len(step), np.bool_)
    length[start] = step[start]
    key[start] = step[start] + w_heur * _cells_between(start, goal, width)
    _sift_up(heap, key, 0, start)
    cell, count = start, 1
    while cell != goal:
        listed[cell] = False
        ahead = w_heur * _cells_between(cell, goal, width)
        _look_past_parent(cell, step, line, width, w_euc, parent, length)
        key[cell] = min(key[cell], length[cell] + ahead)
        for side in range(corners):
            near = cell + STEP_ROW[side] * width + STEP_COL[side]
            reached = length[cell] + w_euc * math.hypot(STEP_ROW[side], STEP_COL[side]) + step[near]
            estimate = reached + w_heur * _cells_between(near, goal, width)
            if estimate < key[near]:
                length[near], parent[near], key[near] = reached, cell, estimate
                if not listed[near]:
                    listed[near] = True
                    _sift_up(heap, key, count, near)
                    count += 1
        cell = heap[0]
        count -= 1
        if count == 0:
            return False
        _fill_top(heap, key, count, heap[count])
    return True


@kernel
def _sift_up(heap, key, at, cell):
    """Put a cell into the heap at a free place, or above it while the key there is higher."""
    while at > 0 and key[heap[(at - 1) // 2]] > key[cell]:
        heap[at] = heap[(at - 1) // 2]
        at = (at - 1) // 2
    heap[at] = cell


@kernel
def _fill_top(heap, key, count, cell):
    """Move up the lesser children below the top of ``count`` cells, and put a cell where the last one left."""
    at = 0
    while 2 * at + 1 < count:
        child = 2 * at + 1
        if child + 1 < count and key[heap[child + 1]] <= key[heap[child]]:
            child += 1
        heap[at] = heap[child]
        at = child
    _sift_up(heap, key, at, cell)


@kernel
def _look_past_parent(cell, step, line, width, w_euc, parent, length):
    """Make the grandparent the parent if it is in sight and the straight way from it is cheaper."""
    grandparent = parent[parent[cell]]
    straight = length[grandparent] + w_euc * _cells_between(grandparent, cell, width)
    if straight < length[cell]:
        straight = length_in_sight(step, line, width, cell, grandparent, straight, length[cell])
        if straight < length[cell]:
            length[cell], parent[cell] = straight, grandparent


@kernel
def _cells_between(first, second, width):
    return math.hypot(first // width - second // width, first % width - second % width)


@kernel
def length_in_sight(step, line, width, cell, ancestor, straight, enough):
    """Add ``line`` over the cells of the walk from a cell to its ancestor, the ancestor left out, to ``straight``.

    The walk is Bresenham's: it steps along one axis or, where ``step`` lets both cells beside pass, diagonally. The sum
    is inf where it cannot go on, and ends where it has reached ``enough``.
    """
    d_row, d_col = ancestor // width - cell // width, ancestor % width - cell % width
    step_row, step_col = (width if d_row > 0 else -width), (1 if d_col > 0 else -1)
    d_row, d_col = abs(d_row), abs(d_col)
    error, total = d_col - d_row, 0.0
    while cell != ancestor and straight + total < enough:
        total += line[cell]
        crosses, climbs = 2 * error > -d_row, 2 * error <= d_col
        if crosses and climbs and math.isinf(step[cell + step_col] + step[cell + step_row]):
            return math.inf
        if crosses:
            cell += step_col
            error -= d_row
        if climbs:
            cell += step_row
            error += d_col
    return straight + total
