"""Informed operators: they change a map near the path that Nav2 plans, where a change affects the trajectories."""

from __future__ import annotations

import math

import numpy as np

from evolution.search.operators.edits import Edit
from gym_mapbench.generator import draw_from, draw_obstacle, interior, sample_map, stamp

NUDGE = 3
BESIDE = (0.2, 0.8)
GAP = (0.5, 0.9)
WALL = (0.4, 2.0)
THICKNESS = (0.05, 0.2)
GAP_OFFSET = 0.3


def nudge(edit: Edit, rng: np.random.Generator) -> None:
    """Put the lifted obstacle, one near the path, back 1 to 3 cells away."""
    shape, *position = edit.cut_out()
    angle, distance = rng.uniform(0.0, 2.0 * math.pi), float(rng.integers(1, NUDGE, endpoint=True))
    offsets = np.rint([distance * math.sin(angle), distance * math.cos(angle)]).astype(int)
    row, col = np.clip(position + offsets, 0, np.subtract(edit.cells.shape, shape.shape))
    stamp(edit.cells, shape, int(row), int(col))


def near_way(edit: Edit, rng: np.random.Generator) -> None:
    """Sample a new obstacle, its nearer side 0.2 to 0.8 m from a point of the path; anywhere if there is no path."""
    shape, row, col = draw_obstacle(rng, edit.shapes, edit.families, (edit.cells.shape[0], edit.cells.shape[1]))
    if edit.way is not None and shape.size:
        (at_row, at_col), (along_row, along_col) = point_of_way(edit, rng)
        side = 1.0 if rng.random() < 0.5 else -1.0
        away = side * (rng.uniform(*BESIDE) / edit.shapes.resolution + max(shape.shape) / 2)
        middle = at_row + away * along_col, at_col - away * along_row
        row, col = (round(place - size / 2) for place, size in zip(middle, shape.shape, strict=True))
    stamp(edit.cells, shape, row, col)


def door(edit: Edit, rng: np.random.Generator) -> None:
    """Add a wall across the path, with a gap of 0.5 to 0.9 m on it or near it; nothing if there is no path."""
    if edit.way is None:
        return
    at, along = point_of_way(edit, rng)
    across = np.array([along[1], -along[0]])
    cells = np.argwhere(np.ones_like(edit.cells)) - at
    forward, beside = cells @ along, cells @ across
    offset, half_gap = rng.uniform(-GAP_OFFSET, GAP_OFFSET), rng.uniform(*GAP) / 2
    left, right = rng.uniform(*WALL, size=2)
    thickness, m = rng.uniform(*THICKNESS), edit.shapes.resolution
    wall = (np.abs(forward) * m <= max(thickness, m) / 2) & (beside * m >= -left) & (beside * m <= right)
    gap = np.abs(beside * m - offset) <= half_gap
    edit.cells[(wall & ~gap).reshape(edit.cells.shape)] = True


def redraw(edit: Edit, rng: np.random.Generator) -> None:
    """Replace the map by a newly sampled one."""
    if edit.families:
        _, _, cells, edit.genome = draw_from(rng, edit.families, edit.shapes, edit.robot)
    else:
        cells = sample_map(rng, edit.shapes)
    edit.cells[:] = interior(cells, edit.shapes.border)


def point_of_way(edit: Edit, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Return a random point of the path, ``(row, col)`` of the inside in cells, and the unit vector along the path."""
    assert edit.way is not None
    cells = edit.way[:, ::-1] / edit.shapes.resolution - edit.shapes.border - 0.5
    place = int(rng.integers(len(cells)))
    before, after = cells[max(place - 5, 0)], cells[min(place + 5, len(cells) - 1)]
    along = after - before
    return cells[place], along / max(float(np.hypot(*along)), 1e-9)
