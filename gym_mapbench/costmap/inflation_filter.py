"""An inflation layer that a costmap lists among its filters, so that it inflates keepout zones as well.

Source: nav2_costmap_2d/src/layered_costmap.cpp, ``updateMap``: filters are layers that work on a copy of the cells.
"""

from __future__ import annotations

from gym_mapbench.costmap.filter import CostmapFilter
from gym_mapbench.costmap.inflation_layer import Inflation
from gym_mapbench.costmap.layer import Box, Cells, Costs, Window
from gym_mapbench.world.scenario import Pose


class InflationBehind(CostmapFilter):
    """Inflates what layers and filters before it have written; the layers do not see it.

    Args:
        layer: The inflation layer.
    """

    depends_on_robot = False

    def __init__(self, layer: Inflation) -> None:
        self._layer = layer

    def reset(self) -> None:
        """Inflate everything again at the next update; Humble does not."""
        self._layer.reset()

    def update_bounds(self, window: Window, robot: Pose, box: Box) -> None:
        """Widen the box as the layer does."""
        self._layer.update_bounds(window, robot, box)

    def process(self, window: Window, master: Costs, cells: Cells, robot: Pose) -> None:
        """Inflate these cells of the master grid."""
        self._layer.update_costs(window, master, cells)
