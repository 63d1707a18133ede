"""Mutation: some obstacles of every map of a set are changed (thesis, section 4.1.5).

An obstacle is a connected component of the cells inside the border. The obstacles chosen on a
map are taken off first and put back changed (:mod:`evolution.search.operators.changes`), so that
they do not cut into each other.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from pymoo.core.mutation import Mutation
from scipy import ndimage

from evolution.search.operators.changes import OPERATORS, Edit, Labels
from evolution.search.operators.sampling import Cells, Column, as_column, scenario_on
from evolution.search.settings import MutationSettings
from gym_mapbench.generator import FamilySpec, ShapeSettings, clear_and_border, interior
from gym_mapbench.scenario import MapSet


def mutate_map(
    cells: Cells,
    shapes: ShapeSettings,
    settings: MutationSettings,
    rng: np.random.Generator,
    families: Sequence[FamilySpec] = (),
) -> Cells:
    """Return a copy of ``(rows, cols)`` cells with some obstacles changed.

    The border is taken off before and put back after; start and goal areas are cleared again.

    Args:
        cells: The map.
        shapes: Options of the map's border and of random shapes.
        settings: How obstacles change.
        rng: Source of all randomness.
        families: Families whose pieces are added; random shapes if empty.
    """
    inside = interior(cells, shapes.border)
    labels, count = label_obstacles(inside, settings.connectivity)
    changes = [(obstacle, name, OPERATORS.get(name)) for obstacle, name in draw_changes(count, settings, rng)]
    changed = inside & ~np.isin(labels, [obstacle for obstacle, _, operator in changes if operator.lifts])
    for obstacle, name, operator in changes:
        with OPERATORS.blamed(name):
            operator.change(Edit(changed, labels, obstacle, shapes, settings, tuple(families)), rng)
    mutated = cells.copy()
    interior(mutated, shapes.border)[:] = changed
    return clear_and_border(mutated, shapes)


def label_obstacles(cells: Cells, connectivity: int = 4) -> tuple[Labels, int]:
    """Number the connected obstacles from 1; returns their labels (0 where free) and their number."""
    neighbours = ndimage.generate_binary_structure(2, 1 if connectivity == 4 else 2)
    labels, count = ndimage.label(cells, structure=neighbours)
    return np.asarray(labels, dtype=np.int32), int(count)


def draw_changes(count: int, settings: MutationSettings, rng: np.random.Generator) -> list[tuple[int, str]]:
    """Choose some of ``count`` obstacles and an operator for each; a map without obstacles only gets new ones."""
    changes = int(rng.integers(*settings.shapes_per_map, endpoint=True))
    if count == 0:
        return [(0, "add")] * changes
    chosen = rng.choice(count, size=min(changes, count), replace=False) + 1
    names, chances = zip(*settings.probabilities.items(), strict=True)
    operators = rng.choice(len(names), size=len(chosen), p=chances)
    return [(int(obstacle), names[operator]) for obstacle, operator in zip(chosen, operators, strict=True)]


def mutate_map_set(
    map_set: MapSet,
    shapes: ShapeSettings,
    settings: MutationSettings,
    rng: np.random.Generator,
    families: Sequence[FamilySpec] = (),
) -> MapSet:
    """Return a map set of which every map is mutated; arguments as for :func:`mutate_map`."""
    mutated = (mutate_map(scenario.map.occupancy, shapes, settings, rng, families) for scenario in map_set)
    return MapSet(tuple(scenario_on(cells, shapes) for cells in mutated))


class MapMutation(Mutation):  # type: ignore[misc]
    """pymoo's view of :func:`mutate_map_set`; an individual is mutated with ``settings.probability``.

    Args:
        shapes: Options of the map's border and of random shapes.
        settings: How obstacles change.
        families: Families whose pieces are added; random shapes if empty.
    """

    def __init__(self, shapes: ShapeSettings, settings: MutationSettings, families: Sequence[FamilySpec] = ()) -> None:
        super().__init__(prob=1.0)
        self.shapes = shapes
        self.settings = settings
        self.families = families

    def _do(self, _problem: Any, X: Column, *_: Any, random_state: np.random.Generator, **__: Any) -> Column:
        # p_m is applied here and not by pymoo, which would mutate all individuals and discard most of the work.
        hit = random_state.random(len(X)) < self.settings.probability
        sets = [
            mutate_map_set(map_set, self.shapes, self.settings, random_state, self.families) if mutated else map_set
            for map_set, mutated in zip(X[:, 0], hit, strict=True)
        ]
        return as_column(sets)
