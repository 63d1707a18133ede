"""Difficulty of a map without a run: the measures of BARN, the narrowest passage, and whether the map is solvable.

Source: Perille et al., "Benchmarking Metric Ground Navigation", 2020, for closest obstacle, average
visibility, dispersion, characteristic dimension and tortuosity: averages along a shortest path in
the configuration space, i.e. where the robot's centre can be. Lengths are in m, not in cells.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gym_mapbench.kernels.configuration import connects, stamp_footprint
from gym_mapbench.kernels.distance import distance_along_columns, framed_distance
from gym_mapbench.kernels.passages import ends_are_open, joins, open_cells, wall_points
from gym_mapbench.kernels.pathmeasures import descend, measure_path
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.robot import RobotSpec
from gym_mapbench.world.scenario import Scenario

Cells = NDArray[np.bool_]
Cell = tuple[int, int]

DISPERSION_RADIUS: Final = 0.45
"""BARN's three cells of 0.15 m."""

_TOUCHING: Final = 1e-9
"""Overlaps below this (m, or cells) are rounding errors."""

MEASURES: Final = (
    "occupied_share",
    "solvable",
    "path_length",
    "narrowest_passage",
    "closest_obstacle",
    "average_visibility",
    "dispersion",
    "characteristic_dimension",
    "tortuosity",
)
"""Names of all measures, in the order of :func:`measure_map`."""


def measure_map(scenario: Scenario, robot: RobotSpec) -> dict[str, float]:
    """Measure a map with its task for one robot.

    Args:
        scenario: Map, start and goal; unknown cells count as free, the map's edge as a wall.
        robot: A disc, or a polygon that may turn on the spot.

    Returns:
        By name, see :data:`MEASURES`: ``occupied_share`` of all cells; ``solvable`` 1 or 0; ``path_length``
        of a shortest path, m; ``narrowest_passage``, the width of the narrowest place on the widest way from
        start to goal, m, whatever the robot's size (0 where there is no way); BARN's five, nan where the map
        is not solvable: ``closest_obstacle``, ``average_visibility``, ``characteristic_dimension`` in m,
        ``dispersion`` a count, ``tortuosity`` a ratio.
    """
    grid = scenario.map
    start, goal = scenario.end_cells
    measures = dict.fromkeys(MEASURES, math.nan)
    measures["occupied_share"] = occupied_share(grid)
    measures["narrowest_passage"] = narrowest_passage(grid, start, goal)
    path, blocked = find_path(configuration_space(grid, robot), start, goal)
    measures["solvable"] = float(len(path) > 0)
    if measures["solvable"]:
        measures |= _path_measures(blocked, path, grid.resolution)
    return measures


def occupied_share(grid: GridMap) -> float:
    """Return the occupied share of all cells, 0..1."""
    return float(grid.occupancy.mean())


def n_obstacles(grid: GridMap) -> float:
    """Return the number of obstacles: pieces of walls whose cells touch at a side or a corner."""
    from scipy.ndimage import label

    return float(label(grid.occupancy, structure=np.ones((3, 3)))[1])


def narrowest_passage(grid: GridMap, start: Cell, goal: Cell) -> float:
    """Return the width of the narrowest place on the widest way between two cells' middles, m; 0 if there is none.

    Start and goal count as places.
    """
    walls, ends = wall_points(grid.occupancy), 2 * np.array([start, goal]) + 1
    widest = _largest(lambda square: ends_are_open(walls, square, ends), len(walls) ** 2)
    if widest > 0 and not joins(walls, widest, ends):
        widest = _largest(lambda square: joins(walls, square, ends), widest)
    return math.sqrt(widest) * grid.resolution


def _largest(holds: Callable[[int], bool], too_large: int) -> int:
    """Return the largest square that something holds for, as it does for all smaller ones; 0 if for none.

    Args:
        holds: Whether it holds for a square.
        too_large: A square that it does not hold for.
    """
    largest = 0
    while too_large - largest > 1:
        halfway = round((math.sqrt(largest) + math.sqrt(too_large)) ** 2 / 4)
        square = min(max(halfway, largest + 1), too_large - 1)
        largest, too_large = (square, too_large) if holds(square) else (largest, square)
    return largest


def configuration_space(grid: GridMap, robot: RobotSpec) -> Cells:
    """Return the cells in whose middle the robot's centre can be.

    Returns:
        ``(1, rows, cols)`` bool for a disc; for a polygon ``(16, rows, cols)``, headings every 22.5 degrees.
    """
    if robot.footprint is None:
        return open_cells(wall_points(grid.occupancy), _room(robot.radius, grid.resolution), grid.shape[1])[None]  # type: ignore[no-any-return]
    reach = math.ceil(robot.circumscribed_radius / grid.resolution) + 1
    occupied = np.pad(grid.occupancy, reach, constant_values=True)
    blocked = np.empty((16, *occupied.shape), dtype=np.bool_)
    for heading, offsets in enumerate(_turned(robot.footprint, grid.resolution)):
        stamp_footprint(occupied, offsets, blocked[heading])
    return ~blocked[:, reach:-reach, reach:-reach]


