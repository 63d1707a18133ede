"""Kernels on the global plan: the part that DWB follows, and every cell's distance from it.

Source: nav2_dwb_controller: dwb_core/src/dwb_local_planner.cpp (transformGlobalPlan),
nav_2d_utils/src/path_ops.cpp, dwb_critics/src/map_grid.cpp, path_dist.cpp, goal_dist.cpp.
"""

from __future__ import annotations

import math

import numpy as np

from gym_mapbench.kernels.geometry import cell_index
from gym_mapbench.kernels.jit import kernel

NO_INFORMATION = 255

PATH, GOAL, GOAL_AHEAD = range(3)
"""The map grids, in the order of :func:`distance_fields`."""


@kernel
def plan_window(plan, x, y, search, start_threshold, end_threshold):
    """First and past-the-last pose of the part of the plan that the critics see.

    The part begins at the first pose nearer to the robot than ``start_threshold`` (m), which is searched for no further
    along the plan than ``search`` (m), and ends before the first pose farther away than ``end_threshold`` (m).
    """
    limit = len(plan)
    travelled = 0.0
    for i in range(len(plan) - 1):
        travelled += math.hypot(plan[i + 1, 0] - plan[i, 0], plan[i + 1, 1] - plan[i, 1])
        if travelled > search:
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
def gap_parts(dx, dy, resolution):
    """Number of parts into which a gap of the plan is divided; a gap of less than five cells stays whole."""
    gap_sq = dx * dx + dy * dy
    smallest_sq = resolution * resolution * 4.0
    if gap_sq <= smallest_sq:
        return 1
    return max(1, int((math.sqrt(gap_sq) - math.sqrt(smallest_sq)) / resolution) - 1)


@kernel
def count_points(plan, end_dx, end_dy, resolution):
    """Upper bound of the number of points of the plan once its gaps are filled."""
    points = 1 + int((abs(end_dx) + abs(end_dy)) / resolution)
    for i in range(1, len(plan)):
        points += gap_parts(plan[i, 0] - plan[i - 1, 0], plan[i, 1] - plan[i - 1, 1], resolution)
    return points


@kernel
def moved_pose(plan, i, end_dx, end_dy):
    """Position of a pose of the plan, of which the last, be it the only one, is moved by ``end_dx``, ``end_dy`` (m)."""
    if i == len(plan) - 1:
        return plan[i, 0] + end_dx, plan[i, 1] + end_dy
    return plan[i, 0], plan[i, 1]


@kernel
def seed_cells(plan, end_dx, end_dy, costs, origin_x, origin_y, resolution):
    """Flat indices of the cells of the plan's first stretch on the known map, in order; empty if there is none.

    The last pose of the plan is moved by ``end_dx``, ``end_dy`` (m); wide gaps are filled.
    """
    rows, cols = costs.shape
    cells = np.empty(count_points(plan, end_dx, end_dy, resolution), dtype=np.int64)
    n = 0
    last_x, last_y = moved_pose(plan, 0, end_dx, end_dy)
    for i in range(len(plan)):
        to_x, to_y = moved_pose(plan, i, end_dx, end_dy)
        parts = gap_parts(to_x - last_x, to_y - last_y, resolution)
        for j in range(1, parts + 1):
            x, y = to_x, to_y
            if j < parts:
                x, y = last_x + j * ((to_x - last_x) / parts), last_y + j * ((to_y - last_y) / parts)
            cell = cell_index(x, y, origin_x, origin_y, resolution, rows, cols)
            if cell >= 0 and costs.flat[cell] != NO_INFORMATION:
                cells[n] = cell
                n += 1
            elif n > 0:
                return cells[:n]
        last_x, last_y = to_x, to_y
    return cells[:n]


@kernel
def span(lowest, highest, resolution, cells):
    """First and past-the-last cell between two coordinates, with a margin of one cell; there is at least one cell."""
    first = min(max(math.floor(lowest / resolution) - 1, 0), cells - 1)
    return first, max(first + 1, min(math.ceil(highest / resolution) + 1, cells))


@kernel
def spread(part):
    """Spread every value to its neighbours, one more per cell: two passes per axis, exact for Manhattan distances."""
    rows, cols = part.shape
    for r in range(1, rows):
        above, row = part[r - 1], part[r]
        for c in range(cols):
            row[c] = min(row[c], above[c] + 1)
    for r in range(rows - 2, -1, -1):
        below, row = part[r + 1], part[r]
        for c in range(cols):
            row[c] = min(row[c], below[c] + 1)
    for r in range(rows):
        row = part[r]
        least = row[0]
        for c in range(1, cols):
            least = min(row[c], least + 1)
            row[c] = least
        for c in range(cols - 2, -1, -1):
            least = min(row[c], least + 1)
            row[c] = least


@kernel
def fill_from_one(part, row, col):
    """Distances to one seed, given in the part's own rows and columns."""
    for r in range(part.shape[0]):
        line, away = part[r], abs(r - row)
        for c in range(part.shape[1]):
            line[c] = away + abs(c - col)


@kernel
def fill_from_many(part, seeds, first_row, first_col, cols):
    """Distances to the nearest of many seeds.

    A seed outside the part counts from the nearest cell of it, through which every shortest way goes.
    """
    height, width = part.shape
    for seed in seeds:
        row, col = seed // cols - first_row, seed % cols - first_col
        inner_row, inner_col = min(max(row, 0), height - 1), min(max(col, 0), width - 1)
        away = abs(row - inner_row) + abs(col - inner_col)
        part[inner_row, inner_col] = min(part[inner_row, inner_col], away)
    spread(part)


@kernel
def fill(part, seeds, first_row, first_col, cols, unreachable):
    """Manhattan distances in cells from the cells of ``part`` to the nearest of ``seeds``."""
    if len(seeds) == 1:
        fill_from_one(part, seeds[0] // cols - first_row, seeds[0] % cols - first_col)
        return
    part[:] = unreachable
    if len(seeds) > 0:
        fill_from_many(part, seeds, first_row, first_col, cols)


@kernel
def distance_fields(plan, ahead_x, ahead_y, costs, origin_x, origin_y, resolution, box):
    """Manhattan distances in cells within ``box``: lowest and highest x, lowest and highest y, m.

    Returns:
        ``(3, cells)`` int32: distances to the nearest cell of the plan, to the last one, and to the last one if the
        plan's end is moved by ``ahead_x``, ``ahead_y`` (m). They hold some whole rows of the map, filled in the
        columns of the box; without any plan on the map with the number of its cells + 1. Then the number of cells
        of the map before those rows, and whether the plan is on the map.
    """
    rows, cols = costs.shape
    left, right = span(box[0] - origin_x, box[1] - origin_x, resolution, cols)
    top, bottom = span(box[2] - origin_y, box[3] - origin_y, resolution, rows)
    distances = np.empty((3, bottom - top, cols), dtype=np.int32)
    seeds = seed_cells(plan, 0.0, 0.0, costs, origin_x, origin_y, resolution)
    ahead = seed_cells(plan, ahead_x, ahead_y, costs, origin_x, origin_y, resolution)
    for layer, cells in enumerate((seeds, seeds[-1:], ahead[-1:])):
        fill(distances[layer, :, left:right], cells, top, left, cols, rows * cols + 1)
    return distances.reshape((3, -1)), top * cols, len(seeds) > 0
