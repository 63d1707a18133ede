"""What one scan does to a voxel layer: rays clear columns of voxels, hits mark them.

A column is one integer: bit ``level`` of its low half is set where a voxel is unknown or marked, bit
``16 + level`` where it is marked.

Source: nav2_costmap_2d/plugins/voxel_layer.cpp, nav2_voxel_grid/include/nav2_voxel_grid/voxel_grid.hpp.
"""

from __future__ import annotations

import math

import numpy as np

from gym_mapbench.kernels.geometry import cell_index
from gym_mapbench.kernels.jit import kernel
from gym_mapbench.kernels.raytrace import cells_of, touch, touch_ray, write_line

FREE = 0
LETHAL = 254
UNKNOWN = 255
HALF = 16
UNKNOWN_COLUMN = 0xFFFF
VOXEL = 0x10001
PULLED_IN = 1e-5
UNDER_TOP = 0.01
"""How far below the top a ray ends that leaves through it, m."""


@kernel
def clear_voxels(
    layer, columns, resolution, origin_x, origin_y, size, z_resolution, origin_z, levels, sensor, points, z,
    mark_threshold, unknown_threshold, min_range, max_range, pull_in, box,
):  # fmt: skip
    """Free the voxels from the sensor ``(3,)`` m towards every one of ``points`` ``(n, 2)`` float32 m at height ``z``.

    Every ray ends two cells before its point and is then cut at the origin and at the origin plus ``size`` (x, y; m),
    and half a voxel below the top; a cut ray that rounding leaves outside is lost, unless it is pulled in a little
    (``pull_in``, Jazzy).
    """
    rows, cols = layer.shape
    grid = origin_x, origin_y, origin_z, resolution, z_resolution, cols, rows, levels
    cells, voxels, crossed = layer.ravel(), columns.ravel(), np.zeros(layer.size, np.uint8)
    start = voxel_at(sensor, grid)
    if start[0] < 0.0:
        return
    min_cells, max_cells = cells_of(min_range, resolution), cells_of(max_range, resolution)
    for i in range(len(points)):
        ray_end = cut_ray(sensor, (float(points[i, 0]), float(points[i, 1]), z), grid, size, pull_in)
        end = voxel_at(ray_end, grid)
        if end[0] >= 0.0:
            # Unpacked tuples would take a fifth of the time of all.
            clear_voxel_line(
                cells, voxels, crossed, cols, start[0], start[1], start[2], end[0], end[1], end[2],
                mark_threshold, unknown_threshold, min_cells, max_cells,
            )  # fmt: skip
            touch_ray(box, sensor[0], sensor[1], ray_end[0], ray_end[1], min_range, max_range)
    for cell in range(np.uint64(len(cells))):
        if crossed[cell]:
            clear_voxel(cells, voxels, cell, int(start[2]), mark_threshold, unknown_threshold)


@kernel
def voxel_at(point, grid):
    """Column, row and level of a point (m), continuous; all -1 off the grid (``worldToMap3DFloat``)."""
    origin_x, origin_y, origin_z, resolution, z_resolution, cols, rows, levels = grid
    col, row = (point[0] - origin_x) / resolution, (point[1] - origin_y) / resolution
    level = (point[2] - origin_z) / z_resolution
    # Written so that a NaN, from a ray that rounding has shortened to nothing, is off the grid, too.
    on_grid = point[0] >= origin_x and point[1] >= origin_y and point[2] >= origin_z
    if on_grid and col < cols and row < rows and level < levels:
        return col, row, level
    return -1.0, -1.0, -1.0


@kernel
def cut_ray(sensor, point, grid, size, pull_in):
    """Where the ray to a point ends, m: two cells before it, and where it leaves the grid."""
    origin_x, origin_y, origin_z, resolution = grid[0], grid[1], grid[2], grid[3]
    x_max, y_max, z_max = origin_x + size[0], origin_y + size[1], origin_z + (grid[7] - 0.5) * grid[4]
    x, y, height = sensor[0], sensor[1], sensor[2]
    dx, dy, dz = point[0] - x, point[1] - y, point[2] - height
    distance = math.sqrt(dx * dx + dy * dy + dz * dz)
    share = max(min(1.0, (distance - 2 * resolution) / distance), 0.0)
    end_x, end_y, end_z = share * dx + x, share * dy + y, share * dz + height
    dx, dy, dz = end_x - x, end_y - y, end_z - height
    share = min(cut(x, dx, end_x, origin_x, x_max), cut(y, dy, end_y, origin_y, y_max))
    outside = end_x < origin_x or end_y < origin_y or end_x > x_max or end_y > y_max
    if not origin_z <= end_z <= z_max:
        share, outside = min(share, cut_at_height(height, dz, end_z, origin_z, z_max)), True
    if pull_in and share != 0.0 and outside:
        share -= math.copysign(PULLED_IN, share)
    return x + dx * share, y + dy * share, height + dz * share


