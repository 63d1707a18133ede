"""VelocitySmoother: bounds velocity and acceleration between the controller and the base.

Source: nav2_velocity_smoother (Humble and Jazzy) src/velocity_smoother.cpp; nav2_util src/odometry_utils.cpp.
"""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray

from controllers.base import STOP, Twist
from controllers.nav2_params.navigation import VelocitySmoother as VelocitySmootherParams
from controllers.navigator.kernels import smooth
from controllers.navigator.rate import TIME_RESOLUTION

LINEAR, ANGULAR = 0, 2
"""Places of forward speed and turn rate in Nav2's ``[x, y, theta]`` lists."""


class VelocitySmoother:
    """Turns commands into commands the base can follow; a timer publishes them.

    When no command has come for ``velocity_timeout``, it brings the robot to a stop and falls silent.

    Args:
        params: The parameters: limits, feedback, deadband, frequency.
        first_time: When the timer fires first, s.
    """

    def __init__(self, params: VelocitySmootherParams, first_time: float = 0.0) -> None:
        self._limits, self._scales = limits_of(params), params.scale_velocities
        self._deadband_v, self._deadband_w = params.deadband_velocity[LINEAR], params.deadband_velocity[ANGULAR]
        self._patience = params.velocity_timeout + TIME_RESOLUTION
        self._period = int(1000.0 / params.smoothing_frequency) / 1000.0
        self._first_time, self._firings = first_time, 0
        self._next_time = first_time
        self._command: Twist | None = None
        self._commanded_at = 0.0
        self._last = STOP
        self._is_silent = True
        self._odometry = OdomSmoother(params.odom_duration) if params.feedback == "CLOSED_LOOP" else None

    def take(self, command: Twist, now: float) -> None:
        """Take a command that comes at ``now``, s."""
        self._command, self._commanded_at = command, now

    def measure(self, odometry: Twist, now: float) -> None:
        """Take a measured velocity; only CLOSED_LOOP uses it."""
        if self._odometry is not None:
            self._odometry.take(odometry, now)

    def advance(self, now: float) -> Twist | None:
        """Let the timer fire as often as it is due until ``now`` (s); returns what was published last, if anything."""
        published = None
        while self._next_time <= now + TIME_RESOLUTION:
            published = self._publish(self._next_time) or published
            self._firings += 1
            self._next_time = self._first_time + self._firings * self._period
        return published

    def _publish(self, now: float) -> Twist | None:
        """Return what the timer publishes; None if it is silent."""
        if self._command is None:
            return None
        if now - self._commanded_at > self._patience:
            if self._is_silent or self._last == STOP:
                self._is_silent = True
                return None
            self._command = STOP
        self._is_silent = False
        current = self._last if self._odometry is None else self._odometry.mean
        v, w = smooth(*current, *self._command, self._limits, self._scales)
        self._last = Twist(v, w)
        return Twist(0.0 if abs(v) < self._deadband_v else v, 0.0 if abs(w) < self._deadband_w else w)


class OdomSmoother:
    """The mean of the newest odometry, kept as a running sum as in Nav2.

    Args:
        duration: Age up to which a message counts, s before the newest one.
    """

    def __init__(self, duration: float) -> None:
        self._duration = duration
        self._history: deque[tuple[float, Twist]] = deque()
        self._sum = STOP

    def take(self, odometry: Twist, now: float) -> None:
        """Take a measured velocity."""
        while self._history and now - self._history[0][0] > self._duration + TIME_RESOLUTION:
            _, oldest = self._history.popleft()
            self._sum = Twist(self._sum.v - oldest.v, self._sum.w - oldest.w)
        self._history.append((now, odometry))
        self._sum = Twist(self._sum.v + odometry.v, self._sum.w + odometry.w)

    @property
    def mean(self) -> Twist:
        """Mean of the velocities that count; zero before the first."""
        count = len(self._history)
        return Twist(self._sum.v / count, self._sum.w / count) if count else STOP


def limits_of(params: VelocitySmootherParams) -> NDArray[np.float64]:
    """Return the limits of :func:`~controllers.navigator.kernels.smooth`.

    A largest change is a quotient as in Nav2: its rounding decides which limit the step after the last one has.
    """
    rows = [
        (
            params.min_velocity[axis],
            params.max_velocity[axis],
            params.max_accel[axis] / params.smoothing_frequency,
            -params.max_decel[axis] / params.smoothing_frequency,
        )
        for axis in (LINEAR, ANGULAR)
    ]
    return np.array(rows)
