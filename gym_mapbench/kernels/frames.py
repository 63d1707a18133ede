"""Poses of a path, seen from another frame."""

from __future__ import annotations

import math

import numpy as np

from gym_mapbench.kernels.jit import kernel

TWO_PI = 2.0 * math.pi


@kernel
def move_path(x, y, yaw, path):
    """Return ``path`` ``(n, 3)`` moved into the frame in which ``path``'s own frame has the pose ``x``, ``y``, ``yaw``.

    Headings are wrapped to (-pi, pi].
    """
    cos, sin = math.cos(yaw), math.sin(yaw)
    moved = np.empty((len(path), 3))
    for i in range(len(path)):
        moved[i, 0] = x + (cos * path[i, 0] - sin * path[i, 1])
        moved[i, 1] = y + (sin * path[i, 0] + cos * path[i, 1])
        moved[i, 2] = -((-(yaw + path[i, 2]) + math.pi) % TWO_PI - math.pi)
    return moved
