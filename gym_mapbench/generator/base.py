"""The interface of a family of maps, and functions that the built-in families share."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar, Protocol

import numpy as np

from gym_mapbench.errors import ConfigError
from gym_mapbench.generator.shapes import Cells, ShapeSettings
from gym_mapbench.settings import Settings


class Family(Protocol):
    """A kind of map: frozen options, most of them ranges, from which the genes of a map are sampled.

    A map is a function of its genes and of the world's size, resolution, border and cleared areas. Genes are
    JSON-able, so that a map can be kept as its genes, and changed by changing one of them. Places are given as
    shares of the room there is, sizes in m, so that the same genes make sense on maps of any size.

    Attributes:
        genes: Type of the genes.
    """

    genes: ClassVar[type[Settings]]

    def draw_genes(self, rng: np.random.Generator) -> Settings:
        """Sample the genes of one map."""
        ...

    def build(self, genes: Any, shapes: ShapeSettings) -> Cells:
        """Return the ``(size, size)`` occupancy of the map, with its border, and start and goal areas cleared.

        Args:
            genes: What :meth:`draw_genes` returned, perhaps changed since.
            shapes: Size, resolution, border and cleared areas; its shapes are not sampled.

        Raises:
            ConfigError: If the map is too small for the family.
        """
        ...


def empty(shapes: ShapeSettings) -> Cells:
    """Return ``(size, size)`` free cells."""
    return np.zeros((shapes.size, shapes.size), dtype=np.bool_)


def to_cells(length: float, shapes: ShapeSettings) -> int:
    """Return the number of cells nearest to a length in m, at least 1."""
    return max(1, round(length / shapes.resolution))


def mirrored(cells: Cells) -> Cells:
    """Mirror a map about the straight line from start to goal: below becomes right, and so on."""
    return cells[::-1, ::-1].T


def wall_rows(shapes: ShapeSettings, thickness: float, places: Sequence[float]) -> list[slice]:
    """Return the rows of walls across the way: one in each of the equally high parts between start and goal.

    Args:
        shapes: The world; no wall is in the rows of its cleared areas.
        thickness: Thickness of every wall, m.
        places: Where each wall is in its part, 0 (below) to 1 (above), the one nearest to the start first.

    Raises:
        ConfigError: If the map is too small.
    """
    low = min(shapes.border + shapes.task_distance + shapes.cleared_distance + 1, shapes.size // 2)
    part, thick = (shapes.size - 2 * low) / len(places), to_cells(thickness, shapes)
    if part < 2 * thick:
        needed = 2 * low + 2 * thick * len(places)
        raise ConfigError(
            f"size: expected at least {needed} cells for walls across the way ({len(places)} of {thickness:.3g} m), "
            f"got {shapes.size}"
        )
    rows = [low + round(part * number + place * (part - thick)) for number, place in enumerate(places)]
    return [slice(row, row + thick) for row in rows]
