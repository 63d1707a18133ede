"""What one scan does to a two-dimensional obstacle layer: rays clear, hits mark.

Source: nav2_costmap_2d/plugins/obstacle_layer.cpp, include/nav2_costmap_2d/costmap_2d.hpp.
"""

from __future__ import annotations

import math

import numpy as np

from gym_mapbench.kernels.geometry import cell_index
from gym_mapbench.kernels.jit import kernel
from gym_mapbench.kernels.raytrace import cells_of, touch, touch_ray, write_line

FREE = 0
LETHAL = 254
INSIDE = 0.001


@kernel
def clear_rays(layer, resolution, origin_x, origin_y, x, y, points, min_range, max_range, box):
    """Free the cells from the sensor at ``x``, ``y`` (m) to every one of ``points`` ``(n, 2)`` float32 m.

    A ray that leaves the grid is cut at its border; ranges are rounded up to whole cells.
    """
    (rows, cols), cells = layer.shape, layer.ravel()
    sensor = cell_index(x, y, origin_x, origin_y, resolution, rows, cols)
    if sensor < 0:
        return
    touch(box, x, y)
    min_cells, max_cells = cells_of(min_range, resolution), cells_of(max_range, resolution)
    for i in range(len(points)):
        end_x, end_y = cut_ray(x, y, points[i], origin_x, origin_y, cols * resolution, rows * resolution)
        end = cell_index(end_x, end_y, origin_x, origin_y, resolution, rows, cols)
        if end >= 0:
            clear_line(cells, cols, sensor // cols, sensor % cols, end // cols, end % cols, min_cells, max_cells)
            touch_ray(box, x, y, end_x, end_y, min_range, max_range)


@kernel
def cut_ray(x, y, point, origin_x, origin_y, width, height):
    """Where a ray to ``point`` ends inside the grid, one border after the other as Nav2 takes them."""
    end_x, end_y = float(point[0]), float(point[1])
    dx, dy = end_x - x, end_y - y
    if end_x < origin_x:
        end_x, end_y = origin_x, y + dy * ((origin_x - x) / dx)
    if end_y < origin_y:
        end_x, end_y = x + dx * ((origin_y - y) / dy), origin_y
    if end_x > origin_x + width:
        end_x, end_y = origin_x + width - INSIDE, y + dy * ((origin_x + width - x) / dx)
    if end_y > origin_y + height:
        end_x, end_y = x + dx * ((origin_y + height - y) / dy), origin_y + height - INSIDE
    return end_x, end_y


@kernel
def clear_line(cells, width, row0, col0, row1, col1, min_cells, max_cells):
    """Free a Bresenham line with both ends, but not before ``min_cells`` nor beyond ``max_cells``."""
    d_row, d_col, row, col, share = row1 - row0, col1 - col0, row0, col0, 1.0
    if min_cells > 0 or d_row * d_row + d_col * d_col > max_cells * max_cells:
        length = math.hypot(d_col, d_row)
        if length < min_cells:
            return
        if length > 0.0:
            row, col = int(row0 + d_row / length * min_cells), int(col0 + d_col / length * min_cells)
            share = min(1.0, max_cells / length)
    write_line(cells, width, row, col, row1, col1, share, np.uint8(FREE))


@kernel
def mark_hits(layer, resolution, origin_x, origin_y, x, y, points, min_range, max_range, in_meters, box):
    """Mark the cells of ``points`` ``(n, 2)`` float32 m as obstacles.

    The distance is counted in cells, rounded down, against ranges rounded up to cells; with ``in_meters``
    (Jazzy) the ranges must also hold in metres.
    """
    rows, cols = layer.shape
    sensor = cell_index(x, y, origin_x, origin_y, resolution, rows, cols)
    if sensor < 0:
        return
    sensor_row, sensor_col = sensor // cols, sensor % cols
    min_cells, max_cells = cells_of(min_range, resolution), cells_of(max_range, resolution)
    for i in range(len(points)):
        hit_x, hit_y = float(points[i, 0]), float(points[i, 1])
        cell = cell_index(hit_x, hit_y, origin_x, origin_y, resolution, rows, cols)
        squared = (hit_x - x) * (hit_x - x) + (hit_y - y) * (hit_y - y)
        if cell < 0 or (in_meters and not min_range * min_range <= squared <= max_range * max_range):
            continue
        row, col = cell // cols, cell % cols
        in_cells = (row - sensor_row) * (row - sensor_row) + (col - sensor_col) * (col - sensor_col)
        if min_cells <= int(math.sqrt(in_cells)) <= max_cells:
            layer[row, col] = LETHAL
            touch(box, hit_x, hit_y)
