"""The costmaps of Nav2 as the navigator keeps them during a run.

Source: nav2_costmap_2d (Humble) src/costmap_2d_ros.cpp.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from controllers.rate import Rate
from gym_mapbench.costmap import Costmap, CostmapParams, LocalCostmap, build_static_costmap
from gym_mapbench.errors import ConfigError
from gym_mapbench.footprint import Footprint
from gym_mapbench.gridmap import GridMap
from gym_mapbench.lidar import LidarSettings
from gym_mapbench.scenario import Pose

Ranges = NDArray[np.floating]


class CostmapServer(Protocol):
    """Keeps a costmap."""

    @property
    def costmap(self) -> Costmap:
        """The costmap as of its last update."""
        ...

    def clear(self) -> None:
        """Forget what was seen before now (``ClearEntirely``); the next user finds it updated."""
        ...


class GlobalCostmapServer:
    """The whole map, inflated, built once.

    The obstacle layer is left out: in a static world that the map shows as it is, it marks only what the
    map has already.
    """

    def __init__(self, params: CostmapParams, grid: GridMap, footprint: Footprint) -> None:
        self._costmap = build_static_costmap(grid, params, footprint)

    @property
    def costmap(self) -> Costmap:
        """The costmap."""
        return self._costmap

    def clear(self) -> None:
        """Nothing: no more is known than the map."""


class LocalCostmapServer:
    """The costmap around the robot, updated at ``update_frequency``.

    Args:
        params: Layers and size.
        grid: The static map.
        footprint: The padded footprint.
        lidar: Beams of the scans.
    """

    _costmap: Costmap
    _seen: tuple[Pose, Ranges | None]

    def __init__(self, params: CostmapParams, grid: GridMap, footprint: Footprint, lidar: LidarSettings) -> None:
        self._window = LocalCostmap(params, grid, footprint)
        self._rate = Rate(params.update_frequency)
        self._lidar, self._angles = lidar, lidar.angles

    @property
    def costmap(self) -> Costmap:
        """The costmap as of its last update."""
        return self._costmap

    def observe(self, pose: Pose, scan: Ranges | None, now: float) -> None:
        """Take the pose and the ``(beams,)`` ranges (m) measured at ``now`` (s); update if it is time to.

        Raises:
            ConfigError: If the scan has not as many ranges as the lidar has beams.
        """
        if scan is not None and len(scan) != len(self._angles):
            raise ConfigError(f"scan: expected {len(self._angles)} ranges, one a beam, got {len(scan)}")
        self._seen = pose, scan
        if self._rate.is_due(now):
            self._update()

    def clear(self) -> None:
        """Forget all layers and fill them again from the last observation."""
        self._window.clear()
        self._update()

    def _update(self) -> None:
        pose, scan = self._seen
        lidar, angles, sensor = self._lidar, self._angles, self._lidar.sensor_pose(pose)
        if scan is not None and lidar.range_min:
            far_enough = scan >= lidar.range_min
            scan, angles = scan[far_enough], angles[far_enough]
        self._costmap = self._window.update(pose, scan, angles, lidar.range_max, sensor)
