"""LaserScan and Observation: a scan as it is measured, and the points that a layer makes of it.

Source: sensor_msgs/LaserScan, nav2_costmap_2d/src/observation_buffer.cpp.
"""

from __future__ import annotations

import functools
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gym_mapbench.kernels.scan import project_scan
from gym_mapbench.world.scenario import Pose


class LaserScan(NamedTuple):
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
        ranges = np.asarray(self.ranges, np.float32)
        beams = _directions(len(ranges), self.angle_min, self.angle_increment)
        points = project_scan(ranges, beams, self.range_min, self.range_max, inf_is_valid, *sensor)
        return Observation((sensor.x, sensor.y, height), points, float(np.float32(height)))


class Observation(NamedTuple):
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
    angles = float(np.float32(angle_min)) + np.arange(beams) * float(np.float32(angle_increment))
    directions: NDArray[np.float64] = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    directions.flags.writeable = False
    return directions
