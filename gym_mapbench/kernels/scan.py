"""A laser scan as it is published, and as points of a costmap's frame, in single precision as in ROS.

Source: laser_geometry (``projectLaser``), tf2_sensor_msgs (``doTransform`` of a point cloud),
nav2_costmap_2d/plugins/obstacle_layer.cpp (``laserScanValidInfCallback``).
"""

from __future__ import annotations

import math

import numpy as np

from gym_mapbench.kernels.jit import kernel

SHORT_OF_RANGE_MAX = np.float32(1e-4)
"""How far before ``range_max`` an infinite range ends where it is valid, m."""
HAIR = np.float32(32.0)
"""How much farther along the ray a hit is published, in steps of single precision. The simulated lidar is exact:
without noise its hits lie on the border of the wall's cell, and rounding would decide which cell they fall into."""


@kernel
def publish_ranges(ranges, range_max, x, y):
    """Ranges ``(beams,)`` float32 m as a driver publishes them, infinite for a beam that hits nothing.

    Args:
        ranges: ``(beams,)`` m; ``range_max`` where nothing is hit.
        range_max: Longest range, m.
        x: Position of the scanner along x, m; the steps of single precision grow with x and y.
        y: Position along y, m.
    """
    published = np.empty(len(ranges), np.float32)
    hair = HAIR * np.spacing(np.float32(max(abs(x), abs(y)) + range_max))
    farthest = ranges.dtype.type(range_max)
    for i in range(len(ranges)):
        published[i] = ranges[i] + hair if ranges[i] < farthest else np.float32(np.inf)
    return published


@kernel
def project_scan(ranges, beams, range_min, range_max, inf_is_valid, x, y, yaw):
    """Points ``(n, 2)`` float32 m of those ranges that are at least ``range_min`` and below ``range_max``.

    Args:
        ranges: ``(beams,)`` float32, m.
        beams: ``(beams, 2)`` float64, cosine and sine of every beam's angle in the sensor's frame.
        range_min: Shortest range, m.
        range_max: Longest range, m.
        inf_is_valid: Whether a beam that hit nothing ends just short of ``range_max`` instead of nowhere.
        x: Position of the sensor along x, m.
        y: Position along y, m.
        yaw: Heading of the sensor, rad.
    """
    range_min, range_max, x, y = np.float32(range_min), np.float32(range_max), np.float32(x), np.float32(y)
    # Point clouds are turned by a quaternion in single precision.
    z, w = np.float32(math.sin(yaw / 2)), np.float32(math.cos(yaw / 2))
    twice = np.float32(2) * z
    cos, sin = np.float32(1) - twice * z, twice * w
    points = np.empty((len(ranges), 2), np.float32)
    count = 0
    for i in range(len(ranges)):
        distance = ranges[i]
        if inf_is_valid and distance == np.float32(np.inf):
            distance = range_max - SHORT_OF_RANGE_MAX
        if range_min <= distance < range_max:
            ahead, left = np.float32(distance * beams[i, 0]), np.float32(distance * beams[i, 1])
            points[count, 0] = (cos * ahead + -sin * left) + x
            points[count, 1] = (sin * ahead + cos * left) + y
            count += 1
    return points[:count]
