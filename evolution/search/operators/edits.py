"""Mutation operators and what they get: a map in the middle of a mutation."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import scipy
from numpy.typing import NDArray
from pydantic import field_validator

from evolution.search.operators.sampling import Cells
from gym_mapbench.errors import ConfigError
from gym_mapbench.generator import FamilySpec, ShapeSettings
from gym_mapbench.quantities import Few, Positive
from gym_mapbench.settings import Settings
from gym_mapbench.world.genome import Genome
from gym_mapbench.world.robot import RobotSpec

Labels = NDArray[np.int32]
T = TypeVar("T", int, float)


class EditSettings(Settings):
    """The options that operators read.

    Args:
        move_distance: Farthest move along each axis, cells.
        scale_factor: Smallest and largest factor of an obstacle's height and width.
    """

    move_distance: Few = 15
    scale_factor: tuple[Positive, Positive] = (0.5, 1.5)

    @field_validator("scale_factor")
    @classmethod
    def _factors_ordered(cls, value: tuple[float, float]) -> tuple[float, float]:
        return ordered(value)


def ordered(bounds: tuple[T, T]) -> tuple[T, T]:
    """Return two bounds, the smaller first; raises ``ConfigError`` if the first is larger."""
    if bounds[0] > bounds[1]:
        raise ConfigError(f"expected (smallest, largest), got {bounds}")
    return bounds


@dataclass
class Edit:
    """A map in the middle of a mutation, and the obstacle that was chosen.

    Args:
        cells: ``(rows, cols)`` True where there is a wall, row 0 at the bottom, without the border; operators change
            it. Obstacles whose operator has ``lifts`` are removed already. Start and goal are cleared afterwards.
        labels: ``(rows, cols)`` number of the obstacle that covered each cell before, 0 where there was none.
        obstacle: Number of the chosen obstacle; 0 if the map had none.
        shapes: Options of the maps and of random shapes.
        settings: Options of mutation.
        robot: The robot that must be able to drive on the map.
        families: Families whose pieces are new obstacles; empty for random shapes.
        way: ``(n, 2)`` path that Nav2 plans, x and y, m; None if there is none or no operator needs it.
        genome: The genome of a map that an operator sampled; None where cells were changed.
    """

    cells: Cells
    labels: Labels
    obstacle: int
    shapes: ShapeSettings
    settings: EditSettings
    robot: RobotSpec
    families: Sequence[FamilySpec] = ()
    way: NDArray[np.float64] | None = None
    genome: Genome | None = None

    def cut_out(self) -> tuple[Cells, int, int]:
        """Return the chosen obstacle as a stamp, with the row and col of its lower-left cell."""
        rows, cols = scipy.ndimage.find_objects(self.labels, max_label=self.obstacle)[self.obstacle - 1]
        return self.labels[rows, cols] == self.obstacle, rows.start, cols.start


Change = Callable[[Edit, np.random.Generator], None]


@dataclass(frozen=True)
class Operator:
    """A mutation operator.

    Args:
        change: Changes ``edit.cells``, with no randomness but that of the generator.
        lifts: Whether the chosen obstacle is removed from the map beforehand.
        informed: Whether it uses :attr:`Edit.way`; the obstacle that such an operator lifts is near the path.
        anew: Whether it samples a whole new map, and so replaces every other change.
    """

    change: Change
    lifts: bool = False
    informed: bool = False
    anew: bool = False
