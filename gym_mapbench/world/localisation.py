"""Odometry and localisation: the robot's pose as its wheels and its localisation estimate it.

The odom pose is smooth and drifts. The estimate on the map does not drift, but jumps, as the estimate of AMCL does.
The error of the localisation does not reach the odom frame.
"""

from __future__ import annotations

import math

import numpy as np

from gym_mapbench.kernels.frames import count_motion
from gym_mapbench.world.frames import IDENTITY, compose, relate
from gym_mapbench.world.noise import NoiseSettings, Wander
from gym_mapbench.world.scenario import Pose, wrap_angle

ODOM_SHIFT = 1.0
"""Largest odom coordinate of the start in a random odom frame, m; its range, 2 m, is a whole number of usual cells."""


class Odometry:
    """Wheel odometry from a start pose on.

    Its errors are systematic and sampled once for a run: on smooth floors systematic errors outweigh random ones
    (Borenstein and Feng, UMBmark, 1996). It counts how the body moves, even along a wall, where real wheels slip.

    Args:
        noise: Where the odom frame lies, and the errors of the wheels.
        start: True pose at the start.
        frame_rng: Samples the odom frame.
        rng: Samples the errors of this run.
    """

    def __init__(
        self, noise: NoiseSettings, start: Pose, frame_rng: np.random.Generator, rng: np.random.Generator
    ) -> None:
        self._frame = IDENTITY
        if noise.odom_frame == "random":
            self._frame = relate(start, _sample_pose(frame_rng))
        self._drifts = noise.drifts
        self._true, self._pose = start, compose(self._frame, start)
        if self._drifts:
            spread = np.array([noise.odometry_distance, noise.odometry_turn, noise.odometry_veer])
            self._distance, self._turn, self._veer = (spread * rng.standard_normal(3)).tolist()

    def advance(self, true: Pose) -> Pose:
        """Return the pose in the odom frame, now that the robot is at ``true`` on the map."""
        if not self._drifts:
            return true if self._frame is IDENTITY else compose(self._frame, true)
        motion = tuple(self._true), tuple(true), tuple(self._pose)
        self._true, self._pose = true, Pose(*count_motion(*motion, self._distance, self._turn, self._veer))
        return self._pose

    def measure(self, velocity: tuple[float, float]) -> tuple[float, float]:
        """Return the forward speed (m/s) and turn rate (rad/s) that the wheels measure."""
        if not self._drifts:
            return velocity
        v, w = velocity
        return v * (1 + self._distance), w * (1 + self._turn) + v * self._veer


class Localisation:
    """The estimate on the map.

    Where it has errors, or wheels drift, it behaves like AMCL seen from outside: after ``update_min_d`` or
    ``update_min_a`` of motion it corrects itself, to the true pose plus the error of that moment. Until then the
    transform from map to odom stays as it is, and the estimate follows odometry.

    Source: nav2_amcl (Humble) src/amcl_node.cpp, ``shouldUpdateFilter``.

    Args:
        noise: Spread of the error and when it is corrected.
        period: Control period, s.
        rng: Samples the error, once a control period.
    """

    def __init__(self, noise: NoiseSettings, period: float, rng: np.random.Generator) -> None:
        self._noise = noise
        self._error = Wander((noise.pose_xy, noise.pose_xy, noise.pose_yaw), noise.pose_time_constant, period, rng)
        self._exact = not (self._error.is_on or noise.drifts)
        self._corrected_at: Pose | None = None
        self._odom_in_map = IDENTITY

    def advance(self, true: Pose, odom: Pose) -> Pose:
        """Return the estimate on the map, now that the robot is at ``true`` there and at ``odom`` in the odom frame."""
        if self._exact:
            return true
        x, y, yaw = self._error.advance()
        if self._corrected_at is None or self._moved(self._corrected_at, odom):
            self._corrected_at = odom
            estimate = Pose(true.x + x, true.y + y, wrap_angle(true.yaw + yaw))
            self._odom_in_map = relate(odom, estimate)
        return compose(self._odom_in_map, odom)

    def _moved(self, before: Pose, now: Pose) -> bool:
        """Whether it is time for a correction; AMCL looks at x and y separately."""
        moved = max(abs(now.x - before.x), abs(now.y - before.y))
        return moved > self._noise.update_min_d or abs(wrap_angle(now.yaw - before.yaw)) > self._noise.update_min_a


def _sample_pose(rng: np.random.Generator) -> Pose:
    """Sample a pose, uniform in position and heading: all shifts and turns against the map are equally likely."""
    x, y, turn = rng.uniform(-1.0, 1.0, 3).tolist()
    return Pose(ODOM_SHIFT * x, ODOM_SHIFT * y, wrap_angle(math.pi * turn))
