"""The interface of a costmap layer: it reports where the costmap changes, and writes its cells there.

Source: nav2_costmap_2d/include/nav2_costmap_2d/layer.hpp, costmap_2d.hpp.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gym_mapbench.costmap.options import CostmapOptions
from gym_mapbench.costmap.scan import LaserScan
from gym_mapbench.kernels.layers import cells_in
from gym_mapbench.releases import Release
from gym_mapbench.ros_params import RosPlugin
from gym_mapbench.settings import Settings
from gym_mapbench.world.footprint import Footprint
from gym_mapbench.world.frames import IDENTITY
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.scenario import Pose

Costs = NDArray[np.uint8]
Box = NDArray[np.float64]
"""``(4,)`` least x, least y, largest x, largest y, m."""
Cells = tuple[int, int, int, int]
"""First row, first column, row after the last, column after the last."""


@dataclass
class Window:
    """Where the cells of a costmap lie.

    Args:
        shape: ``(rows, cols)``.
        resolution: Side of a cell, m.
        origin_x: x of the lower-left corner in the costmap's frame, m.
        origin_y: y of the same corner, m.
        frame: Pose of the costmap's frame in the map's.
        release: Release of Nav2 whose ``size`` it has.
    """

    shape: tuple[int, int]
    resolution: float
    origin_x: float
    origin_y: float
    frame: Pose = IDENTITY
    release: Release = "humble"

    @property
    def geometry(self) -> tuple[float, float, float]:
        """Resolution and origin, as the kernels take them."""
        return self.resolution, self.origin_x, self.origin_y

    @property
    def corners(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Lower left and upper right corner, m, in the costmap's frame."""
        rows, cols = self.shape
        x, y = self.origin_x, self.origin_y
        return (x, y), (x + cols * self.resolution, y + rows * self.resolution)

    @property
    def size(self) -> tuple[float, float]:
        """Extent along x and y, m, as Nav2 gives it: half a cell short before Lyrical (``getSizeInMetersX``)."""
        rows, cols = self.shape
        short = 0.0 if self.release == "lyrical" else 0.5
        return (cols - short) * self.resolution, (rows - short) * self.resolution

    def roll(self, robot: Pose) -> tuple[int, int]:
        """Move by whole cells, rounded towards zero, until the robot is in the middle; return rows and columns."""
        size_x, size_y = self.size
        d_row = int((robot.y - size_y / 2 - self.origin_y) / self.resolution)
        d_col = int((robot.x - size_x / 2 - self.origin_x) / self.resolution)
        self.origin_x += d_col * self.resolution
        self.origin_y += d_row * self.resolution
        return d_row, d_col

    def cells_within(self, x: float, y: float, side: float) -> Cells:
        """Return the cells inside a square around a point, without those on its lower border (``clearLayerRegion``)."""
        rows, cols = self.shape
        first_col, first_row = self._clipped_cell(x - side / 2, y - side / 2)
        last_col, last_row = self._clipped_cell(x + side / 2, y + side / 2)
        return min(first_row + 1, rows), min(first_col + 1, cols), last_row, last_col

    def _clipped_cell(self, x: float, y: float) -> tuple[int, int]:
        """Return column and row of a point, or of the point of the costmap next to it (``worldToMapEnforceBounds``)."""
        rows, cols = self.shape
        col, row = (x - self.origin_x) / self.resolution, (y - self.origin_y) / self.resolution
        return int(min(max(col, 0), cols - 1)), int(min(max(row, 0), rows - 1))

    def cells_in(self, box: Box) -> Cells:
        """Return the cells that a box touches; for an empty box none, or one in a corner (``updateMap``)."""
        cells: Cells = cells_in(box, *self.geometry, *self.shape)
        return cells


@dataclass(frozen=True)
class LayerContext:
    """The costmap of a layer, as the layer is told when it is made.

    Args:
        costmap: Options of the costmap.
        grid: The static map.
        shape: ``(rows, cols)`` of the costmap.
        resolution: Side of its cells, m.
        footprint: The padded footprint of the robot.
    """

    costmap: CostmapOptions
    grid: GridMap
    shape: tuple[int, int]
    resolution: float
    footprint: Footprint


class Layer(ABC):
    """A plugin of a costmap. It covers the cells of a window, which the caller moves.

    A filter is a layer that works behind the others, on a copy of their cells.
    """

    def reset(self) -> None:  # noqa: B027 - most layers have nothing to forget
        """Forget all observations."""

    def clear_cells(self) -> None:  # noqa: B027 - nor cells of their own
        """Forget the cells, and nothing else (Lyrical's clears by plugin)."""

    def clear_square(self, cells: Cells, *, outside: bool) -> None:  # noqa: B027 - nor here
        """Forget the cells of a square, or all others; the next update writes the whole costmap (``clearArea``)."""

    def roll(self, d_row: int, d_col: int) -> None:  # noqa: B027 - nor anything to move
        """Follow the window, which has moved by this many cells."""

    def observe(self, scan: LaserScan, sensor: Pose, height: float) -> None:  # noqa: B027 - nor a sensor
        """Take a new scan from a sensor at a pose in the costmap's frame, ``height`` m above the ground."""

    @abstractmethod
    def update_bounds(self, window: Window, robot: Pose, box: Box) -> None:
        """Take in new observations and widen ``box`` to hold the cells that they change.

        Args:
            window: Where the costmap's cells lie now.
            robot: Pose of the robot in the costmap's frame.
            box: The box that the layers before this one have changed.
        """

    @abstractmethod
    def update_costs(self, window: Window, master: Costs, cells: Cells) -> None:
        """Write into these cells of the master grid.

        Args:
            window: Where the costmap's cells lie now.
            master: ``(rows, cols)`` uint8.
            cells: Which of them to write.
        """


def _any_release(options: Any, release: Release) -> None:
    """Accept all options in every release."""


@dataclass(frozen=True)
class LayerEntry:
    """A kind of costmap layer, as the registry holds it.

    Args:
        params: The class of its options. A layer whose options have ``enabled`` set to False does not write.
        make: Makes the layer from its options and the :class:`LayerContext`.
        observes: Whether it takes scans. A costmap of the whole map without such a layer is built once.
        widens_when_disabled: Whether the layer widens the box of an update even if it is disabled.
        check: Given options and a release, raises ``ConfigError`` if the release does not have such options; the
            message begins with the name of the option.
        nav2: How parameter files of Nav2 name and hold the layer; None if Nav2 has no such layer.
    """

    params: type[Settings]
    make: Callable[[Any, LayerContext], Layer]
    observes: bool = False
    widens_when_disabled: bool = False
    check: Callable[[Any, Release], None] = _any_release
    nav2: RosPlugin | None = None
