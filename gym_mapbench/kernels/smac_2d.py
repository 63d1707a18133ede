"""Smac 2D: cost-aware A* on the eight neighbours, and the smoother behind it.

Source: nav2_smac_planner/src/a_star.cpp, node_2d.cpp, smoother.cpp (Humble).
"""

from __future__ import annotations

import math

import numpy as np

from gym_mapbench.kernels.geometry import cell_index
from gym_mapbench.kernels.jit import kernel
from gym_mapbench.kernels.search import NOT_LISTED, STEP_COL, STEP_ROW, framed_costs, list_cell, take_first, trace_back

DIAGONAL = math.sqrt(2.0)
NO_CELL = -1
MAX_NON_OBSTACLE = 252
UNKNOWN = 255


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


@kernel
def smooth(path, costs, resolution, origin_x, origin_y, w_data, w_smooth, tolerance, max_iterations):
    """Pull the inner points of ``path`` ``(n, 2)`` m towards their neighbours until they rest.

    Returns:
        The path, and whether it came to rest; else it is that of the last round without a collision.
    """
    smoothed, last = path.copy(), path.copy()
    rows, cols = costs.shape
    for _ in range(max_iterations - 1):
        change = 0.0
        for i in range(1, len(path) - 1):
            for axis in range(2):
                old = smoothed[i, axis]
                bend = smoothed[i + 1, axis] + smoothed[i - 1, axis] - 2.0 * old
                smoothed[i, axis] = old + w_data * (path[i, axis] - old) + w_smooth * bend
                change += abs(smoothed[i, axis] - old)
            cell = cell_index(smoothed[i, 0], smoothed[i, 1], origin_x, origin_y, resolution, rows, cols)
            if cell < 0 or MAX_NON_OBSTACLE < costs[cell // cols, cell % cols] < UNKNOWN:
                return last, False
        for i in range(len(path)):
            last[i, 0], last[i, 1] = smoothed[i, 0], smoothed[i, 1]
        if change < tolerance:
            return smoothed, True
    return last, False
