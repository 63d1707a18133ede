"""How small groups of obstacle cells are removed from a costmap.

Source: nav2_costmap_2d/plugins/denoise_layer.cpp, include/nav2_costmap_2d/denoise/image_processing.hpp.
"""

from __future__ import annotations

import numpy as np

from gym_mapbench.kernels.jit import kernel

FREE = 0
INSCRIBED = 253
LETHAL = 254
UNKNOWN = 255


@kernel
def is_obstacle(cost, unknown_is_obstacle):
    """Whether a cell of this cost belongs to a group."""
    return INSCRIBED <= cost <= LETHAL or (cost == UNKNOWN and unknown_is_obstacle)


@kernel
def remove_isolated(master, diagonal, unknown_is_obstacle, row0, col0, row1, col1):
    """Free the obstacle cells in rows ``row0:row1`` and columns ``col0:col1`` without an obstacle cell beside them.

    Args:
        master: ``(rows, cols)`` uint8, written.
        diagonal: Whether a cell has eight neighbours rather than four; those outside the range do not count.
        unknown_is_obstacle: Whether a cost of 255 is an obstacle as well.
        row0: First row.
        col0: First column.
        row1: Row after the last one.
        col1: Column after the last one.
    """
    for row in range(row0, row1):
        for col in range(col0, col1):
            if not is_obstacle(master[row, col], unknown_is_obstacle):
                continue
            alone = True
            for near_row in range(max(row - 1, row0), min(row + 2, row1)):
                for near_col in range(max(col - 1, col0), min(col + 2, col1)):
                    beside = diagonal or near_row == row or near_col == col
                    itself = near_row == row and near_col == col
                    if beside and not itself and is_obstacle(master[near_row, near_col], unknown_is_obstacle):
                        alone = False
            if alone:
                master[row, col] = FREE


@kernel
def remove_groups(master, smallest, diagonal, unknown_is_obstacle, row0, col0, row1, col1):
    """Free the groups of fewer than ``smallest`` obstacle cells in rows ``row0:row1`` and columns ``col0:col1``.

    Args:
        master: ``(rows, cols)`` uint8, written.
        smallest: Cells of the smallest group that stays; cells outside the range do not count.
        diagonal: Whether cells that touch at a corner belong to one group.
        unknown_is_obstacle: Whether a cost of 255 is an obstacle as well.
        row0: First row.
        col0: First column.
        row1: Row after the last one.
        col1: Column after the last one.
    """
    width = col1 - col0
    seen = np.zeros((row1 - row0, width), np.bool_)
    group = np.empty((row1 - row0) * width, np.int64)
    for row in range(row0, row1):
        for col in range(col0, col1):
            if seen[row - row0, col - col0] or not is_obstacle(master[row, col], unknown_is_obstacle):
                continue
            size = collect_group(master, seen, group, row, col, diagonal, unknown_is_obstacle, row0, col0, row1, col1)
            if size < smallest:
                for i in range(size):
                    master[row0 + group[i] // width, col0 + group[i] % width] = FREE


@kernel
def collect_group(master, seen, group, row, col, diagonal, unknown_is_obstacle, row0, col0, row1, col1):
    """Write the cells of the group of one cell into ``group``, as flat indices within the range; return how many."""
    width = col1 - col0
    seen[row - row0, col - col0] = True
    group[0] = (row - row0) * width + col - col0
    size = 1
    looked_at = 0
    while looked_at < size:
        here_row, here_col = row0 + group[looked_at] // width, col0 + group[looked_at] % width
        looked_at += 1
        for near_row in range(max(here_row - 1, row0), min(here_row + 2, row1)):
            for near_col in range(max(here_col - 1, col0), min(here_col + 2, col1)):
                beside = diagonal or near_row == here_row or near_col == here_col
                if (
                    beside
                    and not seen[near_row - row0, near_col - col0]
                    and is_obstacle(master[near_row, near_col], unknown_is_obstacle)
                ):
                    seen[near_row - row0, near_col - col0] = True
                    group[size] = (near_row - row0) * width + near_col - col0
                    size += 1
    return size
