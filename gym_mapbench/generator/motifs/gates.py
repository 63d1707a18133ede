"""Gates: walls across the way, each with a gap."""

from __future__ import annotations

from gym_mapbench.generator.motifs.around import Around
from gym_mapbench.generator.motifs.motif import Motif, Values
from gym_mapbench.generator.ranges import CountRange, LengthRange
from gym_mapbench.generator.shapes import Cells


class Gates(Motif):
    """Walls across the whole map, their gaps on a line that the robot follows; oblique gates on a diagonal route.

    ::

        ##################
        # G              #
        #                #
        ##### ############
        #                #
        ########## #######
        #                #
        #############  ###
        #              S #
        ##################

    Args:
        count: Range of the number of gates.
        pitch: Range of the distance from one gate to the next, m.
        gap: Range of the gaps' widths, m.
        thickness: Range of the walls' thickness, m.
    """

    count: CountRange = (1, 5)
    pitch: LengthRange = (1.35, 1.8)
    gap: LengthRange = (0.7, 1.1)
    thickness: LengthRange = (0.1, 0.5)

    def walls(self, around: Around, genes: Values) -> Cells:
        """Return the wall with its gap; see :meth:`Motif.walls`."""
        return around.within_along(genes["thickness"]) & ~around.within_across(genes["gap"])
