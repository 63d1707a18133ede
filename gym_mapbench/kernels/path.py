"""The part of a path that lies ahead."""

from __future__ import annotations

import math

from gym_mapbench.kernels.jit import kernel


@kernel
def see_path(points, passed, x, y, yaw, window):
    """Write the next points of a path in the robot's frame; the last one repeats at the end.

    Args:
        points: ``(n, 2)`` x, y, m.
        passed: Index of the point the last call found nearest; points before it are not looked at.
        x: Robot, m.
        y: Robot, m.
        yaw: Robot, rad.
        window: ``(count, 2)`` out, x ahead and y to the left of the robot, m.

    Returns:
        Index of the nearest of the next ``count`` points; the window begins with it.
    """
    count, last = len(window), len(points) - 1
    nearest, least = passed, math.inf
    for i in range(passed, min(passed + count, last + 1)):
        squared = (points[i, 0] - x) ** 2 + (points[i, 1] - y) ** 2
        if squared < least:
            nearest, least = i, squared
    cos, sin = math.cos(yaw), math.sin(yaw)
    for i in range(count):
        point = points[min(nearest + i, last)]
        dx, dy = point[0] - x, point[1] - y
        window[i, 0] = cos * dx + sin * dy
        window[i, 1] = cos * dy - sin * dx
    return nearest
