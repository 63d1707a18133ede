"""Random maps as in the thesis (sections 4.1.2 and 5.1): circles, squares and walls scattered over a bordered square.

Every function is a function of its arguments and of the generator passed to it; arrays are
``[row, col]`` with row 0 at the bottom.
"""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from gym_mapbench.errors import ConfigError, PluginError
from gym_mapbench.generator.ranges import CellRange, NumberRange, sample_count
from gym_mapbench.kernels import shapes as kernels
from gym_mapbench.kernels.jit import plain
from gym_mapbench.kernels.shapes import occupy, scatter
from gym_mapbench.quantities import Fraction, Natural, Positive
from gym_mapbench.settings import Settings
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.scenario import Pose

Cells = NDArray[np.bool_]

_draw_shape, _draw_position = plain(kernels.draw_shape), plain(kernels.draw_position)
TASK_YAW = 3 * math.pi / 4
"""Heading of start and goal: from the lower right to the upper left."""


class ShapeSettings(Settings):
    """What random maps are made of; the defaults are those of the thesis where it has them. Ranges include both ends.

    Args:
        size: Rows and columns of the map, cells.
        resolution: Side of a cell, m.
        n_obstacles: Fewest and most shapes on a map.
        circle_probability: Probability that a shape is a filled circle.
        square_probability: Probability that it is a filled square.
        wall_probability: Probability that it is a wall, horizontal or vertical.
        circle_radius: Range of a circle's radius, cells.
        square_side: Range of a square's side, cells.
        wall_length: Range of a wall's length, cells.
        wall_thickness: Range of a wall's thickness, cells.
        border: Thickness of the wall around the map, cells.
        task_distance: Free cells between the border and the cells of start and goal.
        cleared_distance: The square cleared around start and goal reaches this many cells to every side.
    """

    size: Annotated[int, Field(ge=5, le=5000)] = 150
    resolution: Positive = 0.05
    n_obstacles: NumberRange = (15, 40)
    circle_probability: Fraction = 0.2
    square_probability: Fraction = 0.3
    wall_probability: Fraction = 0.5
    circle_radius: CellRange = (2, 10)
    square_side: CellRange = (4, 10)
    wall_length: CellRange = (10, 30)
    wall_thickness: CellRange = (1, 3)
    border: Natural = 1
    task_distance: Natural = 10
    cleared_distance: Natural = 10

    @model_validator(mode="after")
    def _consistent(self) -> ShapeSettings:
        if not math.isclose(sum(self.probabilities), 1.0, abs_tol=1e-9):
            raise ConfigError(f"shape probabilities: expected a sum of 1, got {self.probabilities}")
        if self.size <= 2 * (self.border + self.task_distance):
            needed = 2 * (self.border + self.task_distance) + 1
            raise ConfigError(f"size: expected at least {needed} cells for border and task_distance, got {self.size}")
        return self

    @property
    def probabilities(self) -> tuple[float, float, float]:
        """Probabilities of circle, square and wall."""
        return self.circle_probability, self.square_probability, self.wall_probability

    @property
    def sizes(self) -> tuple[tuple[int, int], ...]:
        """Ranges of a circle's radius, a square's side, and a wall's length and thickness, cells."""
        return self.circle_radius, self.square_side, self.wall_length, self.wall_thickness


def draw_shape(rng: np.random.Generator, settings: ShapeSettings) -> Cells:
    """Sample kind, size and orientation of one obstacle; return its ``(height, width)`` bool stamp."""
    height, width, is_round = _draw_shape(rng, settings.probabilities, settings.sizes)
    cells = np.zeros((height, width), dtype=np.bool_)
    occupy(cells, 0, 0, height, width, is_round)
    return cells


def disc(radius: int) -> Cells:
    """Return the ``(2 * radius + 1,) * 2`` stamp of the cells within ``radius`` cells of its middle."""
    side = 2 * radius + 1
    cells = np.zeros((side, side), dtype=np.bool_)
    occupy(cells, 0, 0, side, side, True)
    return cells


