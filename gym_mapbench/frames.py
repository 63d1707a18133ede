"""Frames: how poses in one coordinate frame are seen from another.

A frame is written as the pose of its origin in the other frame. With the identity, results are exact.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gym_mapbench.scenario import Pose, wrap_angle

IDENTITY = Pose(0.0, 0.0, 0.0)


def compose(frame: Pose, pose: Pose) -> Pose:
    """Return ``pose``, which is given in ``frame``, in the frame in which ``frame`` is given; m, rad in (-pi, pi]."""
    cos, sin = math.cos(frame.yaw), math.sin(frame.yaw)
    x, y = frame.x + (cos * pose.x - sin * pose.y), frame.y + (sin * pose.x + cos * pose.y)
    return Pose(x, y, wrap_angle(frame.yaw + pose.yaw))


def inverse(frame: Pose) -> Pose:
    """Return the other frame as seen from ``frame``: composed with ``frame``, either way round, it is the identity."""
    cos, sin = math.cos(frame.yaw), math.sin(frame.yaw)
    return Pose(-(cos * frame.x + sin * frame.y), sin * frame.x - cos * frame.y, wrap_angle(-frame.yaw))


def relate(here: Pose, there: Pose) -> Pose:
    """Return the frame of ``here`` in that of ``there``, given one and the same pose in both.

    Where the two are equal it is the identity, to the last bit.
    """
    turn = wrap_angle(there.yaw - here.yaw)
    cos, sin = math.cos(turn), math.sin(turn)
    return Pose(there.x - (cos * here.x - sin * here.y), there.y - (sin * here.x + cos * here.y), turn)


def transform_path(frame: Pose, path: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the poses of ``path``, ``(n, 3)`` x, y in m and yaw in rad, as :func:`compose` does one; a new array."""
    cos, sin = math.cos(frame.yaw), math.sin(frame.yaw)
    moved = np.empty((len(path), 3))
    moved[:, 0] = frame.x + (cos * path[:, 0] - sin * path[:, 1])
    moved[:, 1] = frame.y + (sin * path[:, 0] + cos * path[:, 1])
    moved[:, 2] = -(np.mod(-(frame.yaw + path[:, 2]) + np.pi, 2 * np.pi) - np.pi)
    return moved
