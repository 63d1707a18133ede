"""The widest way between two points, and the points with room around them, against plain slow twins."""

from __future__ import annotations

import heapq
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.ndimage import distance_transform_edt

from gym_mapbench.kernels.distance import distance_along_columns, nearest_occupied
from gym_mapbench.kernels.passages import joins, open_cells, wall_points
from gym_mapbench.metrics.map_metrics import narrowest_passage
from gym_mapbench.world.gridmap import GridMap

SHAPES = st.tuples(st.integers(1, 12), st.integers(1, 12)) | st.tuples(st.integers(1, 4), st.integers(28, 70))
GRIDS = st.builds(
    lambda shape, share, seed: np.random.default_rng(seed).random(shape) < share,
    SHAPES,
    st.sampled_from([0.0, 0.03, 0.1, 0.3, 0.5, 1.0]),
    st.integers(0, 2**32),
)


def room_of(cells):
    """Squared distance of every point of the half-cell lattice to the nearest wall or edge, wall by wall."""
    rows, cols = cells.shape
    i, j = np.mgrid[0 : 2 * rows + 1, 0 : 2 * cols + 1]
    room = np.minimum.reduce([i, j, 2 * rows - i, 2 * cols - j]) ** 2
    for row, col in np.argwhere(cells):
        away_i = np.maximum.reduce([2 * row - i, i - 2 * row - 2, np.zeros_like(i)])
        away_j = np.maximum.reduce([2 * col - j, j - 2 * col - 2, np.zeros_like(j)])
        room = np.minimum(room, away_i**2 + away_j**2)
    return room


def widest(room, start, goal):
    """Follow the points with most room first until the goal is reached."""
    best, waiting = np.full(room.shape, -1), [(-int(room[start]), start)]
    while waiting:
        least, (i, j) = heapq.heappop(waiting)
        if best[i, j] >= 0:
            continue
        best[i, j] = -least
        for point in ((i + a, j + b) for a in (-1, 0, 1) for b in (-1, 0, 1)):
            if 0 <= point[0] < room.shape[0] and 0 <= point[1] < room.shape[1] and best[point] < 0:
                heapq.heappush(waiting, (max(least, -int(room[point])), point))
    return int(best[goal])


@given(cells=GRIDS, data=st.data())
@settings(max_examples=200, deadline=None)
def test_the_narrowest_passage_is_that_of_the_widest_way(cells, data):
    start, goal = (tuple(data.draw(st.integers(0, side - 1)) for side in cells.shape) for _ in range(2))
    points = tuple((2 * row + 1, 2 * col + 1) for row, col in (start, goal))
    expected = math.sqrt(widest(room_of(cells), *points)) * 0.05
    assert narrowest_passage(GridMap(cells, 0.05), start, goal) == expected


@given(cells=GRIDS, square=st.integers(0, 400))
@settings(max_examples=100, deadline=None)
def test_cells_with_room_around_their_middles(cells, square):
    room = room_of(cells)
    assert np.array_equal(open_cells(wall_points(cells), square, cells.shape[1]), room[1::2, 1::2] >= square)


@given(cells=GRIDS)
@settings(max_examples=50, deadline=None)
def test_points_on_walls_and_on_the_edge_are_marked(cells):
    walls = wall_points(cells)
    bits = np.unpackbits(walls.view(np.uint8), axis=1, bitorder="little")
    cols = 2 * cells.shape[1] + 1
    assert np.array_equal(bits[:, :cols] == 1, room_of(cells) == 0)
    assert bits[:, cols:].all()


@pytest.mark.parametrize("cols", [31, 32, 33, 63, 64, 65])
def test_a_way_that_winds_through_many_words_is_one_way(cols):
    rows = 41
    cells = np.zeros((rows, cols), np.bool_)
    cells[1::2] = True
    for number, row in enumerate(range(1, rows, 2)):
        cells[row, 0 if number % 2 else -1] = False
    walls, ends = wall_points(cells), 2 * np.array([[0, 0], [rows - 1, cols - 1]]) + 1
    assert joins(walls, 1, ends)
    assert not joins(walls, 2, ends)
    cells[rows // 2 - rows // 2 % 2 + 1] = True
    assert not joins(wall_points(cells), 1, ends)


def test_a_wide_hall_takes_the_same_steps_as_a_narrow_one():
    cells = np.zeros((300, 300), np.bool_)
    cells[150, :90] = cells[150, 210:] = True  # a door of 120 cells
    grid = GridMap(cells, 0.1)
    assert narrowest_passage(grid, (75, 150), (225, 150)) == pytest.approx(12.0)
    assert narrowest_passage(grid, (75, 5), (225, 150)) == pytest.approx(1.1)  # the start is the narrowest place


@given(cells=arrays(np.bool_, st.tuples(st.integers(1, 15), st.integers(1, 15))))
@settings(max_examples=60, deadline=None)
def test_the_nearest_occupied_cell_of_one_cell(cells):
    framed = np.pad(cells, 1, constant_values=True)
    along, expected = distance_along_columns(framed), distance_transform_edt(~framed)
    for row, col in np.ndindex(framed.shape):
        assert nearest_occupied(along, row, col) == pytest.approx(expected[row, col])
