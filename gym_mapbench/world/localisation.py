"""Odometry and localisation: the robot's state as its wheels and its localisation estimate it.

The odom pose is smooth and drifts. The estimate on the map does not drift, but jumps, as the estimate of AMCL does.
The error of the localisation does not reach the odom frame.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gym_mapbench.kernels.estimation import BELIEF, estimate_state
from gym_mapbench.world.frames import compose, relate
from gym_mapbench.world.noise import NoiseSettings, Streams, Wander
from gym_mapbench.world.scenario import Pose, wrap_angle
from gym_mapbench.world.state import Records

ODOM_SHIFT = 1.0
"""Largest odom coordinate of the start in a random odom frame, m; its range, 2 m, is a whole number of usual cells."""


class StateEstimator:
    """Estimates the robot's state from a start pose on.

    The errors of wheel odometry are systematic and sampled once for a run: on smooth floors systematic errors outweigh
    random ones (Borenstein and Feng, UMBmark, 1996). It counts how the body moves, even along a wall, where real wheels
    slip. The measured velocity has independent errors besides.

    Where the localisation has errors, or wheels drift, it behaves like AMCL seen from outside: after ``update_min_d``
    or ``update_min_a`` of motion it corrects itself, to the true pose plus the error of that moment. Until then the
    transform from map to odom stays as it is, and the estimate follows odometry.

    Source: nav2_amcl (Humble) src/amcl_node.cpp, ``shouldUpdateFilter``.

    Args:
        noise: Where the odom frame lies, the errors of wheels and localisation, and when the latter is corrected.
        start: True pose at the start.
        period: Control period, s.
        streams: Generators of the errors.
        robots: The robot, ``(1,)`` ROBOT.
    """

    def __init__(self, noise: NoiseSettings, start: Pose, period: float, streams: Streams, robots: Records) -> None:
        self._robots = robots
        spread = noise.pose_xy, noise.pose_xy, noise.pose_yaw
        self._error = Wander(spread, noise.pose_time_constant, period, streams.localisation)
        self._jitter = Wander((noise.odometry_v, noise.odometry_w), 0.0, period, streams.velocity)
        self._belief = np.zeros(1, BELIEF)
        self._place_odom(noise, start, streams.odom_frame)
        if noise.drifts:
            self._sample_drift(noise, streams.odometry)
        self._set(is_exact=not (self._error.is_on or noise.drifts), jitters=self._jitter.is_on, drifts=noise.drifts)
        self._set(update_min_d=noise.update_min_d, update_min_a=noise.update_min_a)

    def advance(self) -> NDArray[np.float64]:
        """Return the robot's state, true and as it is estimated; call it once a control step.

        Returns:
            ``(13,)`` true pose on the map (m, m, rad), true forward speed (m/s) and turn rate (rad/s); then the
            estimates: pose on the map, pose in the odom frame, forward speed and turn rate.
        """
        state = np.empty(13)
        estimate_state(self._belief, self._robots, *self._error.advance(), *self._jitter.advance(), state)
        return state

    def _place_odom(self, noise: NoiseSettings, start: Pose, rng: np.random.Generator) -> None:
        """Place the odom frame, and let the wheels begin to count."""
        odom = start
        if noise.odom_frame == "random":
            shift = relate(start, _sample_pose(rng))
            odom = compose(shift, start)
            self._set(is_shifted=True, shift_x=shift.x, shift_y=shift.y, shift_yaw=shift.yaw)
        self._set(true_x=start.x, true_y=start.y, true_yaw=start.yaw)
        self._set(odom_x=odom.x, odom_y=odom.y, odom_yaw=odom.yaw)

    def _sample_drift(self, noise: NoiseSettings, rng: np.random.Generator) -> None:
        """Sample the systematic errors of the wheels."""
        spread = np.array([noise.odometry_distance, noise.odometry_turn, noise.odometry_veer])
        distance, turn, veer = (spread * rng.standard_normal(3)).tolist()
        self._set(distance=distance, turn=turn, veer=veer)

    def _set(self, **values: float) -> None:
        for name, value in values.items():
            self._belief[name] = value


def _sample_pose(rng: np.random.Generator) -> Pose:
    """Sample a pose, uniform in position and heading: all shifts and turns against the map are equally likely."""
    x, y, turn = rng.uniform(-1.0, 1.0, 3).tolist()
    return Pose(ODOM_SHIFT * x, ODOM_SHIFT * y, wrap_angle(math.pi * turn))
