"""Theta*: a search whose paths are not bound to the grid's directions.

Sources: nav2_theta_star_planner/src/theta_star.cpp (Humble); Daniel, Nash, Koenig and Felner, Theta*: Any-Angle Path
Planning on Grids (2010). A line of sight is Nav2's walk over the cells near it, not over every cell that it touches.
"""

from __future__ import annotations

import math

import numpy as np

from gym_mapbench.kernels.jit import kernel
from gym_mapbench.kernels.search import NOT_LISTED, STEP_COL, STEP_ROW, framed_costs, list_cell, take_first, trace_back

NO_CELL = -1


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
    """Fill ``parent``; return whether the goal was reached."""
    length, key = np.full(len(step), np.inf), np.full(len(step), np.inf)
    heap, place = np.empty(len(step), np.int32), np.full(len(step), NOT_LISTED, np.int32)
    length[start] = step[start]
    count = list_cell(heap, place, key, 0, start)
    while count > 0:
        cell = take_first(heap, place, key, count)
        count -= 1
        if cell == goal:
            return True
        ahead = w_heur * _cells_between(cell, goal, width)
        _look_past_parent(cell, step, line, width, w_euc, parent, length)
        key[cell] = min(key[cell], length[cell] + ahead)
        for side in range(corners):
            near = cell + STEP_ROW[side] * width + STEP_COL[side]
            reached = length[cell] + step[near] + w_euc * math.hypot(STEP_ROW[side], STEP_COL[side])
            estimate = reached + w_heur * _cells_between(near, goal, width)
            if estimate < key[near]:
                length[near], parent[near], key[near] = reached, cell, estimate
                count = list_cell(heap, place, key, count, near)
    return False


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
