"""Dead ends: U-shaped walls that open towards the start."""

from __future__ import annotations

from gym_mapbench.generator.motifs.around import Around
from gym_mapbench.generator.motifs.motif import Motif, Values
from gym_mapbench.generator.ranges import LengthRange
from gym_mapbench.generator.shapes import Cells


class DeadEnds(Motif):
    """U-shaped walls on the way that open towards the start.

    ::

        ##################
        # G              #
        #   #######      #
        #   #     #      #
        #   #     #      #
        #                #
        #        ####### #
        #        #     # #
        #              S #
        ##################

    Args:
        width: Range of the distance from outer wall to outer wall, m.
        depth: Range of the distance from the opening to the outside of the back wall, m.
        thickness: Range of the walls' thickness, m.
    """

    width: LengthRange = (0.9, 2.2)
    depth: LengthRange = (0.4, 1.4)
    thickness: LengthRange = (0.05, 0.3)

    def walls(self, around: Around, genes: Values) -> Cells:
        """Return one dead end; see :meth:`Motif.walls`."""
        outside = around.within_along(genes["depth"]) & around.within_across(genes["width"])
        opened = around.moved(-genes["thickness"], 0.0).within_along(genes["depth"])
        return outside & ~(opened & around.within_across(genes["width"] - 2 * genes["thickness"]))
