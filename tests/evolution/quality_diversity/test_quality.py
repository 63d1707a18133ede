"""Cells and qualities: worked examples and properties."""

from __future__ import annotations

from math import exp, log

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evolution.driving import RunResult
from evolution.quality_diversity import AtlasSettings
from evolution.quality_diversity.elites import boundary_length, quality, reliability, simplicity
from evolution.quality_diversity.grid import Axes, MapGrid
from gym_mapbench.world.gridmap import GridMap

NAMES = ("dwb", "mppi", "rpp")
AXES = Axes.of(AtlasSettings(cells=5, largest_ratio=4.0), NAMES)
GRID = GridMap.from_rows(["....", ".##.", "....", "...."], 0.5)


def test_the_boundary_by_hand():
    assert boundary_length(GRID) == pytest.approx(6 * 0.5)
    assert simplicity(GRID) == pytest.approx(1 / (1 + 3.0 / 8.0))
    assert simplicity(GridMap(np.zeros((4, 4), dtype=bool), 0.5)) == 1.0


def slow_boundary(cells):
    """Count the pairs of neighbours of which one is occupied."""
    rows, cols = cells.shape
    pairs = [((r, c), (r + 1, c)) for r in range(rows - 1) for c in range(cols)]
    pairs += [((r, c), (r, c + 1)) for r in range(rows) for c in range(cols - 1)]
    return sum(cells[one] != cells[other] for one, other in pairs)


@settings(max_examples=30, deadline=None)
@given(st.integers(1, 9), st.integers(1, 9), st.integers(0, 2**31))
def test_the_boundary_equals_its_slow_twin(rows, cols, seed):
    cells = np.random.default_rng(seed).random((rows, cols)) < 0.5
    assert boundary_length(GridMap(cells, 0.05)) == pytest.approx(0.05 * slow_boundary(cells))


def test_reliability_by_hand():
    trials = np.array([[0.0, 0.0], [0.1, 0.0], [0.2, 0.9]])  # the mean is (0.1, 0.3)
    assert reliability(trials, 0.35) == pytest.approx(2 / 3)
    assert reliability(trials, 0.61) == 1.0
    assert reliability(trials, 0.01) == 0.0


@settings(max_examples=60, deadline=None)
@given(st.integers(1, 20), st.data())
def test_reliability_comes_before_simplicity(trials, data):
    """The most cluttered map with one more reliable trial is better than the empty map."""
    reliable = data.draw(st.integers(0, trials - 1))
    cluttered = GridMap(np.indices((20, 20)).sum(axis=0) % 2 == 0, 0.05)
    empty = GridMap(np.zeros((20, 20), dtype=bool), 0.05)
    assert quality(cluttered, (reliable + 1) / trials, trials) > quality(empty, reliable / trials, trials)
    assert 0.0 < quality(cluttered, 0.0, trials) < quality(empty, 1.0, trials) <= 1.0


def test_the_default_axes_compare_with_the_first_controller():
    assert AXES.names == ("mppi/dwb", "rpp/dwb")
    assert Axes.of(AtlasSettings(), NAMES[:2]).names == ("mppi/dwb",)
    assert Axes.of(AtlasSettings(), (*NAMES, "graceful")).names == ("mppi/dwb", "rpp/dwb")
    named = Axes.of(AtlasSettings(pairs=("rpp/mppi",)), NAMES)
    runs = [[RunResult("goal", time, 1.0)] for time in (7.0, 10.0, 20.0)]
    assert named.log_ratios(runs) == pytest.approx(np.array([[log(2.0)]]))


def cell_at(position):
    grid = MapGrid(AXES)
    grid.add(0, 0.0, position)
    (cell,) = grid.elites
    return cell


@settings(max_examples=60, deadline=None)
@given(st.floats(-3, 3), st.floats(-3, 3))
def test_a_position_lies_in_its_cell(across, up):
    cell = cell_at(np.array([across, up]))
    for value, number in zip((across, up), cell, strict=True):
        low, high = np.log(AXES.edges[number : number + 2])
        assert low - 1e-5 <= np.clip(value, -log(4.0), log(4.0)) <= high + 1e-5


def test_a_grid_keeps_the_best_map_of_each_cell():
    """Against a dictionary."""
    rng, grid, expected = np.random.default_rng(0), MapGrid(AXES), {}
    for number in range(200):
        value, position = float(rng.random()), rng.normal(size=2)
        cell = cell_at(position)
        better = cell not in expected or value > expected[cell][0]
        assert grid.takes(value, position) == better
        grid.add(number, value, position)
        if better:
            expected[cell] = value, number
    assert grid.elites == {cell: number for cell, (_, number) in sorted(expected.items())}
    assert grid.coverage == pytest.approx(len(expected) / 25)
    assert grid.qd_score == pytest.approx(sum(value for value, _ in expected.values()))


def test_the_middle_cell_is_around_equal_times():
    low, high = AXES.edges[2:4]
    assert low * high == pytest.approx(1.0)
    assert high == pytest.approx(exp(AXES.width / 2))
