"""Obstacles of a map: connected groups of occupied cells inside its frame."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from gym_mapbench.world.gridmap import GridMap

Cells = NDArray[np.bool_]
DIAGONAL = np.ones((3, 3), dtype=np.int8)
"""Cells that touch at a corner belong to one obstacle."""
SMALLEST_CELLS = 2
"""An obstacle of this extent, in cells, is not cut further."""


def frame_of(occupancy: Cells) -> Cells:
    """Return the frame: the wholly occupied rows and columns at the edges of the map."""
    frame = np.zeros_like(occupancy)
    frame[: _full(occupancy)] = True
    frame[len(frame) - _full(occupancy[::-1]) :] = True
    frame[:, : _full(occupancy.T)] = True
    frame[:, frame.shape[1] - _full(occupancy.T[::-1]) :] = True
    return frame


def obstacles_of(grid: GridMap) -> list[Cells]:
    """Return the obstacles inside the frame, each as ``(rows, cols)`` bool, in the order of their first cells."""
    return connected(grid.occupancy & ~frame_of(grid.occupancy))


def connected(cells: Cells) -> list[Cells]:
    """Return the connected groups of some cells, each as ``(rows, cols)`` bool, in the order of their first cells."""
    from scipy import ndimage

    labels, count = ndimage.label(cells, DIAGONAL)
    return [labels == number for number in range(1, count + 1)]


def farthest_first(obstacles: Sequence[Cells], grid: GridMap, paths: Sequence[NDArray[np.float64]]) -> list[Cells]:
    """Return the obstacles by their distance from the driven paths, the largest first.

    Args:
        obstacles: The obstacles.
        grid: Their map.
        paths: ``(n, >= 2)`` x, y of each path, m.
    """
    from scipy import ndimage

    driven = np.zeros(grid.shape, dtype=np.bool_)
    for path in paths:
        for x, y in path[:, :2]:
            cell = grid.world_to_cell(x, y)
            if cell is not None:
                driven[cell] = True
    distances = ndimage.distance_transform_edt(~driven)
    return sorted(obstacles, key=lambda cells: -float(distances[cells].min()))


def map_with(grid: GridMap, obstacles: Iterable[Cells]) -> GridMap:
    """Return the map with its frame and these obstacles only."""
    occupancy = grid.occupancy & frame_of(grid.occupancy)
    for cells in obstacles:
        occupancy = occupancy | cells
    return GridMap(occupancy, grid.resolution, grid.origin, grid.unknown)


def halves(cells: Cells) -> Iterator[Cells]:
    """Yield the two halves of an obstacle, cut across its longer side; nothing if it is too small."""
    rows, cols = (np.flatnonzero(cells.any(axis=axis)) for axis in (1, 0))
    along = 0 if np.ptp(rows) >= np.ptp(cols) else 1
    taken = rows if along == 0 else cols
    if len(taken) <= SMALLEST_CELLS:
        return
    first = np.zeros_like(cells)
    place = [slice(None), slice(None)]
    place[along] = slice(0, int(taken[len(taken) // 2]))
    first[tuple(place)] = True
    yield cells & first
    yield cells & ~first


def _full(lines: Cells) -> int:
    """Return the number of wholly occupied lines at the beginning."""
    full = lines.all(axis=1)
    return int(full.size) if full.all() else int(np.argmin(full))
