"""What one lidar scan and the robot's own footprint do to an obstacle layer.

Source: nav2_costmap_2d/plugins/obstacle_layer.cpp and voxel_layer.cpp, include/nav2_costmap_2d/costmap_2d.hpp.
"""

from __future__ import annotations

import math

import numpy as np

from gym_mapbench.kernels.geometry import cell_index
from gym_mapbench.kernels.jit import kernel

FREE = 0
LETHAL = 254
INSIDE = 1e-3


@kernel
def line_cell(row0, col0, row1, col1, step):
    """Cell ``(row, col)`` that Bresenham's line reaches after ``step`` steps along its longer axis."""
    d_row, d_col = abs(row1 - row0), abs(col1 - col0)
    along = max(d_row, d_col, 1)
    aside = (along // 2 + step * min(d_row, d_col)) // along
    if d_col >= d_row:
        return row0 + (aside if row1 > row0 else -aside), col0 + (step if col1 > col0 else -step)
    return row0 + (step if row1 > row0 else -step), col0 + (aside if col1 > col0 else -aside)


@kernel
def clear_rays(layer, resolution, origin_x, origin_y, x, y, ends, min_cells, max_cells):
    """Free the cells from the sensor at ``x``, ``y`` (m) to every one of ``ends`` ``(n, 2)`` m."""
    rows, cols = layer.shape
    sensor = cell_index(x, y, origin_x, origin_y, resolution, rows, cols)
    if sensor < 0:
        return
    x_max, y_max = (
        origin_x + cols * resolution - INSIDE * resolution,
        origin_y + rows * resolution - INSIDE * resolution,
    )
    for i in range(len(ends)):
        dx, dy = ends[i, 0] - x, ends[i, 1] - y
        share = min(_share(x, dx, origin_x, x_max), _share(y, dy, origin_y, y_max))
        end_x, end_y = max(origin_x, x + share * dx), max(origin_y, y + share * dy)
        end = cell_index(end_x, end_y, origin_x, origin_y, resolution, rows, cols)
        if end >= 0:
            clear_line(layer, sensor // cols, sensor % cols, end // cols, end % cols, min_cells, max_cells)


@kernel
def _share(start, delta, low, high):
    """Largest share, at most 1, of ``delta`` that can be gone without leaving ``[low, high]``."""
    if start + delta > high:
        return max(0.0, (high - start) / delta)
    if start + delta < low:
        return (low - start) / delta
    return 1.0


@kernel
def clear_line(layer, row0, col0, row1, col1, min_cells, max_cells):
    """Free a Bresenham line with both ends, but not before ``min_cells`` nor beyond ``max_cells``."""
    length = math.hypot(row1 - row0, col1 - col0)
    if length < min_cells:
        return
    if length > 0:
        row0 += int((row1 - row0) / length * min_cells)
        col0 += int((col1 - col0) / length * min_cells)
    share = min(1.0, max_cells / length) if length > 0 else 1.0
    for step in range(int(share * max(abs(row1 - row0), abs(col1 - col0))) + 1):
        row, col = line_cell(row0, col0, row1, col1, step)
        layer[row, col] = FREE


@kernel
def mark_hits(layer, resolution, origin_x, origin_y, x, y, hits, min_range, max_range, in_cells):
    """Mark the cells of ``hits`` ``(n, 2)`` m as obstacles.

    A range is measured between cells and rounded (ObstacleLayer), or in metres with ``max_range`` itself too far
    (VoxelLayer).
    """
    rows, cols = layer.shape
    sensor_row, sensor_col = int((y - origin_y) / resolution), int((x - origin_x) / resolution)
    min_cells, max_cells = math.ceil(min_range / resolution), math.ceil(max_range / resolution)
    for i in range(len(hits)):
        cell = cell_index(hits[i, 0], hits[i, 1], origin_x, origin_y, resolution, rows, cols)
        if cell < 0:
            continue
        if in_cells:
            distance = int(math.hypot(cell // cols - sensor_row, cell % cols - sensor_col))
            near_enough = min_cells <= distance <= max_cells
        else:
            distance_m = math.hypot(hits[i, 0] - x, hits[i, 1] - y)
            near_enough = min_range <= distance_m < max_range
        if near_enough:
            layer[cell // cols, cell % cols] = LETHAL


@kernel
def clear_footprint(layer, resolution, origin_x, origin_y, x, y, yaw, corners):
    """Free the convex polygon ``corners`` ``(n, 2)`` m placed at a pose, unless a corner is off the map."""
    rows, cols = layer.shape
    cells = np.empty(len(corners), np.int64)
    cos, sin = math.cos(yaw), math.sin(yaw)
    for i in range(len(corners)):
        corner_x = x + corners[i, 0] * cos - corners[i, 1] * sin
        corner_y = y + corners[i, 0] * sin + corners[i, 1] * cos
        cells[i] = cell_index(corner_x, corner_y, origin_x, origin_y, resolution, rows, cols)
        if cells[i] < 0:
            return
    lowest, highest = np.full(cols, rows), np.full(cols, -1)
    for i in range(len(cells)):
        _trace_edge(cells[i - 1], cells[i], cols, lowest, highest)
    for col in range(cols):
        layer[lowest[col] : highest[col] + 1, col] = FREE


@kernel
def _trace_edge(start, end, cols, lowest, highest):
    """Widen the span of rows that an outline covers in every column by one of its edges."""
    row0, col0, row1, col1 = start // cols, start % cols, end // cols, end % cols
    for step in range(max(abs(row1 - row0), abs(col1 - col0)) + 1):
        row, col = line_cell(row0, col0, row1, col1, step)
        lowest[col] = min(lowest[col], row)
        highest[col] = max(highest[col], row)
