"""The interface of a costmap filter, which works behind all layers of a costmap.

Source: nav2_costmap_2d/include/nav2_costmap_2d/costmap_filters/costmap_filter.hpp.
"""

from __future__ import annotations

from abc import ABC, abstractmethod

from gym_mapbench.costmap.layer import Box, Cells, Costs, Window
from gym_mapbench.world.scenario import Pose


class CostmapFilter(ABC):
    """A filter of a costmap. Its costs are not seen by the layers at their next update."""

    @property
    @abstractmethod
    def depends_on_robot(self) -> bool:
        """Whether its costs change with the robot's pose."""

    def reset(self) -> None:  # noqa: B027 - most filters have nothing to forget
        """Begin anew, as the costmap is cleared."""

    def update_bounds(self, window: Window, robot: Pose, box: Box) -> None:  # noqa: B027 - most filters follow
        """Widen the box that the layers have changed; arguments as in :meth:`~gym_mapbench.costmap.layer.Layer`."""

    @abstractmethod
    def process(self, window: Window, master: Costs, cells: Cells, robot: Pose) -> None:
        """Filter these cells of the master grid.

        Args:
            window: Where the costmap's cells lie now.
            master: ``(rows, cols)`` uint8, written by the layers.
            cells: The cells that they wrote.
            robot: Pose of the robot in the costmap's frame.
        """
