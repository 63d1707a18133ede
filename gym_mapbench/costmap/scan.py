"""LaserScan and Observation: a scan as it is measured, and the points that a layer makes of it.

Source: sensor_msgs/LaserScan, laser_geometry, nav2_costmap_2d/src/observation_buffer.cpp and
plugins/obstacle_layer.cpp (``laserScanValidInfCallback``).
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gym_mapbench.kernels.scan import project_scan
from gym_mapbench.world.scenario import Pose

SHORT_OF_RANGE_MAX = np.float32(1e-4)


@dataclass(frozen=True)
class LaserScan:
    """One scan of a planar lidar, in single precision as ROS sends it.

    Args:
        ranges: ``(beams,)`` m; inf where nothing was hit.
        angle_min: Angle of the first beam to the sensor's heading, rad.
        angle_increment: Angle from beam to beam, rad.
        range_min: Ranges below this are not measurements, m.
        range_max: Ranges from this value on are not measurements either, m.
    """

    ranges: NDArray[np.floating]
    angle_min: float
    angle_increment: float
    range_min: float
    range_max: float

    def observe(self, sensor: Pose, height: float, *, inf_is_valid: bool = False) -> Observation:
        """Return the points of this scan in the frame in which ``sensor`` is given.

        Args:
            sensor: Pose of the sensor, m and rad.
            height: Its height above the ground, m.
            inf_is_valid: Whether a beam that hit nothing ends just short of ``range_max`` instead of nowhere.
        """
        ranges, range_max = np.asarray(self.ranges, np.float32), np.float32(self.range_max)
        if inf_is_valid:
            ranges = np.where(np.isposinf(ranges), range_max - SHORT_OF_RANGE_MAX, ranges)
        beams = _directions(len(ranges), float(np.float32(self.angle_min)), float(np.float32(self.angle_increment)))
        # Point clouds are turned by a quaternion in single precision.
        z, w = np.float32(math.sin(sensor.yaw / 2)), np.float32(math.cos(sensor.yaw / 2))
        twice = np.float32(2) * z
        turn = np.float32(1) - twice * z, twice * w
        position = np.float32(sensor.x), np.float32(sensor.y)
        points = project_scan(ranges, beams, np.float32(self.range_min), range_max, *turn, *position)
        return Observation((sensor.x, sensor.y, height), points, float(np.float32(height)))


@dataclass(frozen=True)
class Observation:
    """Points that a sensor saw, in the costmap's frame.

    Args:
        origin: x, y and z of the sensor, m.
        points: ``(n, 2)`` float32 x and y, m.
        z: Height of all of them, m.
    """

    origin: tuple[float, float, float]
    points: NDArray[np.float32]
    z: float


@functools.lru_cache(maxsize=8)
def _directions(beams: int, angle_min: float, angle_increment: float) -> NDArray[np.float64]:
    """``(beams, 2)`` cosine and sine of every beam's angle; cached, as every scan has the same."""
    angles = angle_min + np.arange(beams) * angle_increment
    directions: NDArray[np.float64] = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    directions.flags.writeable = False
    return directions
