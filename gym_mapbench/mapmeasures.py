"""How hard a map is, without driving on it: what BARN measures, the narrowest passage, and whether there is a way.

Source: Perille et al., "Benchmarking Metric Ground Navigation", 2020, for closest obstacle, average
visibility, dispersion, characteristic dimension and tortuosity: averages along a shortest path in
the configuration space, i.e. where the robot's centre can be. Lengths are in m, not in cells.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from gym_mapbench.errors import ConfigError
from gym_mapbench.gridmap import GridMap
from gym_mapbench.kernels.configuration import connects, stamp_footprint
from gym_mapbench.kernels.distance import geodesic_distance, squared_distance
from gym_mapbench.kernels.pathmeasures import descend, measure_path
from gym_mapbench.robot import RobotSpec
from gym_mapbench.scenario import Pose, Scenario

Cells = NDArray[np.bool_]
Cell = tuple[int, int]

DISPERSION_RADIUS: Final = 0.45
"""BARN's three cells of 0.15 m."""

_TOUCHING: Final = 1e-9
"""Overlaps below this (m, or cells) are rounding errors."""

_NEIGHBOURS: Final = np.ones((3, 3), dtype=np.bool_)

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
"""Names of all measures, in the order of :func:`measure_array`."""


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
    start, goal = (_cell(grid, pose) for pose in (scenario.start, scenario.goal))
    free = configuration_space(grid, robot)
    measures = dict.fromkeys(MEASURES, math.nan)
    measures["occupied_share"] = occupied_share(grid)
    measures["narrowest_passage"] = narrowest_passage(grid, start, goal)
    measures["solvable"] = float(is_reachable(free, start, goal))
    if measures["solvable"]:
        measures |= _path_measures(np.any(free, axis=0), start, goal, grid.resolution)
    return measures


def measure_array(scenarios: Iterable[Scenario], robot: RobotSpec) -> NDArray[np.float64]:
    """Return ``(scenarios, len(MEASURES))``, one row per scenario, in the order of :data:`MEASURES`."""
    rows = [list(measure_map(scenario, robot).values()) for scenario in scenarios]
    return np.array(rows, dtype=np.float64).reshape(-1, len(MEASURES))


def occupied_share(grid: GridMap) -> float:
    """Return the occupied share of all cells, 0..1."""
    return float(grid.occupancy.mean())


def squared_wall_distances(grid: GridMap) -> NDArray[np.float64]:
    """Return the exact distance to the nearest wall or the map's edge, on a lattice of half cells.

    Returns:
        ``(2 * rows + 1, 2 * cols + 1)`` squares of half cells; point ``[i, j]`` lies ``i / 2`` cells above and
        ``j / 2`` cells right of the map's lower-left corner. The nearest point of a wall to a point
        of the lattice is on the lattice, too, so these are whole numbers.
    """
    rows, cols = grid.shape
    wall = np.ones((2 * rows + 1, 2 * cols + 1), dtype=np.bool_)
    wall[1:-1, 1:-1] = False
    for i in range(3):
        for j in range(3):
            wall[i : i + 2 * rows - 1 : 2, j : j + 2 * cols - 1 : 2] |= grid.occupancy
    squares: NDArray[np.float64] = squared_distance(wall)
    return squares


def narrowest_passage(grid: GridMap, start: Cell, goal: Cell) -> float:
    """Return the width of the narrowest place on the widest way between two cells' middles, m; 0 if there is none.

    Start and goal count as places.
    """
    squares = squared_wall_distances(grid)
    ends = tuple((2 * row + 1, 2 * col + 1) for row, col in (start, goal))
    widest, too_wide = 0, int(min(squares[end] for end in ends)) + 1
    while too_wide - widest > 1:
        middle = (widest + too_wide) // 2
        labels, _ = ndimage.label(squares >= middle, structure=_NEIGHBOURS)
        if labels[ends[0]] == labels[ends[1]]:
            widest = middle
        else:
            too_wide = middle
    return math.sqrt(widest) * grid.resolution


def configuration_space(grid: GridMap, robot: RobotSpec) -> Cells:
    """Return the cells in whose middle the robot's centre can be.

    Returns:
        ``(1, rows, cols)`` bool for a disc; for a polygon ``(16, rows, cols)``, headings every 22.5 degrees.
    """
    if robot.footprint is None:
        distances = np.sqrt(squared_wall_distances(grid)[1::2, 1::2]) * (grid.resolution / 2)
        return (distances >= robot.radius - _TOUCHING)[None]
    reach = math.ceil(robot.circumscribed_radius / grid.resolution) + 1
    occupied = np.pad(grid.occupancy, reach, constant_values=True)
    blocked = np.empty((16, *occupied.shape), dtype=np.bool_)
    for heading, offsets in enumerate(_turned(robot.footprint, grid.resolution)):
        stamp_footprint(occupied, offsets, blocked[heading])
    return ~blocked[:, reach:-reach, reach:-reach]


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


def is_reachable(free: Cells, start: Cell, goal: Cell) -> bool:
    """Whether a robot gets from cell to cell, see :func:`configuration_space`; start and goal with any heading."""
    if len(free) > 1:
        return bool(connects(free, *start, *goal))
    return bool(free[0][start] and free[0][goal] and np.isfinite(geodesic_distance(~free[0], *start)[goal]))


def _path_measures(free: Cells, start: Cell, goal: Cell, resolution: float) -> dict[str, float]:
    """Measure a shortest path over the free cells."""
    path = descend(geodesic_distance(~free, *goal), *start)
    blocked = np.pad(~free, 1, constant_values=True)
    radius = max(1, round(DISPERSION_RADIUS / resolution))
    averages = measure_path(blocked, np.sqrt(squared_distance(blocked)), path + 1, radius)
    length = float(np.hypot(*np.diff(path, axis=0).T).sum())
    chord = math.dist(start, goal)
    closest, visibility, dispersion, dimension = averages.tolist()
    return {
        "path_length": length * resolution,
        "closest_obstacle": closest * resolution,
        "average_visibility": visibility * resolution,
        "dispersion": dispersion,
        "characteristic_dimension": dimension * resolution,
        "tortuosity": length / chord if chord else 1.0,
    }


def _cell(grid: GridMap, pose: Pose) -> Cell:
    """Return the cell of a pose that a scenario has checked to be on the map."""
    cell = grid.world_to_cell(pose.x, pose.y)
    if cell is None:
        raise ConfigError(f"({pose.x:g}, {pose.y:g}): expected a point on the map")
    return cell
