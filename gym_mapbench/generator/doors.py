"""Doors: walls across the way, each with a gap."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from gym_mapbench.generator.base import empty, mirrored, to_cells, wall_rows
from gym_mapbench.generator.ranges import (
    CountRange,
    FractionRange,
    Length,
    LengthRange,
    sample,
    sample_count,
    sample_flag,
)
from gym_mapbench.generator.shapes import Cells, ShapeSettings, clear_and_border
from gym_mapbench.quantities import Fraction
from gym_mapbench.settings import Settings


class Door(Settings):
    """One wall and the gap in it.

    Args:
        place: Where the wall is in its part of the way, 0 to 1.
        gap: Width of the gap, m.
        at: Where the gap is along the wall, 0 (left) to 1 (right).
    """

    place: Fraction
    gap: Length
    at: Fraction


class DoorsGenes(Settings):
    """A map with doors.

    Args:
        doors: Its walls, the one nearest to the start first.
        thickness: Thickness of the walls, m.
        mirrored: Whether the walls run from bottom to top instead of from left to right.
    """

    doors: tuple[Door, ...]
    thickness: Length
    mirrored: bool


class Doors(Settings):
    """Walls across the whole way, each with one door to pass through.

    ::

        ##############
        # G          #
        #            #
        #### #########
        #            #
        #            #
        ########  ####
        #          S #
        ##############

    Args:
        walls: Range of their number.
        gap: Range of the doors' widths, m.
        at: Range of the doors' places along the wall, shares of its length.
        place: Range of a wall's place in its part of the way; the middle half keeps walls apart.
        thickness: Range of the walls' thickness, m.
    """

    genes: ClassVar[type[Settings]] = DoorsGenes

    walls: CountRange = (1, 3)
    gap: LengthRange = (0.5, 0.9)
    at: FractionRange = (0.0, 1.0)
    place: FractionRange = (0.25, 0.75)
    thickness: LengthRange = (0.05, 0.2)

    def draw_genes(self, rng: np.random.Generator) -> DoorsGenes:
        """Sample the genes of one map."""
        return DoorsGenes(
            doors=tuple(
                Door(place=sample(rng, self.place), gap=sample(rng, self.gap), at=sample(rng, self.at))
                for _ in range(sample_count(rng, self.walls))
            ),
            thickness=sample(rng, self.thickness),
            mirrored=sample_flag(rng),
        )

    def build(self, genes: DoorsGenes, shapes: ShapeSettings) -> Cells:
        """Return the occupancy; see :meth:`Family.build`."""
        cells = empty(shapes)
        for rows, door in zip(
            wall_rows(shapes, genes.thickness, [door.place for door in genes.doors]), genes.doors, strict=True
        ):
            gap = to_cells(door.gap, shapes)
            left = shapes.border + round(door.at * max(0, shapes.size - 2 * shapes.border - gap))
            cells[rows] = True
            cells[rows, left : left + gap] = False
        return clear_and_border(mirrored(cells) if genes.mirrored else cells, shapes)
