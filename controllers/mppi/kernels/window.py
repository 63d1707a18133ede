"""The part of the costmap that trajectories can reach, and a fixed-point grid over it."""

from __future__ import annotations

import math

import numpy as np

from gym_mapbench.kernels.jit import kernel

OFF_MAP, LETHAL, INSCRIBED = 255, 254, 253

# Contribution of a cell that ends a trajectory or on which the footprint must be checked; so a sum of at least this
# contains such a cell.
MARKED = np.float32(1e30)
# Bits of the fraction of a fixed-point cell coordinate, and their mask. They are constants, because shifts by a
# variable number take twice the time.
FRACTION_BITS = np.uint32(16)
FRACTION = np.int32(0xFFFF)
UNIT = 65536
# Rounding errors of a fixed-point coordinate before it is cut to an integer, in units of the last place.
ROUNDINGS = 4


@kernel
def write_contributions(near_goal, own, threshold, unknown_is_free, table):
    """Write what a point on a cell of each cost adds to the Cost critic's sum; MARKED where it may collide.

    ``own`` is the record of the critic's parameters.
    """
    for cost in range(256):
        table[cost] = own.critical_cost if cost >= max(own.near_collision_cost, 1) else (0 if near_goal else cost)
        marked = cost == LETHAL or cost >= max(threshold, 1)
        marked |= cost == INSCRIBED and not own.consider_footprint
        marked |= cost == OFF_MAP and not unknown_is_free
        if marked:
            table[cost] = MARKED


@kernel
def clip_span(centre, reach, size):
    """Cut a map of ``size`` cells to those within ``reach`` (cells) of a cell.

    Returns:
        First cell, number of cells, and where ``centre`` lies in the window, whose border is cell 0.
    """
    cells = math.ceil(reach) + 2
    first = min(max(centre - cells, 0), size)
    count = max(min(centre + cells + 1, size) - first, 0)
    return first, count, min(max(centre - first + 1, -cells), count + cells + 1)


@kernel
def rounding_error(coordinate, span, resolution, offset):
    """Bound of the error of a fixed-point cell coordinate against Nav2's arithmetic, in its units.

    Nav2 rounds world coordinates (up to ``coordinate``, m) to float32; here the displacement is scaled and shifted
    within a window of ``span`` (m) in float32. Where Nav2 also looks up cells in float32, ``offset`` is the largest
    distance of a point from the costmap's origin and of that from zero, m; else 0.
    """
    world = 2.0 ** (math.floor(math.log2(max(coordinate, 1e-6))) - 24)
    return math.ceil((world + (span + offset) * ROUNDINGS * 2.0**-24) / resolution * UNIT) + 1


@kernel
def open_window(costs, row_0, col_0, rows, cols, table, window):
    """Translate a part of a costmap into contributions, with a border of points off the map around it.

    Args:
        costs: ``(rows, cols)`` uint8 of the whole costmap.
        row_0: First row of the part.
        col_0: First column.
        rows: Number of rows.
        cols: Number of columns.
        table: ``(256,)`` contribution of each cost.
        window: ``((rows + 2) * (cols + 2),)`` float32, written.
    """
    off_map, stride = table[OFF_MAP], cols + 2
    for row in range(rows + 2):
        base = row * stride
        if 0 < row <= rows:
            window[base] = off_map
            window[base + cols + 1] = off_map
            for col in range(cols):
                window[base + 1 + col] = table[costs[row_0 + row - 1, col_0 + col]]
        else:
            for col in range(stride):
                window[base + col] = off_map


@kernel
def lay_grid(call, reach, shape, single):
    """Choose a window around the robot and a fixed-point grid over it.

    Coordinates are moved a little, so that points near a cell border are those with the smallest fractions. ``single``
    says whether Nav2 looks up cells in float32.

    Returns:
        ``(rows, cols)`` of the window, and the grid and the scale that ``sweep`` takes.
    """
    x, y = (call.x - call.origin_x) / call.resolution, (call.y - call.origin_y) / call.resolution
    col, row = math.floor(x), math.floor(y)
    row_0, rows, at_row = clip_span(row, reach / call.resolution, shape[0])
    col_0, cols, at_col = clip_span(col, reach / call.resolution, shape[1])
    span = (max(rows, cols) + 2) * call.resolution
    furthest = max(abs(call.x), abs(call.y)) + reach
    offset = furthest + max(abs(call.origin_x), abs(call.origin_y)) if single else 0.0
    moved = rounding_error(furthest, span, call.resolution, offset)
    base_x, base_y = (call.base_x - call.origin_x) / call.resolution, (call.base_y - call.origin_y) / call.resolution
    start_x, start_y = (base_x - col + at_col) * UNIT + moved, (base_y - row + at_row) * UNIT + moved
    grid = ((cols + 1) * UNIT, (rows + 1) * UNIT, cols + 2, 2 * moved + 1, row_0, col_0, shape[0], shape[1], single)
    return (rows, cols), grid, (UNIT / call.resolution, start_x, start_y)
