"""Samples maps of families that a robot can drive; a map without a way for the robot is replaced by another."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gym_mapbench.costmap import CostmapParams, build_static_costmap
from gym_mapbench.errors import ConfigError, NoPathError
from gym_mapbench.generator.families import FamilySpec, build_map, sample_genes
from gym_mapbench.generator.genomes import genome_of
from gym_mapbench.generator.shapes import (
    Cells,
    ShapeSettings,
    default_task,
    draw_position,
    draw_shape,
    interior,
    sample_map,
)
from gym_mapbench.planners.navfn import NavfnParams, NavfnPlanner
from gym_mapbench.settings import Settings
from gym_mapbench.world.footprint import Footprint
from gym_mapbench.world.genome import Genome
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.robot import RobotSpec
from gym_mapbench.world.scenario import Pose

MAX_SAMPLES = 200
TO_THE_GOAL = NavfnParams(tolerance=0.0)
LONGEST_PLAN = 0.9
"""Longest plan that a sampled map may have, as a share of the longest that NavFn can follow.

NavFn gives up after 4 max(rows, cols) points; the rest is a reserve, as noise and other inflation make plans longer.
"""


class DrawnMap(NamedTuple):
    """A sampled map.

    Args:
        family: Name of its family.
        genes: The genes it was built from.
        cells: Its ``(size, size)`` occupancy.
        genome: Its genes as plain data, to be kept with it; None for a family whose genes no operator changes.
    """

    family: str
    genes: Settings
    cells: Cells
    genome: Genome | None = None


def draw_from(
    rng: np.random.Generator, families: Sequence[FamilySpec], shapes: ShapeSettings, robot: RobotSpec
) -> DrawnMap:
    """Sample one of some families, then a map of it on which the robot gets from start to goal.

    Args:
        rng: Source of all randomness.
        families: One or more, all equally likely.
        shapes: Size, resolution, border and cleared areas of the map.
        robot: The robot that must be able to drive the map, see :func:`is_drivable`.

    Raises:
        ConfigError: If the map is too small for the family, or none of 200 maps is drivable.
    """
    spec = families[int(rng.integers(len(families)))].for_robot(robot)
    family = spec.make()
    for _ in range(MAX_SAMPLES):
        genes = sample_genes(spec.name, family, rng)
        cells = build_map(spec.name, family, genes, shapes)
        if is_drivable(cells, shapes, robot):
            return DrawnMap(spec.name, genes, cells, genome_of(spec, genes))
    raise ConfigError(
        f"{spec.name}: expected maps that {robot.name} can drive with a cell to spare, "
        f"got none in {MAX_SAMPLES} samples; widen the ranges of its options"
    )


def is_drivable(cells: Cells, shapes: ShapeSettings, robot: RobotSpec) -> bool:
    """Whether there is a way from start to goal, see :func:`plan_way`."""
    return plan_way(cells, shapes, robot) is not None


def plan_way(cells: Cells, shapes: ShapeSettings, robot: RobotSpec) -> NDArray[np.float64] | None:
    """Return :func:`find_way` for the cells of a map with the thesis' start and goal.

    Args:
        cells: ``(rows, cols)`` occupancy.
        shapes: Resolution, and the place of start and goal.
        robot: Its shape.
    """
    grid = GridMap(cells, shapes.resolution)
    return find_way(grid, *default_task(grid, shapes.border + shapes.task_distance), robot)


@functools.lru_cache(maxsize=256)  # a search asks for a map several times, and operators return maps of before
def find_way(grid: GridMap, start: Pose, goal: Pose, robot: RobotSpec) -> NDArray[np.float64] | None:
    """Return NavFn's way from start to goal that it can still follow when lidar noise has narrowed it.

    Noise marks cells in front of walls: in Nav2's global costmap it closes gaps of 0.45 and 0.50 m to a robot with
    a radius of 0.22 m, which needs 0.45 m without noise, and leaves 0.55 m open. So a cell is kept free on both sides.

    Args:
        grid: The map.
        start: Where the robot starts.
        goal: Where it shall go.
        robot: Its shape.

    Returns:
        ``(n, 2)`` x and y, m, read-only; None if there is no way, or NavFn would give up on it.
    """
    costmap = build_static_costmap(grid, *_with_cell_to_spare(robot, grid.resolution))
    try:
        path = NavfnPlanner(TO_THE_GOAL).plan(costmap, start, goal)
    except NoPathError:
        return None
    path.flags.writeable = False
    return path[:, :2] if len(path) <= LONGEST_PLAN * 4 * max(grid.shape) else None


@functools.lru_cache(maxsize=64)
def _with_cell_to_spare(robot: RobotSpec, resolution: float) -> tuple[CostmapParams, Footprint]:
    """Return the options of the costmap, and the footprint of the robot, padded by one more cell (m)."""
    params = CostmapParams.example_global()
    wider = params.replace(footprint_padding=params.footprint_padding + resolution)
    return params, wider.make_footprint(robot)


def draw_map(
    rng: np.random.Generator, shapes: ShapeSettings, families: Sequence[FamilySpec], robot: RobotSpec
) -> Cells:
    """Sample the occupancy of a map of one of the families; without families as in the thesis, drivable or not."""
    return draw_from(rng, families, shapes, robot).cells if families else sample_map(rng, shapes)


def draw_obstacle(
    rng: np.random.Generator, shapes: ShapeSettings, families: Sequence[FamilySpec], area: tuple[int, int]
) -> tuple[Cells, int, int]:
    """Sample an obstacle to add to a map: a random shape, or a piece of a new map if there are families.

    Args:
        rng: Source of all randomness.
        shapes: The world; a piece is as high and wide as the longest wall of its random shapes.
        families: Families of maps, all equally likely.
        area: Rows and columns inside the border.

    Returns:
        A stamp, and ``(row, col)`` of its lower-left cell inside the border.
    """
    if not families:
        shape = draw_shape(rng, shapes)
        return shape, *draw_position(rng, (shape.shape[0], shape.shape[1]), area)
    spec = families[int(rng.integers(len(families)))]
    family = spec.make()
    cells = build_map(spec.name, family, sample_genes(spec.name, family, rng), shapes)
    return cut_piece(rng, interior(cells, shapes.border), shapes.wall_length[1])


def cut_piece(rng: np.random.Generator, cells: Cells, side: int) -> tuple[Cells, int, int]:
    """Cut a square of up to ``side`` cells around one of a map's occupied cells; empty if there are none."""
    occupied = np.argwhere(cells)
    row, col = occupied[rng.integers(len(occupied))] - side // 2 if len(occupied) else (0, 0)
    row, col = max(0, int(row)), max(0, int(col))
    return cells[row : row + side, col : col + side], row, col
