"""Kernels on the global plan: which part DWB follows, and how far every cell lies from it.

Source: nav2_dwb_controller: dwb_core/src/dwb_local_planner.cpp (transformGlobalPlan),
nav_2d_utils/src/path_ops.cpp, dwb_critics/src/map_grid.cpp, path_dist.cpp, goal_dist.cpp.
"""

from __future__ import annotations

import math

import numpy as np

from gym_mapbench.kernels.geometry import cell_index
from gym_mapbench.kernels.jit import kernel

NO_INFORMATION = 255


@kernel
def plan_window(plan, x, y, prune_distance, start_threshold, end_threshold):
    """First and past-the-last pose of the part of the plan that the critics see.

    The part begins at the first pose nearer to the robot than ``start_threshold``, sought no further along
    the plan than ``prune_distance``, and ends before the first pose beyond ``end_threshold``.
    """
    limit = len(plan)
    travelled = 0.0
    for i in range(len(plan) - 1):
        travelled += math.hypot(plan[i + 1, 0] - plan[i, 0], plan[i + 1, 1] - plan[i, 1])
        if travelled > prune_distance:
            limit = i + 1
            break
    begin = 0
    while begin < limit and not math.hypot(plan[begin, 0] - x, plan[begin, 1] - y) < start_threshold:
        begin += 1
    end = begin
    while end < len(plan) and not math.hypot(plan[end, 0] - x, plan[end, 1] - y) > end_threshold:
        end += 1
    return begin, end


@kernel
def gap_points(dx, dy, resolution):
    """Into how many parts a gap of the plan is divided; below 2 no point is put between."""
    gap_sq = dx * dx + dy * dy
    smallest_sq = resolution * resolution * 4.0
    if gap_sq <= smallest_sq:
        return 0
    return int((math.sqrt(gap_sq) - math.sqrt(smallest_sq)) / resolution) - 1


@kernel
def seed_cells(plan, costs, origin_x, origin_y, resolution):
    """Cells of the plan's first run on the known map, in order, as flat indices; empty if it never is there."""
    rows, cols = costs.shape
    known = costs.ravel()
    parts = np.ones(len(plan), dtype=np.int64)
    for i in range(1, len(plan)):
        parts[i] = max(1, gap_points(plan[i, 0] - plan[i - 1, 0], plan[i, 1] - plan[i - 1, 1], resolution))
    cells = np.empty(parts.sum(), dtype=np.int64)
    n = 0
    for i in range(len(plan)):
        for j in range(1, parts[i] + 1):
            x, y = plan[i, 0], plan[i, 1]
            if j < parts[i]:
                x = plan[i - 1, 0] + j * ((x - plan[i - 1, 0]) / parts[i])
                y = plan[i - 1, 1] + j * ((y - plan[i - 1, 1]) / parts[i])
            cell = cell_index(x, y, origin_x, origin_y, resolution, rows, cols)
            if cell >= 0 and known[cell] != NO_INFORMATION:
                cells[n] = cell
                n += 1
            elif n > 0:
                return cells[:n]
    return cells[:n]


@kernel
def spread(distances):
    """Let every value reach its neighbours at one more per cell (two passes an axis; exact for city blocks)."""
    rows, cols = distances.shape
    for r in range(1, rows):
        for c in range(cols):
            distances[r, c] = min(distances[r, c], distances[r - 1, c] + 1)
    for r in range(rows - 2, -1, -1):
        for c in range(cols):
            distances[r, c] = min(distances[r, c], distances[r + 1, c] + 1)
    for r in range(rows):
        for c in range(1, cols):
            distances[r, c] = min(distances[r, c], distances[r, c - 1] + 1)
        for c in range(cols - 2, -1, -1):
            distances[r, c] = min(distances[r, c], distances[r, c + 1] + 1)


@kernel
def distance_field(seeds, first_row, first_col, last_col, distances, unreachable):
    """Write the Manhattan distance in cells to the nearest seed, ``unreachable`` without seeds.

    Args:
        seeds: Flat indices of cells of the map.
        first_row: Row of the map at which ``distances`` begins.
        first_col: First column of the map to fill.
        last_col: The column past the last to fill.
        distances: ``(rows, columns of the map)`` int32. A seed outside the part to be filled counts from the
            nearest cell of it, through which every shortest way goes.
        unreachable: Value of a cell that no seed reaches.
    """
    cols = distances.shape[1]
    part = distances[:, first_col:last_col]
    height, width = part.shape
    part[:] = unreachable
    for seed in seeds:
        row, col = seed // cols - first_row, seed % cols - first_col
        inner_row, inner_col = min(max(row, 0), height - 1), min(max(col, 0), width - 1)
        away = abs(row - inner_row) + abs(col - inner_col)
        part[inner_row, inner_col] = min(part[inner_row, inner_col], away)
    if len(seeds) > 0:
        spread(part)
