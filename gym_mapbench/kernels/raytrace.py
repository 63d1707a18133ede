"""Lines of cells, and the box of what they touch.

Source: nav2_costmap_2d/include/nav2_costmap_2d/costmap_2d.hpp, plugins/obstacle_layer.cpp (``updateRaytraceBounds``).
"""

from __future__ import annotations

import math

from gym_mapbench.kernels.jit import kernel


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
def touch(box, x, y):
    """Widen ``box`` (least x, least y, largest x, largest y, m) to hold a point."""
    box[0], box[1] = min(box[0], x), min(box[1], y)
    box[2], box[3] = max(box[2], x), max(box[3], y)


@kernel
def touch_ray(box, x, y, end_x, end_y, min_range, max_range):
    """Widen ``box`` to hold the end of a ray, or the point ``max_range`` (m) along it if that is nearer."""
    dx, dy = end_x - x, end_y - y
    distance = math.hypot(dx, dy)
    if distance >= min_range:
        share = max_range / distance if distance > max_range else 1.0
        touch(box, x + dx * share, y + dy * share)


@kernel
def cells_of(distance, resolution):
    """How many cells a distance (m) spans at most (``cellDistance``)."""
    return int(max(0.0, math.ceil(distance / resolution)))
