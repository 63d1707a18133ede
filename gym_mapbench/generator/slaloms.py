"""Slaloms: walls that reach in from alternating sides."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from gym_mapbench.generator.base import empty, mirrored, wall_rows
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


class Baffle(Settings):
    """One wall that ends before the other side.

    Args:
        place: Where it is in its part of the way, 0 to 1.
        reach: How far it reaches, share of the map's width; two neighbours overlap where these add up to more than 1.
    """

    place: Fraction
    reach: Fraction


class SlalomGenes(Settings):
    """A slalom.

    Args:
        baffles: Its walls, the one nearest to the start first.
        left_first: Whether the first one comes from the left, the second from the right, and so on.
        thickness: Thickness of the walls, m.
        mirrored: Whether the walls run from bottom to top instead of from left to right.
    """

    baffles: tuple[Baffle, ...]
    left_first: bool
    thickness: Length
    mirrored: bool


class Slaloms(Settings):
    """Walls from alternating sides, so that the way swings from one side to the other.

    ::

        ##############
        # G          #
        #            #
        #    #########
        #            #
        ########     #
        #            #
        #    #########
        #            #
        #          S #
        ##############

    Args:
        baffles: Range of the number of walls.
        reach: Range of how far a wall reaches, share of the map's width.
        place: Range of a wall's place in its part of the way; the middle half keeps walls apart.
        thickness: Range of the walls' thickness, m.
    """

    genes: ClassVar[type[Settings]] = SlalomGenes

    baffles: CountRange = (2, 4)
    reach: FractionRange = (0.4, 0.7)
    place: FractionRange = (0.25, 0.75)
    thickness: LengthRange = (0.05, 0.2)

    def draw_genes(self, rng: np.random.Generator) -> SlalomGenes:
        """Sample the genes of one map."""
        return SlalomGenes(
            baffles=tuple(
                Baffle(place=sample(rng, self.place), reach=sample(rng, self.reach))
                for _ in range(sample_count(rng, self.baffles))
            ),
            left_first=sample_flag(rng),
            thickness=sample(rng, self.thickness),
            mirrored=sample_flag(rng),
        )

    def build(self, genes: SlalomGenes, shapes: ShapeSettings) -> Cells:
        """Return the occupancy; see :meth:`Family.build`."""
        cells = empty(shapes)
        places = wall_rows(shapes, genes.thickness, [baffle.place for baffle in genes.baffles])
        for number, (rows, baffle) in enumerate(zip(places, genes.baffles, strict=True)):
            reach = round(baffle.reach * shapes.size)
            from_left = (number % 2 == 0) == genes.left_first
            cells[rows, slice(None, reach) if from_left else slice(shapes.size - reach, None)] = True
        return clear_and_border(mirrored(cells) if genes.mirrored else cells, shapes)