def _room(radius: float, resolution: float) -> int:
    """Return the smallest square of half cells whose root is a disc's radius, m, or more."""
    least = math.floor((max(radius - _TOUCHING, 0.0) / (resolution / 2)) ** 2)
    while math.sqrt(least) * (resolution / 2) < radius - _TOUCHING:
        least += 1
    return least


@lru_cache(maxsize=16)
def _turned(footprint: tuple[tuple[float, float], ...], resolution: float) -> tuple[NDArray[np.int64], ...]:
    """Return the cells of a footprint for all 16 headings."""
    return tuple(footprint_cells(np.asarray(footprint), heading * math.pi / 8, resolution) for heading in range(16))


def footprint_cells(corners: NDArray[np.float64], yaw: float, resolution: float) -> NDArray[np.int64]:
    """Return the cells that a convex polygon overlaps when its origin is in the middle of cell (0, 0).

    Args:
        corners: ``(n, 2)`` m, in order.
        yaw: Its heading, rad.
        resolution: Side of a cell, m.

    Returns:
        ``(k, 2)`` row and col; cells that are only touched do not count.
    """
    cos, sin = math.cos(yaw), math.sin(yaw)
    polygon = corners @ np.array([[cos, sin], [-sin, cos]]) / resolution
    reach = math.ceil(np.abs(polygon).max()) + 1
    row, col = (axis.ravel() for axis in np.mgrid[-reach : reach + 1, -reach : reach + 1])
    squares = np.stack([col, row], axis=1)[:, None] + np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
    edges = np.roll(polygon, -1, axis=0) - polygon
    normals = np.vstack([np.stack([edges[:, 1], -edges[:, 0]], axis=1), np.eye(2)])
    overlap = np.ones(len(row), dtype=np.bool_)
    for normal in normals:  # two convex shapes are apart if one of their normals separates them
        ours, theirs = polygon @ normal, squares @ normal
        gap = _TOUCHING * np.hypot(*normal)
        overlap &= (theirs.max(axis=1) > ours.min() + gap) & (theirs.min(axis=1) < ours.max() - gap)
    return np.stack([row[overlap], col[overlap]], axis=1)


def find_path(free: Cells, start: Cell, goal: Cell) -> tuple[NDArray[np.int64], Cells]:
    """Find a shortest path over the cells on which a robot fits in some heading, if it gets from cell to cell.

    Args:
        free: From :func:`configuration_space`; released before the path is looked for, if nobody else holds it.
        start: Row and col; the robot may have any heading there.
        goal: The same.

    Returns:
        ``(n, 2)`` row and col of the path, both ends included, empty if the robot does not get there; and
        ``(rows + 2, cols + 2)`` the other cells, in a frame, in which the path's cells are one row and one col further.
    """
    blocked, connected = _framed(free), len(free) == 1 or connects(free, *start, *goal)
    del free
    (row, col), (goal_row, goal_col) = np.add(start, 1).tolist(), np.add(goal, 1).tolist()
    if not connected or blocked[row, col] or blocked[goal_row, goal_col]:
        return np.empty((0, 2), np.int64), blocked
    distance = framed_distance(blocked, goal_row, goal_col)
    reached = math.isfinite(distance[row, col])
    return (descend(distance, row, col) if reached else np.empty((0, 2), np.int64)), blocked


def _framed(free: Cells) -> Cells:
    """Return the cells on which a robot fits in no heading, inside a frame of such cells."""
    framed = np.ones((free.shape[1] + 2, free.shape[2] + 2), dtype=np.bool_)
    np.any(free, axis=0, out=framed[1:-1, 1:-1])
    np.logical_not(framed[1:-1, 1:-1], out=framed[1:-1, 1:-1])
    return framed


def _path_measures(blocked: Cells, path: NDArray[np.int64], resolution: float) -> dict[str, float]:
    """Measure a path over the free cells of a grid in a frame."""
    radius = max(1, round(DISPERSION_RADIUS / resolution))
    averages = measure_path(blocked, distance_along_columns(blocked), path, radius)
    length = float(np.hypot(*np.diff(path, axis=0).T).sum())
    chord = math.dist(path[0], path[-1])
    closest, visibility, dispersion, dimension = averages.tolist()
    return {
        "path_length": length * resolution,
        "closest_obstacle": closest * resolution,
        "average_visibility": visibility * resolution,
        "dispersion": dispersion,
        "characteristic_dimension": dimension * resolution,
        "tortuosity": length / chord if chord else 1.0,
    }
