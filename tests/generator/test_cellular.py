"""BARN's cellular automaton."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from gym_mapbench.errors import ConfigError
from gym_mapbench.generator import Cellular, ShapeSettings, interior, task_cells
from gym_mapbench.generator.cellular import smoothed


def cellular_map(rng, shapes, family=None):
    family = family or Cellular()
    return family.build(family.draw_genes(rng), shapes)


def plain_smoothing(tiles, fill, clear):
    """Tile by tile, as the paper's authors describe it."""
    rows, cols = tiles.shape
    after = tiles.copy()
    for row in range(rows):
        for col in range(cols):
            count = 0
            for r in (row - 1, row, row + 1):
                for c in (col - 1, col, col + 1):
                    if (r, c) == (row, col):
                        continue
                    if r < 0 or r >= rows:
                        count += 1
                    elif 0 <= c < cols:
                        count += int(tiles[r, c])
            if count >= fill:
                after[row, col] = True
            elif count <= clear:
                after[row, col] = False
    return after


@given(arrays(np.bool_, st.tuples(st.integers(1, 6), st.integers(1, 6))), st.integers(0, 9), st.integers(0, 9))
def test_smoothing_is_the_plain_one(tiles, fill, clear):
    assert np.array_equal(smoothed(tiles, fill, clear), plain_smoothing(tiles, fill, clear))


def test_maps_are_the_thesis_world_with_other_obstacles():
    shapes = ShapeSettings()
    cells = cellular_map(np.random.default_rng(4), shapes)
    assert np.array_equal(cells, cellular_map(np.random.default_rng(4), shapes))
    assert cells.shape == (150, 150)
    assert cells[0].all()
    assert cells[:, -1].all()
    assert not any(cells[cell] for cell in task_cells(cells.shape, 11))
    assert 0.02 < interior(cells, 1).mean() < 0.6


def test_without_smoothing_the_fill_is_the_density():
    only = Cellular(fill_probability=(0.3,), smoothing_iterations=(0,), tile=1)
    shapes = ShapeSettings(cleared_distance=0)
    assert interior(cellular_map(np.random.default_rng(0), shapes, only), 1).mean() == pytest.approx(0.3, abs=0.02)


def test_more_fill_is_more_wall():
    def density(fill):
        return np.mean([cellular_map(rng, ShapeSettings(), Cellular(fill_probability=(fill,))).mean() for rng in rngs])

    rngs = [np.random.default_rng(seed) for seed in range(5)]
    assert density(0.15) < density(0.3) < density(0.4)


def test_bad_options_are_one_line():
    with pytest.raises(ConfigError, match=r"fill_probability\.0: expected less than or equal to 1"):
        Cellular(fill_probability=(1.5,))
    with pytest.raises(ConfigError, match="smoothing_iterations"):
        Cellular(smoothing_iterations=())
