"""Bends: corridors with two right-angled turns through solid ground."""

from __future__ import annotations

from gym_mapbench.generator.motifs.around import Around
from gym_mapbench.generator.motifs.motif import Motif, Values
from gym_mapbench.generator.ranges import CountRange, LengthRange
from gym_mapbench.generator.shapes import Cells


class Bends(Motif):
    """Blocks across the whole map, each with a corridor that turns to the left and back again.

    ::

        ##################
        # G              #
        ###### ###########
        ######     #######
        ########## #######
        #                #
        #                #
        #                #
        #              S #
        ##################

    Args:
        width: Range of the corridors' widths, m.
        length: Range of the blocks' thickness, m.
        offset: Range of the distance by which a corridor comes out further to the left, m.
    """

    count: CountRange = (1, 3)
    width: LengthRange = (0.65, 1.1)
    length: LengthRange = (1.0, 1.6)
    offset: LengthRange = (0.2, 1.2)

    def walls(self, around: Around, genes: Values) -> Cells:
        """Return one block; see :meth:`Motif.walls`."""
        width, half, aside = genes["width"], genes["length"] / 2, genes["offset"] / 2
        inward = around.moved(-half, -aside).within_along(2 * half) & around.moved(0.0, -aside).within_across(width)
        outward = around.moved(half, aside).within_along(2 * half) & around.moved(0.0, aside).within_across(width)
        middle = around.within_along(width) & around.within_across(genes["offset"] + width)
        return around.within_along(genes["length"]) & ~(inward | outward | middle)
