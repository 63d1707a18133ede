from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from gym_mapbench.errors import ConfigError
from gym_mapbench.generator import ShapeSettings, sample_map
from gym_mapbench.mapio.mesh import SLIDE, stack_runs, wall_mesh
from gym_mapbench.world.gridmap import GridMap
from tests.mapio.rasterise import rasterise_mesh

trimesh = pytest.importorskip("trimesh")

CELLS = st.tuples(st.integers(1, 10), st.integers(1, 10)).flatmap(lambda shape: arrays(np.bool_, shape))
CHECKERBOARD = np.indices((6, 7)).sum(axis=0) % 2 == 0


def solid(mesh):
    """The mesh as trimesh sees it, after it has merged equal vertices."""
    return trimesh.Trimesh(mesh.vertices, mesh.triangles, process=True)


@given(cells=CELLS)
@example(cells=CHECKERBOARD)
@example(cells=~CHECKERBOARD)
@example(cells=np.ones((3, 4), bool))
@settings(max_examples=60, deadline=None)
def test_walls_are_closed_solids_of_the_cells_volume(cells):
    grid = GridMap(cells, 0.05, (-3.0, 20.0))
    if not cells.any():
        with pytest.raises(ConfigError, match="at least one occupied cell"):
            wall_mesh(grid)
        return
    walls = solid(wall_mesh(grid, 0.4))
    assert walls.is_watertight
    assert walls.is_winding_consistent
    assert walls.volume == pytest.approx(cells.sum() * 0.05**2 * 0.4, rel=2 * SLIDE**2)
    rows, cols = np.nonzero(cells)
    low, high = walls.bounds
    tolerance = SLIDE * 0.05
    assert low == pytest.approx([-3 + 0.05 * cols.min(), 20 + 0.05 * rows.min(), 0], abs=tolerance)
    assert high == pytest.approx([-3 + 0.05 * (cols.max() + 1), 20 + 0.05 * (rows.max() + 1), 0.4], abs=tolerance)


@given(cells=CELLS)
@settings(max_examples=60, deadline=None)
def test_normals_point_outwards_and_cells_come_back(cells):
    if not cells.any():
        return
    grid = GridMap(cells, 0.05)
    mesh = wall_mesh(grid)
    faces = solid(mesh)
    outside = faces.triangles_center + 2 * SLIDE * faces.face_normals
    sides = outside[(outside[:, 2] > 0) & (outside[:, 2] < 0.5)]
    cols, rows = np.floor(sides[:, :2] / 0.05).astype(int).T + 1
    assert not np.pad(cells, 1)[rows, cols].any()
    assert len(faces.faces) - len(sides) == (np.abs(faces.face_normals[:, 2]) > 0.99).sum()
    assert np.linalg.norm(mesh.normals(), axis=1) == pytest.approx(1.0)
    assert (rasterise_mesh(mesh.vertices, mesh.triangles, grid) == cells).all()


def test_every_wall_is_one_body():
    grid = GridMap.from_rows(["##..#", "##.#.", "....#", "####."])
    # The square, and four walls that touch at corners only.
    assert solid(wall_mesh(grid)).body_count == 5


def test_cells_are_merged():
    rng = np.random.default_rng(3)
    cells = sample_map(rng, ShapeSettings())
    runs = stack_runs(cells)
    covered = np.zeros_like(cells, dtype=int)
    for bottom, top, left, right in runs:
        covered[bottom:top, left:right] += 1
    assert (covered == cells).all()
    assert len(runs) < 0.1 * cells.sum()
    assert len(wall_mesh(GridMap(cells)).triangles) < 20 * len(runs)


@pytest.mark.parametrize("height", [0, -1, np.nan, np.inf])
def test_bad_heights(height):
    with pytest.raises(ConfigError, match="wall height: expected more than 0 and at most 1000 m, got"):
        wall_mesh(GridMap.from_rows(["#"]), height)
