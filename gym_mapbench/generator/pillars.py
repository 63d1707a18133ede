"""Pillar fields: square pillars in rows."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from gym_mapbench.generator.base import empty, to_cells
from gym_mapbench.generator.ranges import FractionRange, Length, LengthRange, sample
from gym_mapbench.generator.shapes import Cells, ShapeSettings, clear_and_border, stamp
from gym_mapbench.quantities import Fraction
from gym_mapbench.settings import Settings


class PillarGenes(Settings):
    """A pillar field.

    Args:
        pitch: From the middle of a pillar to that of the next, in a row and from row to row, m.
        side: Side of every pillar, m.
        x: Where the first column begins, share of the pitch.
        y: Where the first row begins, share of the pitch.
        stagger: By how much every other row is shifted, share of the pitch.
    """

    pitch: Length
    side: Length
    x: Fraction
    y: Fraction
    stagger: Fraction


class Pillars(Settings):
    """Square pillars of one size, in rows of one pitch, every other row shifted.

    ::

        ##################
        # G     ##    ## #
        #       ##    ## #
        #                #
        #    ##    ##    #
        #    ##    ##    #
        #                #
        # ##    ##       #
        # ##    ##     S #
        ##################

    Args:
        pitch: Range of the distance from pillar to pillar, middle to middle, m.
        side: Range of a pillar's side, m.
        x: Range of where the first column begins, share of the pitch.
        y: Range of where the first row begins, share of the pitch.
        stagger: Range of the shift of every other row, share of the pitch.
    """

    genes: ClassVar[type[Settings]] = PillarGenes

    pitch: LengthRange = (0.8, 1.4)
    side: LengthRange = (0.15, 0.4)
    x: FractionRange = (0.0, 1.0)
    y: FractionRange = (0.0, 1.0)
    stagger: FractionRange = (0.0, 0.5)

    def draw_genes(self, rng: np.random.Generator) -> PillarGenes:
        """Sample the genes of one map."""
        return PillarGenes(**{name: sample(rng, getattr(self, name)) for name in PillarGenes.model_fields})

    def build(self, genes: PillarGenes, shapes: ShapeSettings) -> Cells:
        """Return the occupancy; see :meth:`Family.build`."""
        cells = empty(shapes)
        pitch, side = (to_cells(length, shapes) for length in (genes.pitch, genes.side))
        pillar = np.ones((side, side), dtype=np.bool_)
        for number, row in enumerate(range(round((genes.y - 1) * pitch), shapes.size, pitch)):
            shift = genes.x - 1 + genes.stagger * (number % 2)
            for col in range(round(shift * pitch), shapes.size, pitch):
                stamp(cells, pillar, row, col)
        return clear_and_border(cells, shapes)
