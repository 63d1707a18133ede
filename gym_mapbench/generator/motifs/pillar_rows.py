"""Pillar rows: square pillars in a row across the way."""

from __future__ import annotations

from gym_mapbench.generator.motifs.around import Around
from gym_mapbench.generator.motifs.motif import Motif, Values
from gym_mapbench.generator.ranges import LengthRange
from gym_mapbench.generator.shapes import Cells


class PillarRows(Motif):
    """Rows of square pillars across the whole map; the way leads between two pillars of each row.

    ::

        ##################
        # G              #
        #  ##  ##  ##  ###
        #  ##  ##  ##  ###
        #                #
        #    ##  ##  ##  #
        #    ##  ##  ##  #
        #                #
        #              S #
        ##################

    Args:
        gap: Range of the width between two pillars of a row, m.
        side: Range of the pillars' sides, m.
    """

    gap: LengthRange = (0.6, 1.1)
    side: LengthRange = (0.15, 0.6)

    def walls(self, around: Around, genes: Values) -> Cells:
        """Return the pillars of one row; see :meth:`Motif.walls`."""
        gap = max(genes["gap"], around.resolution)
        walls = around.within_along(genes["side"])
        places = (around.across[walls] + gap / 2) % (gap + max(genes["side"], around.resolution))
        walls[walls] = places >= gap
        return walls
