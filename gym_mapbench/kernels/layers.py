"""How a layer's grid is written into the master grid of a costmap.

Source: nav2_costmap_2d/src/costmap_layer.cpp, plugins/static_layer.cpp.
"""

from __future__ import annotations

import math

import numpy as np

from gym_mapbench.kernels.geometry import cell_index
from gym_mapbench.kernels.jit import kernel

UNKNOWN = 255
TRUE_OVERWRITE = -1
OVERWRITE = 0
MAX = 1
MAX_WITHOUT_UNKNOWN_OVERWRITE = 2


@kernel
def combine(master, layer, row0, col0, row1, col1, method):
    """Write the cells of ``layer`` in rows ``row0:row1`` and columns ``col0:col1`` into ``master``, same shape.

    Args:
        master: ``(rows, cols)`` uint8, written.
        layer: ``(rows, cols)`` uint8; unknown cells leave the master as it is, except with TRUE_OVERWRITE.
        row0: First row.
        col0: First column.
        row1: Row after the last one.
        col1: Column after the last one.
        method: One of the constants of this module: ``combination_method``, or TRUE_OVERWRITE.
    """
    for row in range(row0, row1):
        combine_row(master[row, col0:col1], layer[row, col0:col1], method)


@kernel
def combine_row(master, layer, method):
    """Write ``layer`` ``(cols,)`` into ``master``; a function of rows without branches, for then it is vectorised."""
    always, overwrites = method == TRUE_OVERWRITE, method == OVERWRITE
    over_unknown = method != MAX_WITHOUT_UNKNOWN_OVERWRITE
    for i in range(len(layer)):
        new, old = layer[i], master[i]
        gives_way = (overwrites | (old < new)) if old != UNKNOWN else over_unknown
        master[i] = new if always | ((new != UNKNOWN) & gives_way) else old


@kernel
def write_map(
    master, resolution, origin_x, origin_y, known, known_resolution, known_x, known_y, frame_x, frame_y, frame_yaw,
    row0, col0, row1, col1, use_maximum,
):  # fmt: skip
    """Look the centres of a window's cells up in the map and write what is there; cells off the map stay.

    Args:
        master: ``(rows, cols)`` uint8, written.
        resolution: Side of a cell of the window, m.
        origin_x: x of the window's lower-left corner in its frame, m.
        origin_y: y of the same corner, m.
        known: ``(rows, cols)`` uint8, the map.
        known_resolution: Side of a cell of the map, m.
        known_x: x of the map's lower-left corner, m.
        known_y: y of the same corner, m.
        frame_x: x of the origin of the window's frame in the map's frame, m.
        frame_y: y of the same origin, m.
        frame_yaw: How far the window's frame is turned, rad.
        row0: First row to write.
        col0: First column.
        row1: Row after the last one.
        col1: Column after the last one.
        use_maximum: Whether the greater cost stays, unknown being the greatest.
    """
    rows, cols = known.shape
    cos, sin = math.cos(frame_yaw), math.sin(frame_yaw)
    for row in range(row0, row1):
        for col in range(col0, col1):
            x, y = origin_x + (col + 0.5) * resolution, origin_y + (row + 0.5) * resolution
            map_x, map_y = cos * x - sin * y + frame_x, sin * x + cos * y + frame_y
            cell = cell_index(map_x, map_y, known_x, known_y, known_resolution, rows, cols)
            if cell >= 0:
                cost = known[cell // cols, cell % cols]
                master[row, col] = max(cost, master[row, col]) if use_maximum else cost


@kernel
def shifted(grid, d_row, d_col, default):
    """Return a grid as seen from a window moved by whole cells; entering cells are ``default`` (``updateOrigin``)."""
    rows, cols = grid.shape
    moved = np.full_like(grid, default)
    first, last = max(0, -d_col), min(cols, cols - d_col)
    if first < last:
        for row in range(max(0, -d_row), min(rows, rows - d_row)):
            copy_row(grid[row + d_row, first + d_col : last + d_col], moved[row, first:last])
    return moved


@kernel
def copy_row(values, copy):
    """Copy ``values`` ``(n,)``; a function of rows, for then it is vectorised."""
    for i in range(len(values)):
        copy[i] = values[i]


@kernel
def cells_in(box, resolution, origin_x, origin_y, rows, cols):
    """First row and column, and row and column after the last, of the cells that ``box`` touches (``updateMap``).

    For an empty box there are none, or one in a corner.
    """
    row0, row1 = enforced(box[1], origin_y, resolution, rows), enforced(box[3], origin_y, resolution, rows)
    col0, col1 = enforced(box[0], origin_x, resolution, cols), enforced(box[2], origin_x, resolution, cols)
    return row0, col0, min(rows, row1 + 1), min(cols, col1 + 1)


@kernel
def enforced(at, origin, resolution, count):
    """Cell of a coordinate along one axis, or the nearest there is (``worldToMapEnforceBounds``)."""
    if at < origin:
        return 0
    return count - 1 if at > resolution * count + origin else int((at - origin) / resolution)
