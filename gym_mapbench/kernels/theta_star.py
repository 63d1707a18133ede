"""Theta*: a search whose paths are not bound to the grid's directions.

Sources: nav2_theta_star_planner/src/theta_star.cpp (Humble); Daniel, Nash, Koenig and Felner, Theta*: Any-Angle Path
Planning on Grids (2010). Lines of sight run between cell centres and look at every cell they pass, so that
the straight pieces of a path are as safe as its ends.
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
        _look_past_parent(cell, line, width, w_euc, parent, length)
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
def _look_past_parent(cell, line, width, w_euc, parent, length):
    """Make the grandparent the parent if it is in sight and the straight way from it is cheaper."""
    grandparent = parent[parent[cell]]
    straight = length[grandparent] + w_euc * _cells_between(grandparent, cell, width)
    if straight < length[cell]:
        straight += traversal_on_line(line, width, grandparent, cell, length[cell] - straight)
        if straight < length[cell]:
            length[cell], parent[cell] = straight, grandparent


@kernel
def _cells_between(first, second, width):
    return math.hypot(first // width - second // width, first % width - second % width)


@kernel
def traversal_on_line(line, width, first, second, enough):
    """Sum of ``line`` over the cells that the line between two centres passes, without the first; stops at ``enough``.

    Where it runs exactly through a corner, the two cells beside are not passed.
    """
    d_row, d_col = second // width - first // width, second % width - first % width
    step_row, step_col = (width if d_row > 0 else -width), (1 if d_col > 0 else -1)
    d_row, d_col = abs(d_row), abs(d_col)
    cell, row, col, total = first, 0, 0, 0.0
    while cell != second and total < enough:
        side = (2 * col + 1) * d_row - (2 * row + 1) * d_col
        if side <= 0:
            cell += step_col
            col += 1
        if side >= 0:
            cell += step_row
            row += 1
        total += line[cell]
    return total