def draw_position(rng: np.random.Generator, shape: tuple[int, int], area: tuple[int, int]) -> tuple[int, int]:
    """Sample ``(row, col)`` of a stamp's lower-left cell, uniformly over all places inside ``(rows, cols)``.

    A stamp larger than the area is placed at 0 and sticks out.
    """
    row, col = _draw_position(rng, *shape, *area)
    return int(row), int(col)


def stamp(cells: Cells, shape: Cells, row: int, col: int) -> None:
    """Occupy the cells under a stamp whose lower-left cell is ``(row, col)``; what lies outside is cut off."""
    height, width = shape.shape
    top, left = max(0, -row), max(0, -col)
    target = cells[max(0, row) : max(0, row + height), max(0, col) : max(0, col + width)]
    target |= shape[top : top + target.shape[0], left : left + target.shape[1]]


def sample_map(rng: np.random.Generator, settings: ShapeSettings) -> Cells:
    """Sample the ``(size, size)`` occupancy of one map, with its border, and start and goal areas cleared."""
    cells = np.zeros((settings.size, settings.size), dtype=np.bool_)
    inside = interior(cells, settings.border)
    scatter(rng, inside, sample_count(rng, settings.n_obstacles), settings.probabilities, settings.sizes)
    return clear_and_border(cells, settings)


def checked_cells(cells: object, shape: tuple[int, ...], what: str) -> Cells:
    """Return what a third party made, if it is the cells of a map.

    Args:
        cells: What it made.
        shape: ``(rows, cols)`` of the map.
        what: Names the third party and its product; the message begins with it.

    Raises:
        PluginError: If it is not a bool array of this shape.
    """
    if not isinstance(cells, np.ndarray) or (cells.shape, cells.dtype) != (shape, np.bool_):
        got = f"{cells.dtype} {cells.shape}" if isinstance(cells, np.ndarray) else type(cells).__name__
        raise PluginError(f"{what} as bool {shape}, got {got}")
    return cells


def interior(cells: Cells, border: int) -> Cells:
    """Return the view of the cells inside the border."""
    rows, cols = cells.shape
    return cells[border : rows - border, border : cols - border]


def clear_and_border(cells: Cells, settings: ShapeSettings) -> Cells:
    """Return a copy with start and goal areas cleared and the border filled."""
    repaired = cells.copy()
    reach = settings.cleared_distance
    for row, col in task_cells((cells.shape[0], cells.shape[1]), settings.border + settings.task_distance):
        repaired[max(0, row - reach) : row + reach + 1, max(0, col - reach) : col + reach + 1] = False
    bordered = np.ones_like(repaired)
    interior(bordered, settings.border)[:] = interior(repaired, settings.border)
    return bordered


def task_cells(shape: tuple[int, int], margin: int) -> tuple[tuple[int, int], tuple[int, int]]:
    """Return ``(row, col)`` of start (lower right) and goal (upper left), ``margin`` cells inside the map."""
    rows, cols = shape
    return (margin, cols - 1 - margin), (rows - 1 - margin, margin)


def default_task(grid: GridMap, margin: int = 11) -> tuple[Pose, Pose]:
    """Return start (near the lower right) and goal (near the upper left), both facing up and left.

    The points lie a quarter of a cell inside their cells: NavFn rounds points to cells, and the
    middle of a cell would be a tie.

    Args:
        grid: The map.
        margin: Cells between the map's edge and the cells of start and goal; border + 10 by default.

    Raises:
        ConfigError: If the map is too small.
    """
    if min(grid.shape) <= 2 * margin:
        raise ConfigError(f"map: expected more than {2 * margin} cells a side for the default task, got {grid.shape}")
    start, goal = (
        Pose(*grid.cell_to_world(row - 0.25, col - 0.25), TASK_YAW) for row, col in task_cells(grid.shape, margin)
    )
    return start, goal
