"""Exported walls turned back into cells, without the code that made them."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np

COLLADA = "{http://www.collada.org/2005/11/COLLADASchema}"


def rasterise_mesh(vertices, triangles, grid):
    """Cells of ``grid`` whose middle lies under an upward triangle."""
    a, b, c = ((vertices[triangles[:, corner], :2] - grid.origin) / grid.resolution for corner in range(3))
    heights = vertices[triangles, 2]
    upward = (heights == heights.max()).all(axis=1) & (heights.max() > 0)
    cells = np.zeros(grid.shape, bool)
    for corners in zip(a[upward], b[upward], c[upward], strict=True):
        _fill(cells, np.array(corners))
    return cells


def _fill(cells, corners):
    low, high = np.floor(corners.min(axis=0)).astype(int), np.ceil(corners.max(axis=0)).astype(int)
    low, high = np.maximum(low, 0), np.maximum(high, 0)
    here = cells[low[1] : high[1], low[0] : high[0]]
    rows, cols = (begin + np.arange(cells) + 0.5 for begin, cells in zip(low[::-1], here.shape, strict=True))
    x, y = np.meshgrid(cols, rows)
    inside = np.ones(x.shape, bool)
    for (x0, y0), (x1, y1) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        inside &= (x1 - x0) * (y - y0) - (y1 - y0) * (x - x0) >= -1e-6
    here |= inside


def read_collada(path):
    """Vertices and triangles of the one geometry in a COLLADA file."""
    root = ElementTree.parse(path).getroot()
    assert root.find(f"{COLLADA}asset/{COLLADA}up_axis").text == "Z_UP"
    assert root.find(f"{COLLADA}asset/{COLLADA}unit").get("meter") == "1"
    mesh = root.find(f"{COLLADA}library_geometries/{COLLADA}geometry/{COLLADA}mesh")
    positions = mesh.find(f"{COLLADA}source[@id='walls-positions']/{COLLADA}float_array")
    vertices = np.array(positions.text.split(), float).reshape(-1, 3)
    assert vertices.size == int(positions.get("count"))
    faces = mesh.find(f"{COLLADA}triangles")
    indices = np.array(faces.find(f"{COLLADA}p").text.split(), int).reshape(-1, 3, 2)
    assert len(indices) == int(faces.get("count"))
    assert (indices[:, :, 0] == indices[:, :, 1]).all()
    return vertices, indices[:, :, 0]


def rasterise_world(world, models, grid):
    """Cells of ``grid`` occupied by the models that a world includes, following each ``model://``."""
    cells = np.zeros(grid.shape, bool)
    for include in ElementTree.parse(world).getroot().findall("world/include"):
        name = include.findtext("uri").removeprefix("model://")
        if name in ("sun", "ground_plane"):
            continue
        config = ElementTree.parse(models / name / "model.config").getroot()
        model = ElementTree.parse(models / name / config.findtext("sdf")).getroot().find("model")
        assert model.findtext("static") == "true"
        for part in ("collision", "visual"):
            uri = model.findtext(f"link/{part}/geometry/mesh/uri").removeprefix("model://")
            shape = rasterise_mesh(*read_collada(models / uri), grid)
            assert part == "collision" or (shape == cells).all()
            cells |= shape
    return cells
