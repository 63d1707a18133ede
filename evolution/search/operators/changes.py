"""What mutation can do to an obstacle: move, scale, remove or add (thesis, section 4.1.5), or a third-party operator.

An operator draws on the inside of a map that is being mutated. A third-party operator is a function
``(edit, rng) -> None``, named ``module:attribute`` or registered in :data:`OPERATORS`; the option ``operators`` of
:class:`~evolution.search.settings.MutationSettings` says how often it is used.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from evolution.search.operators.sampling import Cells
from gym_mapbench.errors import ConfigError
from gym_mapbench.generator import FamilySpec, ShapeSettings, draw_obstacle, stamp
from gym_mapbench.registry import Registry

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
    """

    change: Change
    lifts: bool = False


def move(edit: Edit, rng: np.random.Generator) -> None:
    """Put the lifted obstacle back up to ``move_distance`` cells away along each axis, inside the map."""
    shape, *position = edit.cut_out()
    distance = edit.settings.move_distance
    offsets = rng.integers(-distance, distance, size=2, endpoint=True)
    row, col = np.clip(position + offsets, 0, np.subtract(edit.cells.shape, shape.shape))
    stamp(edit.cells, shape, int(row), int(col))


def scale(edit: Edit, rng: np.random.Generator) -> None:
    """Put the lifted obstacle back enlarged or reduced about its centre; parts outside the map are cut off."""
    shape, row, col = edit.cut_out()
    scaled = scale_shape(shape, float(rng.uniform(*edit.settings.scale_factor)))
    (height, width), (new_height, new_width) = shape.shape, scaled.shape
    stamp(edit.cells, scaled, row + (height - new_height) // 2, col + (width - new_width) // 2)


def scale_shape(shape: Cells, factor: float) -> Cells:
    """Enlarge or reduce a stamp, sides rounded to whole cells; neither gets shorter than one cell."""
    sizes = [(old, max(1, round(old * factor))) for old in shape.shape]
    rows, cols = (((np.arange(new) + 0.5) * old / new).astype(np.intp) for old, new in sizes)
    return shape[np.ix_(rows, cols)]


def remove(edit: Edit, rng: np.random.Generator) -> None:
    """Do not put the lifted obstacle back."""


def add(edit: Edit, rng: np.random.Generator) -> None:
    """Draw a new obstacle as sampling does."""
    rows, cols = edit.cells.shape
    stamp(edit.cells, *draw_obstacle(rng, edit.shapes, edit.families, (rows, cols)))


def _operator(entry: Any) -> Operator:
    """Accept an operator, or its function."""
    if isinstance(entry, Operator):
        return entry
    if not callable(entry):
        raise ConfigError(f"expected a function (edit, rng) -> None or an Operator, got {type(entry).__name__}")
    return Operator(entry)


OPERATORS: Registry[Operator] = Registry(
    "mutation operator",
    "mutation_operators",
    {
        "move": Operator(move, lifts=True),
        "scale": Operator(scale, lifts=True),
        "remove": Operator(remove, lifts=True),
        "add": Operator(add),
    },
    check=_operator,
)
"""The operators by name."""
