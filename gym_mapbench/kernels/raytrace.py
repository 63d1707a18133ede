"""Lines of cells, and the box of what they touch.

Source: nav2_costmap_2d/include/nav2_costmap_2d/costmap_2d.hpp, plugins/obstacle_layer.cpp (``updateRaytraceBounds``).
"""

from __future__ import annotations

import math

import numpy as np

from gym_mapbench.kernels.jit import kernel

SURELY = 0.999
"""Share of a squared range within which no rounding hides that a point lies beyond the range."""


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
def write_line(cells, width, row0, col0, row1, col1, share, value):
    """Write ``value`` into the cells of Bresenham's line, both ends included, along a share of its longer axis.

    ``cells`` are flat, of rows ``width`` cells long, and indexed unsigned: numba would check signed indices.
    """
    along, aside = abs(col1 - col0), abs(row1 - row0)
    step, side_step = 1 if col1 > col0 else -1, width if row1 > row0 else -width
    if aside > along:
        along, aside, step, side_step = aside, along, side_step, step
    cell, error = row0 * width + col0, along // 2
    for _ in range(int(share * along) + 1):
        cells[np.uint64(cell)] = value
        over = error + aside - along
        cell += step + (side_step if over >= 0 else 0)
        error = over if over >= 0 else error + aside


@kernel
def touch(box, x, y):
    """Widen ``box`` (least x, least y, largest x, largest y, m) to hold a point."""
    box[0], box[1] = min(box[0], x), min(box[1], y)
    box[2], box[3] = max(box[2], x), max(box[3], y)


@kernel
def touch_ray(box, x, y, end_x, end_y, min_range, max_range):
    """Widen ``box`` to hold the end of a ray, or the point ``max_range`` (m) along it if that is nearer."""
    dx, dy = end_x - x, end_y - y
    if min_range == 0.0 and dx * dx + dy * dy < SURELY * max_range * max_range:
        touch(box, x + dx, y + dy)
        return
    distance = math.hypot(dx, dy)
    if distance >= min_range:
        share = max_range / distance if distance > max_range else 1.0
        touch(box, x + dx * share, y + dy * share)


@kernel
def cells_of(distance, resolution):
    """How many cells a distance (m) spans at most (``cellDistance``)."""
    return int(max(0.0, math.ceil(distance / resolution)))
