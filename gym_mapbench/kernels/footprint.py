"""Cost of a footprint: the dearest cell under its outline.

Source: nav2_costmap_2d/src/footprint_collision_checker.cpp; Bresenham as in nav2_util's line iterator.
"""

from __future__ import annotations

import math

from gym_mapbench.kernels.geometry import cell_index
from gym_mapbench.kernels.jit import kernel

LETHAL = 254


@kernel
def line_cost(costs, row0, col0, row1, col1):
    """Largest cost on the Bresenham line between two cells, both ends included; stops at 254."""
    d_col, d_row = abs(col1 - col0), abs(row1 - row0)
    step_col = 1 if col1 >= col0 else -1
    step_row = 1 if row1 >= row0 else -1
    along_cols = d_col >= d_row
    long, short = (d_col, d_row) if along_cols else (d_row, d_col)
    error = long // 2
    row, col, worst = row0, col0, 0
    for _ in range(long + 1):
        worst = max(worst, costs[row, col])
        if worst == LETHAL:
            break
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
    """Largest cost under the outline of ``corners`` ``(n, 2)`` placed at a pose; 254 if a corner is off the map."""
    rows, cols = costs.shape
    cos, sin = math.cos(yaw), math.sin(yaw)
    worst = 0
    first = -1
    previous = -1
    for i in range(len(corners) + 1):
        if i < len(corners):
            corner_x = x + (corners[i, 0] * cos - corners[i, 1] * sin)
            corner_y = y + (corners[i, 0] * sin + corners[i, 1] * cos)
            cell = cell_index(corner_x, corner_y, origin_x, origin_y, resolution, rows, cols)
            if cell < 0:
                return LETHAL
        else:
            cell = first
        if i == 0:
            first = cell
        else:
            edge = line_cost(costs, previous // cols, previous % cols, cell // cols, cell % cols)
            worst = max(worst, edge)
            if edge == LETHAL:
                return LETHAL
        previous = cell
    return worst
