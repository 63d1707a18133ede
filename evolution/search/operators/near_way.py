"""Changes of any map near the path that Nav2 plans, by the informed operators; start, goal and edge stay."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy
from numpy.typing import NDArray

from evolution.search.operators.changes import OPERATORS
from evolution.search.operators.edits import Edit, EditSettings
from evolution.search.operators.mutation import MAX_TRIES, NEAR, label_obstacles, obstacles_near
from evolution.search.operators.sampling import Cells
from gym_mapbench.generator import ShapeSettings, find_way
from gym_mapbench.world.robot import RobotSpec
from gym_mapbench.world.scenario import Scenario

BEFORE_ROBOT = 0.1
"""Distance between the robot's outline at start and goal and the nearest changed cell, m."""
MOST_CHANGES = 2


def change_near_way(
    scenario: Scenario, robot: RobotSpec, rng: np.random.Generator
) -> tuple[Scenario, tuple[str, ...]] | None:
    """Return a changed map with the same task, and the names of the operators; None if none was found.

    Args:
        scenario: Any map.
        robot: The robot that must be able to get from start to goal on both maps.
        rng: Source of all randomness.
    """
    way = find_way(scenario.map, scenario.start, scenario.goal, robot)
    if way is None:
        return None
    names = [name for name in OPERATORS.built_in if OPERATORS.get(name).informed]
    for _ in range(MAX_TRIES):
        count = int(rng.integers(1, MOST_CHANGES, endpoint=True))
        chosen = tuple(str(name) for name in rng.choice(names, size=count))
        grid = scenario.map.with_walls(_changed(scenario, way, robot, chosen, rng))
        if grid != scenario.map and find_way(grid, scenario.start, scenario.goal, robot) is not None:
            return replace(scenario, map=grid, genome=None), chosen
    return None


def _changed(
    scenario: Scenario, way: NDArray[np.float64], robot: RobotSpec, names: tuple[str, ...], rng: np.random.Generator
) -> Cells:
    """Return a copy of the cells, changed by some operators."""
    grid = scenario.map
    kept = _kept(scenario, robot.circumscribed_radius + BEFORE_ROBOT)
    shapes = ShapeSettings(resolution=grid.resolution, border=0)
    cells = grid.occupancy & ~kept
    local = way - np.array(grid.origin)
    for name in names:
        operator, (labels, _) = OPERATORS.get(name), label_obstacles(cells)
        near = obstacles_near(local / grid.resolution - 0.5, labels)[:NEAR] if operator.lifts and labels.any() else [0]
        obstacle = int(rng.choice(near))
        if operator.lifts and not obstacle:
            continue
        left = cells & ~(operator.lifts & (labels == obstacle))
        edit = Edit(left, labels, obstacle, shapes, EditSettings(), robot, way=local)
        operator.change(edit, rng)
        cells = edit.cells
    return np.where(kept, grid.occupancy, cells)


def _kept(scenario: Scenario, radius: float) -> Cells:
    """Return the cells that no operator changes: the edge of the map, and those around start and goal."""
    grid = scenario.map
    kept = np.pad(np.zeros(np.subtract(grid.shape, 2), dtype=np.bool_), 1, constant_values=True)
    points = np.ones(grid.shape, dtype=np.bool_)
    for cell in scenario.end_cells:
        points[cell] = False
    distance: NDArray[np.float64] = scipy.ndimage.distance_transform_edt(points) * grid.resolution
    return kept | (distance <= radius)
