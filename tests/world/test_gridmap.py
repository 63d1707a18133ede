from __future__ import annotations

import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gym_mapbench.errors import ConfigError
from gym_mapbench.world.gridmap import GridMap

ROWS = ("####", "#..#", "#.?#", "####")


def test_text_has_its_first_line_at_the_top():
    grid = GridMap.from_rows(["#..", "..."], 0.5, origin=(1.0, 2.0))
    assert grid.occupancy.tolist() == [[False, False, False], [True, False, False]]
    assert grid.world_to_cell(1.1, 2.6) == (1, 0)
    assert grid.cell_to_world(1, 0) == (1.25, 2.75)
    assert grid.bounds == (1.0, 2.0, 2.5, 3.0)
    assert grid.to_rows() == ("#..", "...")
    assert grid.to_image_array().tolist() == [[True, False, False], [False, False, False]]


def test_unknown_cells_are_kept():
    grid = GridMap.from_rows(ROWS)
    assert grid.to_rows() == ROWS
    assert grid.unknown is not None
    assert grid.unknown.sum() == 1
    assert GridMap.from_rows(["##", ".#"]).unknown is None


@given(st.integers(1, 8), st.integers(1, 8), st.integers(0, 2**32 - 1))
def test_points_fall_into_the_cells_they_come_from(rows, cols, seed):
    rng = np.random.default_rng(seed)
    grid = GridMap(np.zeros((rows, cols), bool), rng.uniform(0.01, 2), tuple(rng.uniform(-9, 9, 2)))
    for row in range(rows):
        for col in range(cols):
            assert grid.world_to_cell(*grid.cell_to_world(row, col)) == (row, col)
    x0, y0, x1, y1 = grid.bounds
    assert grid.world_to_cell(x0 - 1e-6, y0) is None
    assert grid.world_to_cell(x0, y1 + 1e-6) is None
    assert grid.world_to_cell(x1 + 1e-6, y0) is None


def test_equality_is_by_content():
    one, same = GridMap.from_rows(ROWS), GridMap.from_rows(ROWS)
    assert one == same
    assert len({one, same}) == 1
    assert one != GridMap.from_rows(ROWS, 0.1)
    assert one != GridMap.from_rows(ROWS, origin=(0.0, 1.0))
    assert one != GridMap.from_rows([row.replace("?", ".") for row in ROWS])
    assert one != "map"


def test_cells_cannot_be_changed_not_even_after_unpickling():
    source = np.zeros((3, 3), bool)
    grid = GridMap(source)
    source[0, 0] = True
    assert not grid.occupancy.any()
    for copy in (grid, pickle.loads(pickle.dumps(grid))):
        assert copy == grid
        with pytest.raises(ValueError, match="read-only"):
            copy.occupancy[0, 0] = True
    walls = GridMap.from_rows(["#."])
    walls.boxes[:] = 0.0
    assert walls.boxes.tolist() == [[0.0, 0.0, 0.05, 0.05]]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"occupancy": np.zeros(3, bool)}, "rows, cols"),
        ({"occupancy": np.zeros((0, 3), bool)}, "rows, cols"),
        ({"occupancy": np.full((2, 2), 7)}, "booleans"),
        ({"occupancy": np.zeros((2, 2)), "resolution": 0.0}, "resolution"),
        ({"occupancy": np.zeros((2, 2)), "resolution": float("nan")}, "resolution"),
        ({"occupancy": np.zeros((2, 2)), "origin": (0.0, float("inf"))}, "origin"),
        ({"occupancy": np.zeros((2, 2)), "unknown": np.zeros((3, 2))}, "unknown"),
        ({"occupancy": np.ones((2, 2)), "unknown": np.eye(2)}, "unknown: expected no occupied cells, got 2"),
    ],
)
def test_bad_maps_are_refused(arguments, message):
    with pytest.raises(ConfigError, match=message):
        GridMap(**arguments)


@pytest.mark.parametrize("rows", [[], [""], ["##", "#"], ["#x"]])
def test_bad_text_is_refused(rows):
    with pytest.raises(ConfigError, match="map rows"):
        GridMap.from_rows(rows)


def test_the_frame_is_a_wall_around_the_map():
    framed = GridMap(np.zeros((2, 3), bool)).framed
    assert framed.shape == (4, 5)
    assert framed.sum() == 14
    assert not framed[1:-1, 1:-1].any()
    assert not framed.flags.writeable
