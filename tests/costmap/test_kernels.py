"""Every kernel of the layers equals its slow twin."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from gym_mapbench.costmap import LaserScan
from gym_mapbench.kernels import layers
from gym_mapbench.kernels.footprint import clear_polygon, critic_footprint_cost, footprint_cost, touch_footprint
from gym_mapbench.kernels.inflation import inflate
from gym_mapbench.kernels.layers import shifted
from gym_mapbench.kernels.obstacle_layer import clear_rays, mark_hits
from gym_mapbench.kernels.raytrace import line_cell
from gym_mapbench.kernels.scan import publish_ranges
from gym_mapbench.kernels.voxel_layer import UNKNOWN_COLUMN, clear_voxels, mark_voxels
from gym_mapbench.world.scenario import Pose
from tests.costmap.plain_layers import (
    PlainVoxels,
    cell_of,
    plain_clear_rays,
    plain_combine,
    plain_line,
    plain_mark_hits,
    plain_project,
)
from tests.costmap.test_static_and_inflation import plain_brushfire

RESOLUTION = 0.05
CELLS = st.integers(-20, 20)
SHAPES = st.tuples(st.integers(1, 25), st.integers(1, 25))
COSTS = st.sampled_from([0, 50, 253, 254, 255])
METHODS = {
    "true_overwrite": layers.TRUE_OVERWRITE,
    "overwrite": layers.OVERWRITE,
    "max": layers.MAX,
    "max_without_unknown_overwrite": layers.MAX_WITHOUT_UNKNOWN_OVERWRITE,
}


def empty_box():
    return np.array([np.inf, np.inf, -np.inf, -np.inf])


@st.composite
def seen(draw):
    """A grid and its resolution, a sensor on it or just off it, points around, and two ranges."""
    shape, seed = draw(SHAPES), draw(st.integers(0, 2**31))
    rng, resolution = np.random.default_rng(seed), draw(st.sampled_from([0.05, 0.07, 0.3]))
    origin = tuple(resolution * rng.integers(-20, 20, 2) + rng.choice([0.0, 0.0217]))
    size = resolution * np.array(shape[::-1])
    sensor = tuple((origin + size * rng.uniform(-0.1, 1.1, 2)).tolist())
    points = (origin + size * rng.uniform(-0.6, 1.6, (draw(st.integers(0, 30)), 2))).astype(np.float32)
    ranges = draw(st.sampled_from([0.0, 0.12, 0.3])), draw(st.sampled_from([0.2, 0.5, 3.0]))
    return shape, (resolution, *origin), sensor, points, ranges


@given(CELLS, CELLS, CELLS, CELLS)
def test_line_equals_its_plain_twin(row0, col0, row1, col1):
    steps = max(abs(row1 - row0), abs(col1 - col0)) + 1
    line = [line_cell(row0, col0, row1, col1, step) for step in range(steps)]
    assert line == plain_line((row0, col0), (row1, col1))


def test_line_of_the_worked_example():
    assert plain_line((0, 0), (2, 5)) == [(0, 0), (0, 1), (1, 2), (1, 3), (2, 4), (2, 5)]


@given(seen())
@settings(max_examples=200, deadline=None)
def test_rays_of_the_obstacle_layer_equal_their_plain_twin(scene):
    shape, grid, sensor, points, ranges = scene
    (ours, box), (plain, plain_box) = ((np.full(shape, 255, np.uint8), empty_box()) for _ in range(2))
    clear_rays(ours, *grid, *sensor, points, *ranges, box)
    plain_clear_rays(plain, grid[0], grid[1:], sensor, points, ranges, plain_box)
    assert np.array_equal(ours, plain)
    assert np.allclose(box, plain_box, rtol=1e-12, atol=0)  # their square roots differ in the last bit


@given(seen(), st.booleans())
@settings(max_examples=200, deadline=None)
def test_hits_of_the_obstacle_layer_equal_their_plain_twin(scene, in_meters):
    shape, grid, sensor, points, ranges = scene
    (ours, box), (plain, plain_box) = ((np.zeros(shape, np.uint8), empty_box()) for _ in range(2))
    mark_hits(ours, *grid, *sensor, points, *ranges, in_meters, box)
    plain_mark_hits(plain, grid[0], grid[1:], sensor, points, ranges, in_meters, plain_box)
    assert np.array_equal(ours, plain)
    assert np.allclose(box, plain_box, rtol=1e-12, atol=0)  # their square roots differ in the last bit


@given(
    seen(),
    st.tuples(st.integers(0, 1), st.sampled_from([0, 14, 15])),
    st.lists(st.tuples(st.floats(-0.2, 0.9), st.booleans()), min_size=1, max_size=3),
    st.sampled_from([(0.05, 0.0, 16), (0.2, -0.15, 3), (0.1, -0.1, 1), (0.07, 0.1, 9)]),
    st.sampled_from([0.0, 0.5]),
    st.booleans(),
)
@settings(max_examples=300, deadline=None)
def test_voxels_equal_their_plain_twin(scene, thresholds, scans, column, short, pull_in):
    (shape, grid, sensor, points, ranges), (z_resolution, origin_z, levels) = scene, column
    layer, columns, box = np.zeros(shape, np.uint8), np.full(shape, UNKNOWN_COLUMN, np.int64), empty_box()
    size = (shape[1] - short) * grid[0], (shape[0] - short) * grid[0]
    place = grid[0], z_resolution, (*grid[1:], origin_z)
    plain, plain_box = PlainVoxels(np.zeros(shape, np.uint8), levels, *place, thresholds), empty_box()
    for height, marks in scans:
        at, z = (*sensor, height), float(np.float32(height))
        level = int((max(z, origin_z) - origin_z) / z_resolution)
        if marks and level < levels:
            mark_voxels(layer, columns, *grid, at, points, z, level, thresholds[0], *ranges, box)
            plain.mark(at, points, z, level, ranges, plain_box)
        clear_voxels(
            layer, columns, *grid, size, *column[:2], levels, at, points, z, *thresholds, *ranges, pull_in, box
        )
        plain.clear(at, points, z, ranges, size, pull_in, plain_box)
        assert np.array_equal(layer, plain.layer)
        assert np.array_equal(columns, plain.columns)
        assert np.allclose(box, plain_box, rtol=1e-12, atol=0)  # their square roots differ in the last bit


@given(hnp.arrays(np.uint8, (5, 6), elements=COSTS), hnp.arrays(np.uint8, (5, 6), elements=COSTS), st.data())
def test_combining_equals_its_plain_twin(master, layer, data):
    method = data.draw(st.sampled_from(sorted(METHODS)))
    cells = *data.draw(st.tuples(st.integers(0, 4), st.integers(0, 5))), 5, data.draw(st.integers(1, 6))
    plain = master.copy()
    layers.combine(master, layer, *cells, METHODS[method])
    plain_combine(plain, layer, cells, method)
    assert np.array_equal(master, plain)


@given(hnp.arrays(np.uint8, (4, 6)), st.integers(-7, 7), st.integers(-7, 7))
def test_shifting_equals_its_plain_twin(grid, d_row, d_col):
    padded = np.pad(grid, 8, constant_values=9)
    assert np.array_equal(shifted(grid, d_row, d_col, 9), padded[8 + d_row : 12 + d_row, 8 + d_col : 14 + d_col])


@given(st.floats(-1, 1), st.floats(-1, 1), st.floats(-4, 4), st.booleans(), st.integers(0, 99))
def test_looking_up_the_map_equals_its_plain_twin(x, y, yaw, use_maximum, seed):
    rng = np.random.default_rng(seed)
    known, master = rng.integers(0, 256, (8, 9), np.uint8), rng.integers(0, 256, (6, 7), np.uint8)
    plain = master.copy()
    for row in range(1, 6):
        for col in range(2, 7):
            at = 0.2 + (col + 0.5) * 0.1, -0.1 + (row + 0.5) * 0.1
            turned = (
                math.cos(yaw) * at[0] - math.sin(yaw) * at[1] + x,
                math.sin(yaw) * at[0] + math.cos(yaw) * at[1] + y,
            )
            cell = cell_of(*turned, 0.15, (-0.3, -0.2), known.shape)
            if cell is not None:
                plain[row, col] = max(known[cell], plain[row, col]) if use_maximum else known[cell]
    layers.write_map(master, 0.1, 0.2, -0.1, known, 0.15, -0.3, -0.2, x, y, yaw, 1, 2, 6, 7, use_maximum)
    assert np.array_equal(master, plain)


def plain_nearest(sources, reach):
    rows, cols = np.indices(sources.shape)
    away = [(rows - row) ** 2 + (cols - col) ** 2 for row, col in np.argwhere(sources)]
    return np.min(away, axis=0) if away else np.full(sources.shape, reach * reach + 1)


@given(
    hnp.arrays(np.uint8, (14, 16), elements=COSTS),
    st.integers(1, 4),
    st.booleans(),
    st.booleans(),
    st.booleans(),
    st.data(),
)
@settings(max_examples=60, deadline=None)
def test_inflation_of_a_part_equals_its_plain_twin(costs, reach, exact, inflate_unknown, around_unknown, data):
    row0, col0 = data.draw(st.integers(0, 13)), data.draw(st.integers(0, 15))
    row1, col1 = data.draw(st.integers(row0, 14)), data.draw(st.integers(col0, 16))
    cost_of = np.linspace(254, 1, reach * reach + 1).astype(np.uint8)
    sources = (costs == 254) | (around_unknown & (costs == 255))
    near = np.zeros_like(sources)
    near[max(0, row0 - reach) : row1 + reach, max(0, col0 - reach) : col1 + reach] = True
    find = plain_nearest if exact else plain_brushfire
    squared, plain = find(sources & near, reach), costs.copy()
    for row in range(row0, row1):
        for col in range(col0, col1):
            if squared[row, col] <= reach * reach:
                old, new = plain[row, col], cost_of[squared[row, col]]
                over_unknown = old == 255 and (new > 0 if inflate_unknown else new >= 253)
                plain[row, col] = new if over_unknown else max(old, new)
    inflate(costs, reach, cost_of, exact, inflate_unknown, around_unknown, row0, col0, row1, col1)
    assert np.array_equal(costs, plain)


@given(st.floats(-4, 4), st.floats(0.2, 1.8), st.floats(0.2, 1.8), st.integers(3, 9))
def test_clearing_a_polygon_equals_its_plain_twin(yaw, x, y, sides):
    angles = np.arange(sides) * 2 * math.pi / sides
    box = empty_box()
    placed = touch_footprint(0.3 * np.stack([np.cos(angles), np.sin(angles)], axis=1), x, y, yaw, box)
    assert np.allclose(placed, np.stack([x + 0.3 * np.cos(angles + yaw), y + 0.3 * np.sin(angles + yaw)], axis=1))
    assert np.array_equal(box, [*placed.min(axis=0), *placed.max(axis=0)])
    layer = np.ones((40, 40), np.uint8)
    clear_polygon(layer, RESOLUTION, 0.0, 0.0, placed)
    corners = [cell_of(*corner, RESOLUTION, (0.0, 0.0), layer.shape) for corner in placed.tolist()]
    plain = np.ones((40, 40), np.uint8)
    if None not in corners:
        outline = [cell for i in range(sides) for cell in plain_line(corners[i - 1], corners[i])]
        for col in {cell[1] for cell in outline}:
            rows = [cell[0] for cell in outline if cell[1] == col]
            plain[min(rows) : max(rows) + 1, col] = 0
    assert np.array_equal(layer, plain)


@given(
    hnp.arrays(
        np.float32, st.integers(1, 40), elements=st.sampled_from([0.0, 0.11, 0.12, 1.0, 3.4, 3.5, np.inf, np.nan])
    ),
    st.tuples(st.floats(-9, 9), st.floats(-9, 9), st.floats(-4, 4)),
    st.floats(-4, 4),
)
def test_points_of_a_scan_equal_their_plain_twin(ranges, sensor, angle_min):
    seen = LaserScan(ranges, angle_min, 0.0174, 0.12, 3.5).observe(Pose(*sensor), 0.132)
    x, y, yaw = sensor
    assert seen.points.dtype == np.float32
    assert np.array_equal(seen.points, plain_project(ranges, angle_min, 0.0174, 0.12, 3.5, yaw, x, y))
    assert (seen.origin, seen.z) == ((x, y, 0.132), float(np.float32(0.132)))


@given(
    hnp.arrays(np.float32, st.integers(1, 40), elements=st.sampled_from([0.0, 1.0, 3.4, 3.5])),
    st.sampled_from([np.float32, np.float64]),
    st.floats(-9, 9),
    st.floats(-9, 9),
)
def test_published_ranges_equal_their_plain_twin(ranges, dtype, x, y):
    ranges = ranges.astype(dtype)
    hair = np.float32(32) * np.spacing(np.float32(max(abs(x), abs(y)) + 3.5))
    expected = np.where(ranges < 3.5, ranges + hair, np.inf).astype(np.float32)
    assert publish_ranges(ranges, 3.5, x, y).tobytes() == expected.tobytes()


def test_a_beam_that_hit_nothing_may_end_just_short_of_the_range():
    scan = LaserScan(np.array([np.inf, 1.0, np.inf, 4.0]), 0.0, np.pi / 2, 0.12, 3.5)
    seen = scan.observe(Pose(0.0, 0.0), 0.0, inf_is_valid=True)
    assert seen.points == pytest.approx(np.array([[3.4999, 0.0], [0.0, 1.0], [-3.4999, 0.0]]), abs=1e-6)
    assert len(scan.observe(Pose(0.0, 0.0), 0.0).points) == 1


def test_the_closing_edge_begins_at_the_first_corner_but_for_dwbs_critic():
    # Closing edge between the cells (0, 0) and (2, 4), row and column: through (1, 1) one way, (0, 1) the other.
    corners = np.array([[0.5, 0.5], [0.5, 2.5], [4.5, 2.5]])
    for cell, expected in (((1, 1), (254, 0)), ((0, 1), (0, 254))):
        costs = np.zeros((5, 5), np.uint8)
        costs[cell] = 254
        placed = (costs, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, corners)
        assert (footprint_cost(*placed), critic_footprint_cost(*placed)) == expected


@pytest.mark.parametrize(
    ("cells", "expected"),
    [
        ({(0, 1): 255, (0, 3): 254}, 254),
        ({(0, 1): 254, (0, 3): 255}, 254),
        ({(0, 2): 254, (2, 4): 255}, 254),
        ({(0, 2): 255, (2, 4): 254}, 255),
        ({(4, 2): 255, (2, 0): 254}, 255),
        ({(2, 0): 254}, 254),
    ],
)
def test_an_obstacle_beside_unknown_space_under_an_outline(cells, expected):
    """Nav2's line returns 254 whatever else is on it; of the edges, the largest cost so far counts."""
    costs = np.zeros((5, 5), np.uint8)
    for cell, cost in cells.items():
        costs[cell] = cost
    corners = np.array([[0.5, 0.5], [4.5, 0.5], [4.5, 4.5], [0.5, 4.5]])
    assert footprint_cost(costs, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, corners) == expected
