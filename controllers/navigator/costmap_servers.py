"""The costmaps of Nav2 as the navigator keeps them during a run.

Source: nav2_costmap_2d (Humble) src/costmap_2d_ros.cpp.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from controllers.navigator.costmap_wait import ScheduledCostmap
from controllers.navigator.rate import NEVER, TIME_RESOLUTION
from gym_mapbench.costmap import Costmap, CostmapParams, LaserScan, LayeredCostmap, SpeedLimit
from gym_mapbench.errors import ConfigError
from gym_mapbench.kernels.scan import publish_ranges
from gym_mapbench.world.footprint import Footprint
from gym_mapbench.world.frames import IDENTITY, relate
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.lidar import LidarSettings
from gym_mapbench.world.scenario import Pose

Ranges = NDArray[np.floating]


class CostmapServer(ScheduledCostmap):
    """A costmap, global or local, updated at ``update_frequency`` with the newest scan.

    Args:
        params: Layers and size.
        grid: The static map.
        footprint: The padded footprint.
        lidar: The lidar that makes the scans: its beams and its place on the robot.
    """

    _costmap: Costmap
    _scan: Ranges
    _taken_at: Pose

    def __init__(self, params: CostmapParams, grid: GridMap, footprint: Footprint, lidar: LidarSettings) -> None:
        super().__init__(params.update_frequency)
        self._layered = LayeredCostmap(params, grid, footprint)
        self._publish_period = 1.0 / params.publish_frequency if params.publish_frequency > 0.0 else NEVER
        self._published: Costmap | None = None
        self._published_at = -NEVER
        self._lidar = lidar
        self._is_buffered = True

    @property
    def costmap(self) -> Costmap:
        """The costmap as of its last update."""
        return self._costmap

    def published(self) -> Costmap | None:
        """Return the costmap as it was last published, which is how the recovery behaviours see it; None before."""
        return self._published

    def observe(self, pose: Pose, scan: Ranges) -> None:
        """Take a new scan; the next update uses it.

        Args:
            pose: Pose of the robot, in the costmap's frame.
            scan: ``(beams,)`` ranges, m.

        Raises:
            ConfigError: If the number of ranges is not the number of the lidar's beams.
        """
        if len(scan) != self._lidar.beams:
            raise ConfigError(f"scan: expected {self._lidar.beams} ranges, one a beam, got {len(scan)}")
        self._scan, self._is_buffered = scan, False
        self._taken_at = self._lidar.sensor_pose(pose)

    def advance(self, now: float, pose: Pose, on_map: Pose | None = None) -> Sequence[SpeedLimit]:
        """Update the costmap if that is due at ``now`` (s), and publish it if that is due then.

        Args:
            now: The time, s.
            pose: Pose of the robot, in the costmap's frame.
            on_map: The same pose in the map's frame; None where this is the costmap's frame.

        Returns:
            The speed limits that the filters published meanwhile, in order.
        """
        if not self.is_due(now):
            return ()
        self._update(pose, on_map)
        if now - self._published_at > self._publish_period + TIME_RESOLUTION:
            self._published, self._published_at = self._costmap, now
        return self._layered.take_speed_limits()

    def clear(self, plugins: Sequence[str] = ()) -> None:
        """Forget all layers (``ClearEntirely``); the next update fills them again from the newest scan.

        After a clear of some ``plugins`` alone (Lyrical) nobody waits for that update.
        """
        self._layered.clear(plugins)
        if not plugins:
            self.outdate()

    def clear_square(self, robot: Pose, side: float, *, outside: bool, plugins: Sequence[str] = ()) -> None:
        """Forget the observations in a square around the robot, or all but those (``ClearAroundRobot`` and the like).

        Args:
            robot: Pose of the robot, in the costmap's frame.
            side: Side of the square, m.
            outside: Whether all but the square is forgotten.
            plugins: Lyrical: names of the layers; none for all that look at scans.
        """
        if self._layered.clear_square(robot.x, robot.y, side, outside=outside, plugins=plugins):
            self.outdate()

    def _update(self, pose: Pose, on_map: Pose | None) -> None:
        if not self._is_buffered:
            self._layered.observe(self._message(self._scan, self._taken_at), self._taken_at)
            self._is_buffered = True
        frame = IDENTITY if on_map is None else relate(pose, on_map)
        self._costmap = self._layered.update(pose, frame)

    def _message(self, scan: Ranges, taken_at: Pose) -> LaserScan:
        """Return a scan as a driver would publish it."""
        lidar = self._lidar
        ranges = publish_ranges(scan, lidar.range_max, taken_at.x, taken_at.y)
        return LaserScan(ranges, lidar.angle_min, lidar.beam_angle, lidar.range_min or 0.0, lidar.range_max)
