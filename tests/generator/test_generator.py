from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gym_mapbench.errors import ConfigError
from gym_mapbench.generator import (
    ShapeSettings,
    clear_and_border,
    default_task,
    disc,
    draw_shape,
    sample_map,
    stamp,
    task_cells,
)
from gym_mapbench.kernels.rectangles import merge_rectangles
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.scenario import Scenario

THESIS = ShapeSettings()


@given(st.integers(0, 2**32 - 1))
def test_maps_keep_border_and_cleared_areas(seed):
    cells = sample_map(np.random.default_rng(seed), THESIS)
    assert cells.shape == (150, 150)
    assert all(edge.all() for edge in (cells[0], cells[-1], cells[:, 0], cells[:, -1]))
    assert not cells[1:22, 128:149].any()
    assert not cells[128:149, 1:22].any()
    assert 0.03 < cells.mean() < 0.5


def test_the_same_seed_draws_the_same_map():
    first, again, other = (sample_map(np.random.default_rng(seed), THESIS) for seed in (7, 7, 8))
    assert (first == again).all()
    assert (first != other).any()


def test_shapes_have_the_sizes_and_shares_of_the_thesis():
    rng = np.random.default_rng(0)
    kinds = {"circle": 0, "square": 0, "wall": 0}
    for _ in range(3000):
        shape = draw_shape(rng, THESIS)
        short, long = sorted(shape.shape)
        if not shape.all():
            kinds["circle"] += 1
            assert short == long == 2 * (short // 2) + 1
            assert 2 <= short // 2 <= 10
        elif short == long:
            kinds["square"] += 1
            assert 4 <= short <= 10
        else:
            kinds["wall"] += 1
            assert 1 <= short <= 3
            assert 10 <= long <= 30
    shares = {kind: count / 3000 for kind, count in kinds.items()}
    assert shares == pytest.approx({"circle": 0.2, "square": 0.3, "wall": 0.5}, abs=0.03)


def test_number_of_obstacles_reaches_both_ends():
    one_cell = ShapeSettings(
        n_obstacles=(1, 2), square_side=(1, 1), circle_probability=0, square_probability=1, wall_probability=0
    )
    counts = {int(sample_map(np.random.default_rng(seed), one_cell)[1:-1, 1:-1].sum()) for seed in range(60)}
    assert counts <= {0, 1, 2}
    assert 2 in counts


@given(st.integers(-15, 15), st.integers(-15, 15), st.integers(1, 6), st.integers(1, 6))
def test_stamp_cuts_off_what_lies_outside(row, col, height, width):
    cells = np.zeros((9, 7), bool)
    stamp(cells, np.ones((height, width), bool), row, col)
    expected = {(r, c) for r in range(row, row + height) for c in range(col, col + width) if 0 <= r < 9 and 0 <= c < 7}
    assert set(zip(*np.nonzero(cells), strict=True)) == expected


def test_disc():
    assert disc(1).tolist() == [[False, True, False], [True, True, True], [False, True, False]]
    assert disc(10).sum() == sum(x * x + y * y <= 100 for x in range(-10, 11) for y in range(-10, 11))


def test_clear_and_border_leaves_its_argument_alone():
    cells = np.ones((150, 150), bool)
    repaired = clear_and_border(cells, THESIS)
    assert cells.all()
    assert (~repaired).sum() == 2 * 21 * 21


def test_default_task_is_ten_cells_from_the_walls():
    grid = GridMap(clear_and_border(np.zeros((150, 150), bool), THESIS))
    start, goal = default_task(grid)
    assert start == pytest.approx((138.25 * 0.05, 11.25 * 0.05, 3 * np.pi / 4))
    assert goal == pytest.approx((11.25 * 0.05, 138.25 * 0.05, 3 * np.pi / 4))
    (row, col), _ = task_cells(grid.shape, 11)
    assert grid.world_to_cell(start.x, start.y) == (row, col)
    Scenario(grid, start, goal)


def test_bad_settings_are_refused():
    with pytest.raises(ConfigError, match=r"wall_length: expected \(smallest, largest\), got \(30, 10\)"):
        ShapeSettings(wall_length=(30, 10))
    with pytest.raises(ConfigError, match="sum of 1"):
        ShapeSettings(wall_probability=0.4)
    with pytest.raises(ConfigError, match="size: expected at least 23"):
        ShapeSettings(size=22)
    with pytest.raises(ConfigError, match="more than 22 cells"):
        default_task(GridMap(np.zeros((20, 20), bool)))


@given(st.integers(0, 2**32 - 1), st.floats(0, 1))
def test_merged_rectangles_cover_every_wall_once(seed, share):
    rng = np.random.default_rng(seed)
    cells = rng.random(tuple(rng.integers(1, 40, 2))) < share
    covered = np.zeros(cells.shape, int)
    for row, col, height, width in merge_rectangles(cells):
        covered[row : row + height, col : col + width] += 1
    assert (covered == cells).all()


def test_rectangles_are_few():
    assert merge_rectangles(np.ones((30, 40), bool)).tolist() == [[0, 0, 30, 40]]
    checkerboard = np.indices((40, 40)).sum(axis=0) % 2 == 0
    assert len(merge_rectangles(checkerboard)) == 800
