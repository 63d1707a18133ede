"""Passages: straight corridors through solid ground."""

from __future__ import annotations

from gym_mapbench.generator.motifs.around import Around
from gym_mapbench.generator.motifs.motif import Motif, Values
from gym_mapbench.generator.ranges import LengthRange
from gym_mapbench.generator.shapes import Cells


class Passages(Motif):
    """Blocks across the whole map, each with a straight corridor through it, at right angles to the block.

    ::

        ##################
        # G              #
        #                #
        ###### ###########
        ###### ###########
        #                #
        ############ #####
        ############ #####
        #              S #
        ##################

    Args:
        width: Range of the corridors' widths, m.
        length: Range of their lengths, m.
    """

    width: LengthRange = (0.65, 1.1)
    length: LengthRange = (0.4, 1.3)

    def walls(self, around: Around, genes: Values) -> Cells:
        """Return one block; see :meth:`Motif.walls`."""
        return around.within_along(genes["length"]) & ~around.within_across(genes["width"])
