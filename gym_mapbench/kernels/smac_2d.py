"""Smac 2D: cost-aware A* on the eight neighbours.

Source: nav2_smac_planner/src/a_star.cpp, node_2d.cpp (Humble).
"""

from __future__ import annotations

import math

import numpy as np

from gym_mapbench.kernels.jit import kernel
from gym_mapbench.kernels.search import NOT_LISTED, STEP_COL, STEP_ROW, framed_costs, list_cell, take_first, trace_back

DIAGONAL = math.sqrt(2.0)
NO_CELL = -1


@kernel
def search_cells(costs, cost_of, start_row, start_col, goal_row, goal_col, tolerance, max_iterations, max_on_approach):
    """Cells ``(n, 2)`` row, col of a cheapest path, start to end; empty if there is none.

    Args:
        costs: ``(rows, cols)`` uint8.
        cost_of: ``(256,)`` float64, what one straight step onto a cell of that value costs; inf where blocked.
        start_row: Start, whatever its cost.
        start_col: Start.
        goal_row: Goal.
        goal_col: Goal.
        tolerance: Cells; a path may end less than this from the goal.
        max_iterations: Most cells to expand.
        max_on_approach: Most cells to expand once a path within the tolerance is known.
    """
    width = costs.shape[1] + 2
    step = framed_costs(costs, cost_of)
    start, goal = (start_row + 1) * width + start_col + 1, (goal_row + 1) * width + goal_col + 1
    parent = np.full(len(step), NO_CELL, np.int32)
    parent[start] = start
    end = _search(step, width, start, goal, tolerance, max_iterations, max_on_approach, parent)
    if end == NO_CELL:
        return np.empty((0, 2), np.int64)
    return trace_back(parent, width, end)


@kernel
def _search(step, width, start, goal, tolerance, max_iterations, max_on_approach, parent):
    """Fill ``parent`` and return the cell where the path ends, NO_CELL if nothing near the goal was reached."""
    length, key = np.full(len(step), np.inf), np.full(len(step), np.inf)
    heap, place = np.empty(len(step), np.int32), np.full(len(step), NOT_LISTED, np.int32)
    length[start] = 0.0
    count = list_cell(heap, place, key, 0, start)
    nearest, least, approach = NO_CELL, np.inf, 0
    for _ in range(max_iterations):
        if count == 0:
            break
        cell = take_first(heap, place, key, count)
        count -= 1
        if cell == goal:
            return goal
        step[cell] = np.inf  # visited: never entered again
        if least < tolerance:
            approach += 1
            if approach >= max_on_approach:
                break
        for side in range(8):
            near = cell + STEP_ROW[side] * width + STEP_COL[side]
            reached = length[cell] + step[near] * (1.0 if side < 4 else DIAGONAL)
            if reached < length[near]:
                ahead = math.hypot(near // width - goal // width, near % width - goal % width)
                length[near], parent[near], key[near] = reached, cell, reached + ahead
                count = list_cell(heap, place, key, count, near)
                if ahead < least:
                    nearest, least = near, ahead
    return nearest if least < tolerance else NO_CELL
