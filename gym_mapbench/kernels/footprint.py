"""A footprint on a grid: the highest cost under its outline, and the cells within it.

Source: nav2_costmap_2d/src/footprint_collision_checker.cpp, footprint.cpp, costmap_2d.cpp, and
dwb_critics/src/obstacle_footprint.cpp; for the cost Bresenham as in nav2_util's line iterator.
"""

from __future__ import annotations

import math

import numpy as np

from gym_mapbench.kernels.geometry import cell_index
from gym_mapbench.kernels.jit import kernel
from gym_mapbench.kernels.raytrace import line_cell, touch

FREE = 0
LETHAL = 254


@kernel
def line_cost(costs, row0, col0, row1, col1):
    """Largest cost on the Bresenham line between two cells, both ends included; 254 counts more than 255."""
    d_col, d_row = abs(col1 - col0), abs(row1 - row0)
    step_col = 1 if col1 >= col0 else -1
    step_row = 1 if row1 >= row0 else -1
    along_cols = d_col >= d_row
    long, short = (d_col, d_row) if along_cols else (d_row, d_col)
    error = long // 2
    row, col, worst = row0, col0, 0
    for _ in range(long + 1):
        if costs[row, col] == LETHAL:
            return LETHAL
        worst = max(worst, costs[row, col])
        error += short
        if error >= long:
            error -= long
            if along_cols:
                row += step_row
            else:
                col += step_col
        if along_cols:
            col += step_col
        else:
            row += step_row
    return worst


@kernel
def footprint_cost(costs, resolution, origin_x, origin_y, x, y, yaw, corners):
    """Largest cost under the outline of ``corners`` ``(n, 2)`` placed at a pose; 254 if a corner is off the map.

    The closing edge runs from the first corner to the last, as in ``FootprintCollisionChecker``.
    """
    return outline_cost(costs, resolution, origin_x, origin_y, x, y, yaw, corners, False)


@kernel
def critic_footprint_cost(costs, resolution, origin_x, origin_y, x, y, yaw, corners):
    """:func:`footprint_cost` of DWB's ``ObstacleFootprintCritic``, whose closing edge runs from the last corner on."""
    return outline_cost(costs, resolution, origin_x, origin_y, x, y, yaw, corners, True)


@kernel
def outline_cost(costs, resolution, origin_x, origin_y, x, y, yaw, corners, closes_from_last):
    """Largest cost under an outline; Bresenham's line depends on the end at which an edge begins.

    As in Nav2, an edge with 254 is not seen beside an edge with 255, unless it comes first.
    """
    rows, cols = costs.shape
    cos, sin = math.cos(yaw), math.sin(yaw)
    worst = 0
    first = -1
    previous = -1
    for i in range(len(corners)):
        corner_x = x + (corners[i, 0] * cos - corners[i, 1] * sin)
        corner_y = y + (corners[i, 0] * sin + corners[i, 1] * cos)
        cell = cell_index(corner_x, corner_y, origin_x, origin_y, resolution, rows, cols)
        if cell < 0:
            return LETHAL
        if i == 0:
            first = cell
        else:
            edge = line_cost(costs, previous // cols, previous % cols, cell // cols, cell % cols)
            worst = max(worst, edge)
            if worst == LETHAL:
                return LETHAL
        previous = cell
    start, end = (previous, first) if closes_from_last else (first, previous)
    edge = line_cost(costs, start // cols, start % cols, end // cols, end % cols)
    return max(worst, edge)


@kernel
def touch_footprint(corners, x, y, yaw, box):
    """Place ``corners`` ``(n, 2)`` m at a pose: returns them there, and widens ``box`` to hold them."""
    cos, sin = math.cos(yaw), math.sin(yaw)
    placed = np.empty_like(corners)
    for i in range(len(corners)):
        placed[i, 0] = x + (corners[i, 0] * cos - corners[i, 1] * sin)
        placed[i, 1] = y + (corners[i, 0] * sin + corners[i, 1] * cos)
        touch(box, placed[i, 0], placed[i, 1])
    return placed


@kernel
def clear_polygon(layer, resolution, origin_x, origin_y, corners):
    """Free a convex polygon, ``(n, 2)`` m, outline included, unless a corner is off the map."""
    rows, cols = layer.shape
    cells = np.empty(len(corners), np.int64)
    for i in range(len(corners)):
        cells[i] = cell_index(corners[i, 0], corners[i, 1], origin_x, origin_y, resolution, rows, cols)
        if cells[i] < 0:
            return
    lowest, highest = np.full(cols, rows), np.full(cols, -1)
    for i in range(len(cells)):
        trace_edge(cells[i - 1], cells[i], cols, lowest, highest)
    for col in range(cols):
        for row in range(lowest[col], highest[col] + 1):
            layer[row, col] = FREE


@kernel
def trace_edge(start, end, cols, lowest, highest):
    """Widen the span of rows that an outline covers in every column by one of its edges."""
    row0, col0, row1, col1 = start // cols, start % cols, end // cols, end % cols
    for step in range(max(abs(row1 - row0), abs(col1 - col0)) + 1):
        row, col = line_cell(row0, col0, row1, col1, step)
        lowest[col] = min(lowest[col], row)
        highest[col] = max(highest[col], row)
