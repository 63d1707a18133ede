"""Frames: transformations of poses from one coordinate frame to another.

A frame is given by the pose of its origin in the other frame. With the identity, results are exact.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gym_mapbench.kernels.frames import compose as compose_kernel
from gym_mapbench.kernels.frames import move_path
from gym_mapbench.kernels.frames import relate as relate_kernel
from gym_mapbench.world.scenario import Pose

IDENTITY = Pose(0.0, 0.0, 0.0)


def compose(frame: Pose, pose: Pose) -> Pose:
    """Transform ``pose`` from ``frame`` into the frame in which ``frame`` itself is given; m, rad in (-pi, pi]."""
    return Pose(*compose_kernel(*frame, *pose))


def relate(here: Pose, there: Pose) -> Pose:
    """Return the pose of one frame in another, from a pose that is known in both.

    Args:
        here: The pose in the one frame.
        there: The same pose in the other frame.

    Returns:
        The pose of the first frame in the other; exactly the identity where ``here`` equals ``there``.
    """
    return Pose(*relate_kernel(*here, *there))


def transform_path(frame: Pose, path: NDArray[np.float64]) -> NDArray[np.float64]:
    """Transform every pose of ``path``, ``(n, 3)`` x, y in m and yaw in rad, as :func:`compose` does; a new array."""
    moved: NDArray[np.float64] = move_path(*frame, path)
    return moved
