"""Obstacles of a map: connected groups of occupied cells inside its frame.

An obstacle is the list of its cells, since a scanned map of 2000 x 2000 cells has thousands of specks.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from gym_mapbench.world.gridmap import GridMap

Cells = NDArray[np.bool_]
Obstacle = NDArray[np.int64]
"""``(n, 2)`` row and column of its cells, in the order of rows."""
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


def obstacles_of(grid: GridMap) -> list[Obstacle]:
    """Return the obstacles inside the frame, in the order of their first cells."""
    return connected(np.argwhere(grid.occupancy & ~frame_of(grid.occupancy)))


def connected(cells: Obstacle) -> list[Obstacle]:
    """Return the connected groups of some cells, in the order of their first cells."""
    from scipy import ndimage

    if not len(cells):
        return []
    places = tuple((cells - cells.min(axis=0)).T)
    occupied = np.zeros(np.ptp(cells, axis=0) + 1, dtype=np.bool_)
    occupied[places] = True
    labels, count = ndimage.label(occupied, DIAGONAL)
    of_cell = labels[places]
    ends = np.cumsum(np.bincount(of_cell, minlength=count + 1)[1:])
    return np.split(cells[np.argsort(of_cell, kind="stable")], ends[:-1])


def farthest_first(
    obstacles: Sequence[Obstacle], grid: GridMap, paths: Sequence[NDArray[np.float64]]
) -> list[Obstacle]:
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
    return sorted(obstacles, key=lambda cells: -float(distances[tuple(cells.T)].min()))


def map_with(grid: GridMap, obstacles: Iterable[Obstacle]) -> GridMap:
    """Return the map with its frame and these obstacles only."""
    occupancy = frame_of(grid.occupancy)
    for cells in obstacles:
        occupancy[tuple(cells.T)] = True
    return grid.with_walls(occupancy)


def halves(cells: Obstacle) -> Iterator[Obstacle]:
    """Yield the two halves of an obstacle, cut across its longer side; nothing if it is too small."""
    rows, cols = map(np.unique, cells.T)
    along, taken = (0, rows) if np.ptp(rows) >= np.ptp(cols) else (1, cols)
    if len(taken) <= SMALLEST_CELLS:
        return
    first = cells[:, along] < taken[len(taken) // 2]
    yield cells[first]
    yield cells[~first]


def _full(lines: Cells) -> int:
    """Return the number of wholly occupied lines at the beginning."""
    full = lines.all(axis=1)
    return int(full.size) if full.all() else int(np.argmin(full))
