"""The denoise layer: worked examples, and slow twins of both of its kernels."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from gym_mapbench.costmap import CostmapParams, DenoiseLayer, LayeredCostmap
from gym_mapbench.errors import ConfigError
from gym_mapbench.kernels.denoise import remove_groups, remove_isolated
from gym_mapbench.world.footprint import Footprint
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.scenario import Pose

POINT = Footprint.from_radius(0.01, 0.0)
ROWS = [
    "#.........",
    "...#......",
    "....#.....",
    ".........#",
    ".##......#",
    ".........#",
    "..........",
]
"""Groups of 1, 2 (at a corner), 3 and 2 cells."""


def neighbours(cell, diagonal, rows, cols):
    """The cells beside a cell, within a range of rows and of columns."""
    row, col = cell
    steps = [(a, b) for a in (-1, 0, 1) for b in (-1, 0, 1) if (a, b) != (0, 0) and (diagonal or 0 in (a, b))]
    return [(row + a, col + b) for a, b in steps if row + a in rows and col + b in cols]


def plain_denoised(costs, smallest, diagonal, unknown_is_obstacle, row0, col0, row1, col1):
    """What is left of ``costs``: groups are grown cell by cell, in sets."""
    rows, cols = range(row0, row1), range(col0, col1)
    obstacles = {253, 254, 255} if unknown_is_obstacle else {253, 254}
    waiting = {(row, col) for row in rows for col in cols if costs[row, col] in obstacles}
    left = costs.copy()
    while waiting:
        group = edge = {next(iter(waiting))}
        while edge:
            edge = {near for cell in edge for near in neighbours(cell, diagonal, rows, cols)} & waiting - group
            group = group | edge
        waiting -= group
        if len(group) < smallest:
            for cell in group:
                left[cell] = 0
    return left


@st.composite
def noisy(draw):
    """A costmap, and the range of rows and columns that is updated."""
    shape = draw(st.tuples(st.integers(1, 9), st.integers(1, 9)))
    cells = st.sampled_from([0, 0, 0, 128, 252, 253, 254, 254, 255])
    costs = draw(hnp.arrays(np.uint8, shape, elements=cells, fill=st.nothing()))
    row0, row1 = sorted(draw(st.tuples(*[st.integers(0, shape[0])] * 2)))
    col0, col1 = sorted(draw(st.tuples(*[st.integers(0, shape[1])] * 2)))
    return costs, (row0, col0, row1, col1)


@given(noisy(), st.integers(2, 6), st.booleans(), st.booleans())
def test_groups_equal_their_plain_twin(scene, smallest, diagonal, unknown_is_obstacle):
    costs, cells = scene
    expected = plain_denoised(costs, smallest, diagonal, unknown_is_obstacle, *cells)
    remove_groups(costs, smallest, diagonal, unknown_is_obstacle, *cells)
    assert np.array_equal(costs, expected)


@given(noisy(), st.booleans(), st.booleans())
def test_isolated_cells_are_the_groups_of_one(scene, diagonal, unknown_is_obstacle):
    costs, cells = scene
    expected = plain_denoised(costs, 2, diagonal, unknown_is_obstacle, *cells)
    remove_isolated(costs, diagonal, unknown_is_obstacle, *cells)
    assert np.array_equal(costs, expected)


@pytest.mark.parametrize("release", ["humble", "jazzy"])
@pytest.mark.parametrize(
    ("options", "left"),
    [
        ({}, 7),
        ({"group_connectivity_type": 4}, 5),
        ({"minimal_group_size": 3}, 3),
        ({"minimal_group_size": 4}, 0),
        ({"minimal_group_size": 1}, 8),
        ({"minimal_group_size": -5}, 8),
        ({"enabled": False}, 8),
    ],
)
def test_the_worked_example(options, left, release):
    grid = GridMap.from_rows(ROWS)
    params = CostmapParams.example_global(
        plugins=("static_layer", "denoise_layer"), denoise_layer=options, release=release
    )
    costs = LayeredCostmap(params, grid, POINT).update(Pose(0.1, 0.1)).costs
    assert (costs == 254).sum() == left


def test_unknown_cells_are_obstacles_only_where_the_costmap_does_not_track_them():
    costs = np.array([[0, 254, 255]], np.uint8)
    for unknown_is_obstacle, expected in ((False, [0, 0, 255]), (True, [0, 254, 255])):
        left = costs.copy()
        remove_isolated(left, True, unknown_is_obstacle, 0, 0, 1, 3)
        assert left.tolist() == [expected]


def test_what_is_removed_is_not_inflated():
    plugins = ("static_layer", "denoise_layer", "inflation_layer")
    before, after = (
        CostmapParams.example_global(plugins=plugins, denoise_layer={"enabled": enabled}) for enabled in (False, True)
    )
    grid = GridMap.from_rows([".....", "..#..", "....."])
    noisy, clean = (LayeredCostmap(params, grid, POINT).update(Pose(0.1, 0.1)).costs for params in (before, after))
    assert noisy.all()
    assert not clean.any()


def test_the_order_of_the_plugins_is_the_order_of_the_layers():
    plugins = ("denoise_layer", "static_layer")
    grid = GridMap.from_rows(["...", ".#.", "..."])
    costs = LayeredCostmap(CostmapParams.example_global(plugins=plugins), grid, POINT).update(Pose(0.1, 0.1)).costs
    assert costs[1, 1] == 254


def test_only_cells_of_the_update_are_looked_at():
    costs = np.array([[254, 254, 0, 254]], np.uint8)
    remove_groups(costs, 3, True, False, 0, 1, 1, 4)
    assert costs.tolist() == [[254, 0, 0, 0]]


def test_options_of_a_layer_are_saved_only_where_they_count():
    plain = CostmapParams.example_local()
    assert "denoise_layer" not in plain.model_dump(mode="json")
    noisy = plain.replace(plugins=("voxel_layer", "denoise_layer"), denoise_layer=DenoiseLayer(minimal_group_size=4))
    saved = noisy.model_dump(mode="json")
    assert saved["denoise_layer"] == {"enabled": True, "minimal_group_size": 4, "group_connectivity_type": 8}
    assert CostmapParams(**saved) == noisy


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"group_connectivity_type": 6}, "denoise_layer: group_connectivity_type: expected 4 or 8, got 6"),
        ({"minimal_size": 3}, "denoise_layer: unknown key 'minimal_size'"),
    ],
)
def test_bad_options_are_refused_in_one_line(options, message):
    with pytest.raises(ConfigError, match=message):
        CostmapParams(denoise_layer=options)
