"""The thesis' random shapes as a family: maps of the same kind, but none that the robot cannot solve."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from gym_mapbench.generator.ranges import Seed, sample_seed
from gym_mapbench.generator.shapes import Cells, ShapeSettings, sample_map
from gym_mapbench.settings import Settings


class RandomShapesGenes(Settings):
    """A map of random shapes.

    Args:
        layout: Seed of :func:`~gym_mapbench.generator.shapes.sample_map`.
    """

    layout: Seed


class RandomShapes(Settings):
    """Circles, squares and walls anywhere, as :class:`~gym_mapbench.generator.shapes.ShapeSettings` describes them.

    ::

        ##################
        # G     #    ##  #
        #  ##   #   #### #
        #  ##   #    ##  #
        #     ######     #
        #  ##       #    #
        # ####  ### #    #
        #  ##   ###    S #
        ##################
    """

    genes: ClassVar[type[Settings]] = RandomShapesGenes

    def draw_genes(self, rng: np.random.Generator) -> RandomShapesGenes:
        """Sample the genes of one map."""
        return RandomShapesGenes(layout=sample_seed(rng))

    def build(self, genes: RandomShapesGenes, shapes: ShapeSettings) -> Cells:
        """Return the occupancy; see :meth:`Family.build`."""
        return sample_map(np.random.default_rng(genes.layout), shapes)
