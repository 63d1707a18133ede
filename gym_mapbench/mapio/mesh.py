"""Walls as closed solids: occupied cells merged into rectangles and extruded.

The rectangles are stacks of equal horizontal runs, so that each touches others only above and below.
Where the corner of one lies on an edge of another, both have a vertex there: every edge of the
surface then belongs to exactly two triangles (watertight), each connected wall is one closed
surface, and all normals point outwards.

Two walls that touch at a corner only would share a vertical edge four times. There the lower one's
corner slides by a thousandth of a cell, parallel to the chord between its neighbours, which keeps
the area.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gym_mapbench.errors import ConfigError
from gym_mapbench.world.gridmap import GridMap

WALL_HEIGHT = 0.5
"""Default height of walls, m."""
HIGHEST = 1000.0
"""Largest height of walls, m."""
SLIDE = 1e-3
"""How far corners that touch only each other move apart, in cells; still resolved by float32 on a map of 100 m."""


class Mesh(NamedTuple):
    """A triangle mesh: ``(n, 3)`` vertices in m and ``(m, 3)`` their indices, counter-clockwise from outside."""

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int64]

    def normals(self) -> NDArray[np.float64]:
        """Return ``(n, 3)`` unit normals of the vertices, weighted by the area of their triangles.

        One for each vertex, not for each corner of a triangle: readers that keep a vertex with two
        normals apart would otherwise take a closed surface for an open one.
        """
        a, b, c = (self.vertices[self.triangles[:, corner]] for corner in range(3))
        areas = np.cross(b - a, c - a)
        normals = np.zeros_like(self.vertices)
        for corner in range(3):
            np.add.at(normals, self.triangles[:, corner], areas)
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        return normals


class Run(NamedTuple):
    """Rows ``bottom`` to ``top``, columns ``left`` to ``right`` (ends excluded), all occupied."""

    bottom: int
    top: int
    left: int
    right: int


class _Outline(NamedTuple):
    """The border of one run: grid columns of its vertices from left to right, below and above."""

    run: Run
    below: list[int]
    above: list[int]


def wall_mesh(grid: GridMap, height: float = WALL_HEIGHT) -> Mesh:
    """Extrude the occupied cells from z = 0 to ``height`` (m); unknown cells are no walls.

    Raises:
        ConfigError: If the height is not between 0 and :data:`HIGHEST`, or there is no wall.
    """
    if not 0 < height <= HIGHEST:
        raise ConfigError(f"wall height: expected more than 0 and at most {HIGHEST:g} m, got {height:g}")
    if not grid.occupancy.any():
        raise ConfigError("walls: expected at least one occupied cell, got an empty map")
    surface = _Surface(np.pad(grid.occupancy, 1))
    for outline in _outlines(stack_runs(grid.occupancy)):
        surface.add(outline)
    return surface.mesh(grid, height)


def stack_runs(occupancy: NDArray[np.bool_]) -> list[Run]:
    """Merge the occupied cells into stacks of equal, maximal horizontal runs."""
    runs: list[Run] = []
    growing: dict[tuple[int, int], int] = {}
    for row, spans in enumerate(_spans(occupancy)):
        runs += [Run(bottom, row, *span) for span, bottom in growing.items() if span not in spans]
        growing = {span: growing.get(span, row) for span in spans}
    return runs


def _spans(occupancy: NDArray[np.bool_]) -> Iterator[dict[tuple[int, int], None]]:
    """Yield the maximal runs of every row, in order, and of one empty row above the last."""
    steps = np.diff(np.pad(occupancy, ((0, 1), (1, 1))).astype(np.int8), axis=1)
    for row in steps:
        yield dict.fromkeys(zip(np.flatnonzero(row == 1).tolist(), np.flatnonzero(row == -1).tolist(), strict=True))


def _outlines(runs: list[Run]) -> Iterator[_Outline]:
    """Give every run the vertices that its neighbours' corners put on its lower and upper edge."""
    corners: dict[int, set[int]] = defaultdict(set)
    for run in runs:
        corners[run.bottom].update((run.left, run.right))
        corners[run.top].update((run.left, run.right))
    ordered = {row: np.array(sorted(cols)) for row, cols in corners.items()}
    for run in runs:
        yield _Outline(run, _between(ordered[run.bottom], run), _between(ordered[run.top], run))


