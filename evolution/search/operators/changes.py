"""Mutation operators: move, scale, remove and add (thesis, section 4.1.5), and the registry of all operators.

An operator changes the inside of a map that is being mutated. A third-party operator is a function
``(edit, rng) -> None``, named ``module:attribute`` or registered in :data:`OPERATORS`. The option ``operators`` of
:class:`~evolution.search.operators.settings.MutationSettings` holds its probability.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from evolution.search.operators.edits import Edit, Operator
from evolution.search.operators.informed import door, near_way, nudge, redraw
from evolution.search.operators.sampling import Cells
from gym_mapbench.errors import ConfigError
from gym_mapbench.generator import draw_obstacle, stamp
from gym_mapbench.registry import Registry


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
    """Sample a new obstacle."""
    rows, cols = edit.cells.shape
    stamp(edit.cells, *draw_obstacle(rng, edit.shapes, edit.families, (rows, cols)))


def _operator(entry: Any) -> Operator:
    """Return an operator for an operator or a function."""
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
        "nudge": Operator(nudge, lifts=True, informed=True),
        "near_way": Operator(near_way, informed=True),
        "door": Operator(door, informed=True),
        "redraw": Operator(redraw, anew=True),
    },
    check=_operator,
)
"""The operators by name."""
