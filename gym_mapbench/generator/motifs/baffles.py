"""Baffles: walls that reach in from alternating sides."""

from __future__ import annotations

from gym_mapbench.generator.motifs.around import Around
from gym_mapbench.generator.motifs.motif import Motif, Values
from gym_mapbench.generator.ranges import LengthRange
from gym_mapbench.generator.shapes import Cells


class Baffles(Motif):
    """Walls that reach in from the left and from the right in turn and end beyond the way.

    ::

        ##################
        # G              #
        #                #
        #   ##############
        #                #
        ###########      #
        #                #
        #         ########
        #              S #
        ##################

    Args:
        overlap: Range of how far a wall reaches beyond the way, m.
        thickness: Range of the walls' thickness, m.
    """

    overlap: LengthRange = (0.05, 1.0)
    thickness: LengthRange = (0.05, 0.3)

    def walls(self, around: Around, genes: Values) -> Cells:
        """Return the wall from one side; see :meth:`Motif.walls`."""
        side = 1.0 if around.number % 2 == 0 else -1.0
        return around.within_along(genes["thickness"]) & (side * around.across > -genes["overlap"])
