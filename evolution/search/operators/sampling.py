"""Sampling of new map sets, shape by shape (thesis, section 4.1.2)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymoo.core.sampling import Sampling

from gym_mapbench.errors import ConfigError
from gym_mapbench.generator import DrawnMap, PeopleSettings, ShapeSettings, default_task, sample_map, with_people
from gym_mapbench.world.genome import Genome
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.scenario import MapSet, Scenario

Cells = NDArray[np.bool_]
Column = NDArray[np.object_]
MAX_MAPS = 20
"""Maps that are sampled until one has room for a person."""
NOBODY = PeopleSettings()
DrawMap = Callable[[np.random.Generator, ShapeSettings], Cells | DrawnMap]


def as_column(map_sets: list[MapSet]) -> Column:
    """Return map sets as an object array of shape ``(n, 1)``, the variables of pymoo."""
    column = np.empty((len(map_sets), 1), dtype=object)
    for row, map_set in enumerate(map_sets):  # an assignment of the list would unpack the sets
        column[row, 0] = map_set
    return column


def scenario_on(cells: Cells, shapes: ShapeSettings, genome: Genome | None = None) -> Scenario:
    """Return the scenario of the default task on ``(rows, cols)`` occupied cells, built from a genome or not."""
    grid = GridMap(cells, shapes.resolution)
    return Scenario(grid, *default_task(grid, shapes.border + shapes.task_distance), genome=genome)


def scenario_of(drawn: Cells | DrawnMap, shapes: ShapeSettings) -> Scenario:
    """Return the scenario of the default task on a sampled map."""
    if isinstance(drawn, DrawnMap):
        return scenario_on(drawn.cells, shapes, drawn.genome)
    return scenario_on(drawn, shapes)


class MapSampling(Sampling):  # type: ignore[misc]
    """Samples maps and individuals; an operator of pymoo.

    Args:
        maps_per_set: Maps in an individual.
        shapes: Options of the maps.
        draw_map: Samples one map; must leave start and goal free.
        people: The people on every map.
    """

    def __init__(
        self, maps_per_set: int, shapes: ShapeSettings, draw_map: DrawMap = sample_map, people: PeopleSettings = NOBODY
    ) -> None:
        super().__init__()
        self.maps_per_set = maps_per_set
        self.shapes = shapes
        self.draw_map = draw_map
        self.people = people

    def draw(self, rng: np.random.Generator) -> Scenario:
        """Return one sampled map, with people if there are any.

        Raises:
            ConfigError: If there are people and none of 20 maps has room for one.
        """
        for _ in range(MAX_MAPS):
            scenario = with_people(scenario_of(self.draw_map(rng, self.shapes), self.shapes), self.people, rng)
            if scenario.bodies or not self.people.count:
                return scenario
        raise ConfigError(f"people: expected maps with room for a person, got none in {MAX_MAPS} samples")

    def draw_set(self, rng: np.random.Generator) -> MapSet:
        """Return one sampled individual."""
        return MapSet(tuple(self.draw(rng) for _ in range(self.maps_per_set)))

    def _do(self, _problem: Any, n_samples: int, *_: Any, random_state: np.random.Generator, **__: Any) -> Column:
        return as_column([self.draw_set(random_state) for _ in range(n_samples)])