@kernel
def cut(start, delta, end, low, high):
    """Share of ``delta``, at most 1, that leads from ``start`` to the border that ``end`` lies beyond."""
    if end < low:
        return min(1.0, (low - start) / delta)
    if end > high:
        return min(1.0, (high - start) / delta)
    return 1.0


@kernel
def cut_at_height(start, delta, end, low, high):
    """As :func:`cut` for heights: a ray through the top ends below it, and does not turn back."""
    if end > high:
        return max(0.0, min(1.0, (high - UNDER_TOP - start) / delta))
    return min(1.0, (low - start) / delta)


@kernel
def clear_voxel_line(
    layer, columns, crossed, width, col0, row0, level0, col1, row1, level1,
    mark_threshold, unknown_threshold, min_cells, max_cells,
):  # fmt: skip
    """Free a Bresenham line of voxels between two points in continuous cells, both ends included.

    A line in one level is only written into ``crossed``: rays share many cells, and clearing a voxel takes longer.
    All arrays are flat, of rows ``width`` cells long, and indexed unsigned.
    """
    d_col, d_row, d_level = col1 - col0, row1 - row0, level1 - level0
    length, level = math.sqrt(d_col * d_col + d_row * d_row + d_level * d_level), int(level0)
    if int(length) < min_cells:
        return
    share = max_cells / length if length > max_cells else 1.0
    if min_cells > 0:
        col0, row0 = col0 + d_col / length * min_cells, row0 + d_row / length * min_cells
        level0 = level0 + d_level / length * min_cells
    if int(level0) == level == int(level1):
        write_line(crossed, width, int(row0), int(col0), int(row1), int(col1), share, np.uint8(1))
        return
    col, row, level = int(col0), int(row0), int(level0)
    cols, rows, levels = abs(int(col1) - col), abs(int(row1) - row), abs(int(level1) - level)
    step_col, step_row = 1 if int(col1) > col else -1, 1 if int(row1) > row else -1
    step_level = 1 if int(level1) > level else -1
    step_row *= width
    cell = row * width + col
    longest = max(cols, rows, levels)
    col_error = row_error = level_error = longest // 2
    for _ in range(int(share * longest) + 1):
        clear_voxel(layer, columns, np.uint64(cell), level, mark_threshold, unknown_threshold)
        col_error += cols
        row_error += rows
        level_error += levels
        if col_error >= longest:
            cell += step_col
            col_error -= longest
        if row_error >= longest:
            cell += step_row
            row_error -= longest
        if level_error >= longest:
            level += step_level
            level_error -= longest


@kernel
def clear_voxel(layer, columns, cell, level, mark_threshold, unknown_threshold):
    """Free one voxel, and its cell if at most the threshold of the column's voxels are still marked."""
    column = columns[cell] & ~(VOXEL << level)
    columns[cell] = column
    marked = column >> HALF
    if marked == 0 or bits(marked) <= mark_threshold:
        # At most 15 are unknown, now that one is not; counting them takes most of the time.
        known = unknown_threshold >= HALF - 1 or bits(marked ^ (column & UNKNOWN_COLUMN)) <= unknown_threshold
        layer[cell] = FREE if known else UNKNOWN


@kernel
def bits(number):
    """How many of the 16 bits of a number are set."""
    number = number - ((number >> 1) & 0x5555)
    number = (number & 0x3333) + ((number >> 2) & 0x3333)
    number = (number + (number >> 4)) & 0x0F0F
    return (number + (number >> 8)) & 0x1F


@kernel
def mark_voxels(
    layer, columns, resolution, origin_x, origin_y, sensor, points, z, level, mark_threshold, min_range, max_range, box
):
    """Mark the voxels of ``points`` ``(n, 2)`` float32 m at height ``z`` (m), which lies in ``level`` of the columns.

    Ranges are in metres, and ``max_range`` itself is too far.
    """
    rows, cols = layer.shape
    for i in range(len(points)):
        hit_x, hit_y = float(points[i, 0]), float(points[i, 1])
        dx, dy, dz = hit_x - sensor[0], hit_y - sensor[1], z - sensor[2]
        squared = dx * dx + dy * dy + dz * dz
        cell = cell_index(hit_x, hit_y, origin_x, origin_y, resolution, rows, cols)
        if cell < 0 or squared >= max_range * max_range or squared < min_range * min_range:
            continue
        row, col = cell // cols, cell % cols
        columns[row, col] |= VOXEL << level
        if bits(columns[row, col] >> HALF) > mark_threshold:
            layer[row, col] = LETHAL
            touch(box, hit_x, hit_y)
