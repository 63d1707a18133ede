"""Repair: closes the border and clears start and goal."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from pymoo.core.repair import Repair

from evolution.search.operators.sampling import Column, as_column, scenario_on
from gym_mapbench.generator import ShapeSettings, clear_and_border
from gym_mapbench.world.courses import find_wall
from gym_mapbench.world.scenario import MapSet, Scenario


def repair_scenario(scenario: Scenario, shapes: ShapeSettings) -> Scenario:
    """Return the scenario on the repaired map; the scenario itself if its map needs no repair."""
    repaired = clear_and_border(scenario.map.occupancy, shapes)
    if np.array_equal(repaired, scenario.map.occupancy):
        return scenario
    made = scenario_on(repaired, shapes)
    return replace(made, bodies=tuple(body for body in scenario.bodies if not find_wall(made.map, body)))


class MapRepair(Repair):  # type: ignore[misc]
    """:func:`repair_scenario` as a pymoo operator.

    Maps of the built-in operators need no repair; maps of third-party operators may.

    Args:
        shapes: Options of the map's border and cleared areas.
    """

    def __init__(self, shapes: ShapeSettings) -> None:
        super().__init__()
        self.shapes = shapes

    def _do(self, _problem: Any, X: Column, **_: Any) -> Column:
        return as_column([MapSet(tuple(repair_scenario(s, self.shapes) for s in map_set)) for map_set in X[:, 0]])
