"""U-traps: dead ends that open towards the start."""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np

from gym_mapbench.generator.base import empty, mirrored, to_cells
from gym_mapbench.generator.ranges import (
    CountRange,
    FractionRange,
    Length,
    LengthRange,
    SignedFractionRange,
    sample,
    sample_count,
    sample_flag,
)
from gym_mapbench.generator.shapes import Cells, ShapeSettings, clear_and_border, stamp, task_cells
from gym_mapbench.quantities import Fraction, SignedFraction
from gym_mapbench.settings import Settings

ENDS = 0.1
"""Share of the straight way at either end on which no trap is put."""


class Trap(Settings):
    """One dead end.

    Args:
        place: Where its middle is in its part of the straight way, 0 to 1.
        aside: Distance of its middle from that way, share of its width; positive is above it and to its right.
        width: From outer wall to outer wall, m.
        depth: From the opening to the outside of its back wall, m.
        opens_right: Whether it opens to the right instead of downwards.
    """

    place: Fraction
    aside: SignedFraction
    width: Length
    depth: Length
    opens_right: bool


class UTrapGenes(Settings):
    """A map with dead ends.

    Args:
        traps: The one nearest to the start first.
        thickness: Thickness of all walls, m.
    """

    traps: tuple[Trap, ...]
    thickness: Length


class UTraps(Settings):
    """Dead ends on the straight way from start to goal, which the robot has to drive around.

    ::

        ##################
        # G              #
        #                #
        #   #######      #
        #   #     #      #
        #   #     #      #
        #          ##### #
        #          #     #
        #          ##### #
        #              S #
        ##################

    Args:
        traps: Range of their number.
        place: Range of a trap's place in its part of the straight way.
        aside: Range of a trap's distance from that way, share of its width.
        width: Range of the traps' widths, m.
        depth: Range of their depths, m.
        thickness: Range of the walls' thickness, m.
    """

    genes: ClassVar[type[Settings]] = UTrapGenes

    traps: CountRange = (1, 3)
    place: FractionRange = (0.25, 0.75)
    aside: SignedFractionRange = (-0.4, 0.4)
    width: LengthRange = (0.9, 2.2)
    depth: LengthRange = (0.6, 1.6)
    thickness: LengthRange = (0.05, 0.2)

    def draw_genes(self, rng: np.random.Generator) -> UTrapGenes:
        """Sample the genes of one map."""
        traps = tuple(self._draw_trap(rng) for _ in range(sample_count(rng, self.traps)))
        return UTrapGenes(traps=traps, thickness=sample(rng, self.thickness))

    def _draw_trap(self, rng: np.random.Generator) -> Trap:
        numbers = {name: sample(rng, getattr(self, name)) for name in ("place", "aside", "width", "depth")}
        return Trap(**numbers, opens_right=sample_flag(rng))

    def build(self, genes: UTrapGenes, shapes: ShapeSettings) -> Cells:
        """Return the occupancy; see :meth:`Family.build`."""
        cells = empty(shapes)
        start, goal = task_cells((shapes.size, shapes.size), shapes.border + shapes.task_distance)
        for number, trap in enumerate(genes.traps):
            shape = _shape(trap, to_cells(genes.thickness, shapes), shapes)
            along = ENDS + (1 - 2 * ENDS) * (number + trap.place) / len(genes.traps)
            beside = trap.aside * to_cells(trap.width, shapes) / math.sqrt(2)
            middle = [a + along * (b - a) + beside for a, b in zip(start, goal, strict=True)]
            row, col = (round(at - part / 2) for at, part in zip(middle, shape.shape, strict=True))
            stamp(cells, shape, row, col)
        return clear_and_border(cells, shapes)


def _shape(trap: Trap, thickness: int, shapes: ShapeSettings) -> Cells:
    """Return the stamp of one dead end."""
    shape = np.zeros((to_cells(trap.depth, shapes), to_cells(trap.width, shapes)), dtype=np.bool_)
    shape[-thickness:] = shape[:, :thickness] = shape[:, -thickness:] = True
    return mirrored(shape) if trap.opens_right else shape
