"""What an operator of mutation is, and what it is given: a map in the middle of a mutation."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from evolution.search.operators.sampling import Cells
from gym_mapbench.generator import FamilySpec, ShapeSettings
from gym_mapbench.world.robot import RobotSpec

Labels = NDArray[np.int32]


class MutationOptions(Protocol):
    """The options of mutation that the operators here look at; all of ``MutationSettings`` are there at run time."""

    @property
    def move_distance(self) -> int:
        """Farthest move along each axis, cells."""
        ...

    @property
    def scale_factor(self) -> tuple[float, float]:
        """Smallest and largest factor of an obstacle's height and width."""
        ...


@dataclass(frozen=True)
class Edit:
    """A map in the middle of a mutation, and the obstacle that was chosen.

    Args:
        cells: ``(rows, cols)`` True where there is a wall, row 0 at the bottom, without the border; operators draw on
            it. The obstacles of operators that lift them are taken off already. Start and goal are cleared afterwards.
        labels: ``(rows, cols)`` number of the obstacle that covered each cell before, 0 where there was none.
        obstacle: Number of the chosen one; 0 if the map had none.
        shapes: Options of the maps and of random shapes.
        settings: Options of mutation.
        families: Families whose pieces are new obstacles; empty for random shapes.
    """

    cells: Cells
    labels: Labels
    obstacle: int
    shapes: ShapeSettings
    settings: MutationOptions
    families: Sequence[FamilySpec] = ()
    robot: RobotSpec | None = None
    way: NDArray[np.float64] | None = None

    def cut_out(self) -> tuple[Cells, int, int]:
        """Return the chosen obstacle as a stamp, with the row and col of its lower-left cell."""
        rows, cols = ndimage.find_objects(self.labels, max_label=self.obstacle)[self.obstacle - 1]
        return self.labels[rows, cols] == self.obstacle, rows.start, cols.start


Change = Callable[[Edit, np.random.Generator], None]


@dataclass(frozen=True)
class Operator:
    """One thing that mutation can do.

    Args:
        change: Draws on ``edit.cells``, with no randomness but that of the generator.
        lifts: Whether the chosen obstacle is taken off the map beforehand.
        informed: Whether it looks at :attr:`Edit.way`; an obstacle that such an operator lifts is one near the way.
        anew: Whether it draws a whole new map, and so replaces every other change.
    """

    change: Change
    lifts: bool = False
    informed: bool = False
    anew: bool = False
