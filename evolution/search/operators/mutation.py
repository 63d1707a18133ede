"""Mutation: obstacles are moved, scaled, removed and added (thesis, section 4.1.5).

An obstacle is a connected component of the cells inside the border. The obstacles chosen on a
map are lifted off first and put back changed, so that they do not cut into each other.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymoo.core.mutation import Mutation
from scipy import ndimage

from evolution.search.operators.sampling import Cells, Column, as_column, scenario_on
from evolution.search.settings import MutationSettings
from gym_mapbench.generator import ShapeSettings, clear_and_border, draw_position, draw_shape, interior, stamp
from gym_mapbench.scenario import MapSet

Labels = NDArray[np.int32]
MOVE, SCALE, REMOVE, ADD = range(4)


def mutate_map(cells: Cells, shapes: ShapeSettings, settings: MutationSettings, rng: np.random.Generator) -> Cells:
    """Return a copy of ``(rows, cols)`` cells with some obstacles changed.

    The border is taken off before and put back after; start and goal areas are cleared again.
    """
    inside = interior(cells, shapes.border)
    labels, count = label_obstacles(inside, settings.connectivity)
    changes = draw_changes(count, settings, rng)
    changed = inside & ~np.isin(labels, [obstacle for obstacle, operation in changes if operation != ADD])
    for obstacle, operation in changes:
        if operation == ADD:
            add_obstacle(changed, shapes, rng)
        elif operation == MOVE:
            move_obstacle(changed, labels, obstacle, settings.move_distance, rng)
        elif operation == SCALE:
            scale_obstacle(changed, labels, obstacle, settings.scale_factor, rng)
    mutated = cells.copy()
    interior(mutated, shapes.border)[:] = changed
    return clear_and_border(mutated, shapes)


def label_obstacles(cells: Cells, connectivity: int = 4) -> tuple[Labels, int]:
    """Number the connected obstacles from 1; returns labels (0 where free) and how many there are."""
    neighbours = ndimage.generate_binary_structure(2, 1 if connectivity == 4 else 2)
    labels, count = ndimage.label(cells, structure=neighbours)
    return np.asarray(labels, dtype=np.int32), int(count)


def draw_changes(count: int, settings: MutationSettings, rng: np.random.Generator) -> list[tuple[int, int]]:
    """Choose obstacles out of ``count`` and an operation for each; a map without obstacles only gets new ones."""
    changes = int(rng.integers(*settings.shapes_per_map, endpoint=True))
    if count == 0:
        return [(0, ADD)] * changes
    chosen = rng.choice(count, size=min(changes, count), replace=False) + 1
    operations = rng.choice(4, size=len(chosen), p=settings.probabilities)
    return list(zip(chosen.tolist(), operations.tolist(), strict=True))


def move_obstacle(cells: Cells, labels: Labels, obstacle: int, distance: int, rng: np.random.Generator) -> None:
    """Put a lifted obstacle back up to ``distance`` cells away along each axis, inside ``cells``."""
    shape, *position = cut_out(labels, obstacle)
    offsets = rng.integers(-distance, distance, size=2, endpoint=True)
    row, col = np.clip(position + offsets, 0, np.subtract(cells.shape, shape.shape))
    stamp(cells, shape, int(row), int(col))


def scale_obstacle(
    cells: Cells, labels: Labels, obstacle: int, factors: tuple[float, float], rng: np.random.Generator
) -> None:
    """Put a lifted obstacle back enlarged or reduced about its middle; what sticks out is cut off."""
    shape, row, col = cut_out(labels, obstacle)
    scaled = scale_shape(shape, float(rng.uniform(*factors)))
    (height, width), (new_height, new_width) = shape.shape, scaled.shape
    stamp(cells, scaled, row + (height - new_height) // 2, col + (width - new_width) // 2)


def cut_out(labels: Labels, obstacle: int) -> tuple[Cells, int, int]:
    """Return an obstacle as a stamp, with the row and col of its lower-left cell."""
    rows, cols = ndimage.find_objects(labels, max_label=obstacle)[obstacle - 1]
    return labels[rows, cols] == obstacle, rows.start, cols.start


def scale_shape(shape: Cells, factor: float) -> Cells:
    """Enlarge or reduce a stamp to the nearest cell; neither side gets shorter than one cell."""
    sizes = [(old, max(1, round(old * factor))) for old in shape.shape]
    rows, cols = (((np.arange(new) + 0.5) * old / new).astype(np.intp) for old, new in sizes)
    return shape[np.ix_(rows, cols)]


def add_obstacle(cells: Cells, shapes: ShapeSettings, rng: np.random.Generator) -> None:
    """Draw a new obstacle onto ``cells`` as sampling does."""
    shape = draw_shape(rng, shapes)
    stamp(cells, shape, *draw_position(rng, (shape.shape[0], shape.shape[1]), (cells.shape[0], cells.shape[1])))


def mutate_map_set(
    map_set: MapSet, shapes: ShapeSettings, settings: MutationSettings, rng: np.random.Generator
) -> MapSet:
    """Return a map set of which every map is mutated."""
    mutated = (mutate_map(scenario.map.occupancy, shapes, settings, rng) for scenario in map_set)
    return MapSet(tuple(scenario_on(cells, shapes) for cells in mutated))


class MapMutation(Mutation):  # type: ignore[misc]
    """pymoo's view of :func:`mutate_map_set`; an individual is mutated with ``settings.probability``.

    Args:
        shapes: The world's shapes and border.
        settings: How obstacles change.
    """

    def __init__(self, shapes: ShapeSettings, settings: MutationSettings) -> None:
        super().__init__(prob=1.0)
        self.shapes = shapes
        self.settings = settings

    def _do(self, _problem: Any, X: Column, *_: Any, random_state: np.random.Generator, **__: Any) -> Column:
        # p_m is applied here, so that what is not mutated costs nothing; pymoo's own would discard finished work.
        hit = random_state.random(len(X)) < self.settings.probability
        sets = [
            mutate_map_set(map_set, self.shapes, self.settings, random_state) if mutated else map_set
            for map_set, mutated in zip(X[:, 0], hit, strict=True)
        ]
        return as_column(sets)
