"""A laser scan as points of a costmap's frame, in the single precision that point clouds have.

Source: laser_geometry (``projectLaser``), tf2_sensor_msgs (``doTransform`` of a point cloud).
"""

from __future__ import annotations

import numpy as np

from gym_mapbench.kernels.jit import kernel


@kernel
def project_scan(ranges, beams, range_min, range_max, cos, sin, x, y):
    """Points ``(n, 2)`` float32 m of those ranges that are at least ``range_min`` and below ``range_max``.

    Args:
        ranges: ``(beams,)`` float32, m.
        beams: ``(beams, 2)`` float64, cosine and sine of every beam's angle in the sensor's frame.
        range_min: float32, m.
        range_max: float32, m.
        cos: float32, cosine of the sensor's yaw.
        sin: float32, sine of it.
        x: float32, position of the sensor, m.
        y: float32, m.
    """
    points = np.empty((len(ranges), 2), np.float32)
    count = 0
    for i in range(len(ranges)):
        if range_min <= ranges[i] < range_max:
            ahead, left = np.float32(ranges[i] * beams[i, 0]), np.float32(ranges[i] * beams[i, 1])
            points[count, 0] = (cos * ahead + -sin * left) + x
            points[count, 1] = (sin * ahead + cos * left) + y
            count += 1
    return points[:count]
