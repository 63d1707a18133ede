"""How a keepout mask is written into the master grid of a costmap.

Source: nav2_costmap_2d/plugins/costmap_filters/keepout_filter.cpp.
"""

from __future__ import annotations

import math

from gym_mapbench.kernels.geometry import cell_index
from gym_mapbench.kernels.jit import kernel
from gym_mapbench.kernels.layers import UNKNOWN

NO_OVERRIDE = -1


@kernel
def write_mask(
    master, resolution, origin_x, origin_y, mask, mask_resolution, mask_x, mask_y, frame_x, frame_y, frame_yaw,
    row0, col0, row1, col1, override,
):  # fmt: skip
    """Raise the costs of a window to those of the mask at the centres of its cells; cells off the mask stay.

    Args:
        master: ``(rows, cols)`` uint8, written.
        resolution: Side of a cell of the window, m.
        origin_x: x of the window's lower-left corner in its frame, m.
        origin_y: y of the same corner, m.
        mask: ``(rows, cols)`` uint8 costs; unknown cells leave the window as it is.
        mask_resolution: Side of a cell of the mask, m.
        mask_x: x of the mask's lower-left corner, m.
        mask_y: y of the same corner, m.
        frame_x: x of the origin of the window's frame in the mask's frame, m.
        frame_y: y of the same origin, m.
        frame_yaw: How far the window's frame is turned, rad.
        row0: First row to write.
        col0: First column.
        row1: Row after the last one.
        col1: Column after the last one.
        override: Cost to write instead of the mask's; NO_OVERRIDE for the mask's.
    """
    rows, cols = mask.shape
    cos, sin = math.cos(frame_yaw), math.sin(frame_yaw)
    for row in range(row0, row1):
        for col in range(col0, col1):
            x, y = origin_x + (col + 0.5) * resolution, origin_y + (row + 0.5) * resolution
            at_x, at_y = cos * x - sin * y + frame_x, sin * x + cos * y + frame_y
            cell = cell_index(at_x, at_y, mask_x, mask_y, mask_resolution, rows, cols)
            if cell < 0:
                continue
            new, old = mask[cell // cols, cell % cols], master[row, col]
            if new != UNKNOWN and (new > old or old == UNKNOWN):
                master[row, col] = new if override == NO_OVERRIDE else override
