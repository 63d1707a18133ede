"""Sparse maps: a few obstacles in an open room."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from gym_mapbench.generator.base import empty, to_cells
from gym_mapbench.generator.ranges import CountRange, Length, LengthRange, sample, sample_count, sample_flag
from gym_mapbench.generator.shapes import Cells, ShapeSettings, clear_and_border, disc, stamp
from gym_mapbench.quantities import Fraction
from gym_mapbench.settings import Settings


class Block(Settings):
    """One obstacle.

    Args:
        x: Where its middle is, 0 (left) to 1 (right).
        y: Where its middle is, 0 (below) to 1 (above).
        width: Its width, m; the diameter of a disc.
        height: Its height, m; not used for a disc.
        round: Whether it is a disc.
    """

    x: Fraction
    y: Fraction
    width: Length
    height: Length
    round: bool


class SparseGenes(Settings):
    """A sparse map.

    Args:
        blocks: Its obstacles.
    """

    blocks: tuple[Block, ...]


class Sparse(Settings):
    """A few boxes and discs in an open room.

    ::

        ##################
        # G              #
        #          ###   #
        #          ###   #
        #   ##           #
        #  ####          #
        #   ##     ##    #
        #              S #
        ##################

    Args:
        blocks: Range of the number of obstacles.
        side: Range of their widths and heights, m.
    """

    genes: ClassVar[type[Settings]] = SparseGenes

    blocks: CountRange = (2, 8)
    side: LengthRange = (0.2, 1.0)

    def draw_genes(self, rng: np.random.Generator) -> SparseGenes:
        """Sample the genes of one map."""
        return SparseGenes(blocks=tuple(self._draw_block(rng) for _ in range(sample_count(rng, self.blocks))))

    def _draw_block(self, rng: np.random.Generator) -> Block:
        x, y = rng.random(2).tolist()
        return Block(x=x, y=y, width=sample(rng, self.side), height=sample(rng, self.side), round=sample_flag(rng))

    def build(self, genes: SparseGenes, shapes: ShapeSettings) -> Cells:
        """Return the occupancy; see :meth:`Family.build`."""
        cells = empty(shapes)
        for block in genes.blocks:
            height, width = to_cells(block.height, shapes), to_cells(block.width, shapes)
            shape = disc(width // 2) if block.round else np.ones((height, width), dtype=np.bool_)
            row, col = (
                round(at * shapes.size - part / 2) for at, part in zip((block.y, block.x), shape.shape, strict=True)
            )
            stamp(cells, shape, row, col)
        return clear_and_border(cells, shapes)
