"""Distances on a grid against SciPy's."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy.ndimage import distance_transform_edt
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra

from gym_mapbench.kernels.distance import geodesic_distance, squared_distance, within

GRIDS = hnp.arrays(bool, hnp.array_shapes(min_dims=2, max_dims=2, min_side=1, max_side=16))


def scipy_geodesic(blocked, start):
    """Dijkstra on the graph of free cells; diagonals need both cells beside them."""
    rows, cols = blocked.shape
    free = {(r, c) for r in range(rows) for c in range(cols) if not blocked[r, c]}
    straight = [(r, c, r + a, c + b, 1.0) for r, c in free for a, b in ((0, 1), (1, 0)) if (r + a, c + b) in free]
    slanted = [
        (r, c, r + 1, c + b, np.sqrt(2.0))
        for r, c in free
        for b in (1, -1)
        if {(r + 1, c + b), (r + 1, c), (r, c + b)} <= free
    ]
    edges = straight + slanted
    r0, c0, r1, c1, length = np.array(edges).reshape(-1, 5).T
    graph = coo_matrix((length, (r0 * cols + c0, r1 * cols + c1)), shape=(rows * cols, rows * cols))
    return dijkstra(graph.tocsr(), directed=False, indices=start[0] * cols + start[1]).reshape(rows, cols)


@given(GRIDS)
@settings(max_examples=100)
def test_squared_distance_is_exact(occupied):
    squared = squared_distance(occupied)
    if occupied.any():
        assert np.array_equal(squared, np.rint(distance_transform_edt(~occupied) ** 2))
    else:
        assert np.isinf(squared).all()


@given(GRIDS, st.floats(0.0, 20.0) | st.integers(0, 9).map(math.sqrt))
@settings(max_examples=100)
def test_within_compares_the_squared_distance(occupied, radius):
    assert np.array_equal(within(occupied, radius), squared_distance(occupied) <= radius * radius)


@given(GRIDS, st.data())
@settings(max_examples=60)
def test_geodesic_distance_equals_dijkstra(blocked, data):
    start = tuple(data.draw(st.integers(0, side - 1)) for side in blocked.shape)
    distance = geodesic_distance(blocked, *start)
    np.testing.assert_allclose(distance, scipy_geodesic(blocked, start), rtol=1e-12)


def test_geodesic_distance_on_a_large_map():
    rng = np.random.default_rng(3)
    blocked = rng.random((90, 120)) < 0.3
    blocked[40, 60] = False
    np.testing.assert_allclose(geodesic_distance(blocked, 40, 60), scipy_geodesic(blocked, (40, 60)), rtol=1e-12)


def test_diagonals_do_not_cut_corners():
    blocked = np.array([[False, True], [False, False]])
    assert geodesic_distance(blocked, 0, 0).tolist() == [[0.0, np.inf], [1.0, 2.0]]
    assert np.isinf(geodesic_distance(np.eye(2, dtype=bool), 0, 1)[1, 0])