def _between(cols: NDArray[np.int64], run: Run) -> list[int]:
    first, last = np.searchsorted(cols, (run.left, run.right))
    return [int(col) for col in cols[first : last + 1]]


class _Surface:
    """Collects the triangles of all runs; a vertex is a grid point, at z = 0 and at the top.

    Args:
        padded: The occupancy with one free cell around it.
    """

    def __init__(self, padded: NDArray[np.bool_]) -> None:
        self._padded = padded
        self._ids: dict[tuple[int, int, bool], int] = {}
        self._points: list[tuple[float, float]] = []
        self._faces: list[tuple[int, int, int]] = []

    def add(self, outline: _Outline) -> None:
        """Add the floor, the top and the free sides of one run."""
        run = outline.run
        below = [self._vertex(run.bottom, col, lower=False) for col in outline.below]
        above = [self._vertex(run.top, col, lower=True) for col in outline.above]
        self._slide_corners(outline, above)
        for a, b, c in _zip_chains(outline, below, above):
            self._faces += [(2 * a + 1, 2 * b + 1, 2 * c + 1), (2 * a, 2 * c, 2 * b)]
        self._wall(below[-1], above[-1])
        self._wall(above[0], below[0])
        for (col, _), (a, b) in zip(pairwise(outline.below), pairwise(below), strict=True):
            if not self._padded[run.bottom, col + 1]:
                self._wall(a, b)
        for (col, _), (a, b) in zip(pairwise(outline.above), pairwise(above), strict=True):
            if not self._padded[run.top + 1, col + 1]:
                self._wall(b, a)

    def mesh(self, grid: GridMap, height: float) -> Mesh:
        """Place the collected triangles in the world."""
        ground = np.array(self._points) * grid.resolution + np.array(grid.origin)
        vertices = np.empty((2 * len(ground), 3))
        vertices[:, :2] = np.repeat(ground, 2, axis=0)
        vertices[:, 2] = np.tile([0.0, height], len(ground))
        return Mesh(vertices, np.array(self._faces))

    def _vertex(self, row: int, col: int, lower: bool) -> int:
        """Return the index of a grid point; of two where walls touch at a corner only."""
        key = (row, col, lower and self._touching(row, col) != 0)
        if key not in self._ids:
            self._ids[key] = len(self._points)
            self._points.append((float(col), float(row)))
        return self._ids[key]

    def _touching(self, row: int, col: int) -> int:
        """1 or -1 where the cells at this grid point touch at a corner only and the lower is on its left or right."""
        (a, b), (c, d) = self._padded[row : row + 2, col : col + 2].tolist()
        return (a and d and not b and not c) - (b and c and not a and not d)

    def _slide_corners(self, outline: _Outline, above: list[int]) -> None:
        """Move the upper corners of a run that touch another wall's corner; the area stays."""
        run, cols = outline.run, outline.above
        for index, neighbour in ((0, 1), (-1, -2)):
            side = self._touching(run.top, cols[index])
            if side and side == (1 if index else -1):
                along, down = abs(cols[neighbour] - cols[index]), run.top - run.bottom
                scale = SLIDE / (along + down)
                self._points[above[index]] = (cols[index] + side * scale * along, run.top - scale * down)

    def _wall(self, a: int, b: int) -> None:
        """Add an upright rectangle; walking from ``a`` to ``b`` the wall is on the left."""
        self._faces += [(2 * a, 2 * b, 2 * b + 1), (2 * a, 2 * b + 1, 2 * a + 1)]


def _zip_chains(outline: _Outline, below: list[int], above: list[int]) -> Iterator[tuple[int, int, int]]:
    """Triangulate a rectangle between its lower and upper vertices, counter-clockwise; no triangle is degenerate."""
    i = j = 0
    while i + 1 < len(below) or j + 1 < len(above):
        if j + 1 == len(above) or (i + 1 < len(below) and outline.below[i + 1] <= outline.above[j + 1]):
            yield below[i], below[i + 1], above[j]
            i += 1
        else:
            yield below[i], above[j + 1], above[j]
            j += 1
