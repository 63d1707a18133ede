"""VelocitySmoother: bounds velocity and acceleration between the controller and the base.

Source: nav2_velocity_smoother (Humble and Jazzy) src/velocity_smoother.cpp; nav2_util src/odometry_utils.cpp.
"""

from __future__ import annotations

from collections import deque

from controllers.base import STOP, Twist
from controllers.nav2_params.navigation import VelocitySmoother as VelocitySmootherParams
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
        self._params = params
        self._period = int(1000.0 / params.smoothing_frequency) / 1000.0
        self._first_time, self._firings = first_time, 0
        self._command: Twist | None = None
        self._commanded_at = 0.0
        self._last = STOP
        self._is_silent = True
        self._odometry = OdomSmoother(params.odom_duration)

    def take(self, command: Twist, now: float) -> None:
        """Take a command that comes at ``now``, s."""
        self._command, self._commanded_at = command, now

    def measure(self, odometry: Twist, now: float) -> None:
        """Take a measured velocity."""
        self._odometry.take(odometry, now)

    def advance(self, now: float) -> Twist | None:
        """Let the timer fire as often as it is due until ``now`` (s); returns what was published last, if anything."""
        published = None
        while self._next_time <= now + TIME_RESOLUTION:
            published = self._publish(self._next_time) or published
            self._firings += 1
        return published

    @property
    def _next_time(self) -> float:
        return self._first_time + self._firings * self._period

    def _publish(self, now: float) -> Twist | None:
        """Return what the timer publishes; None if it is silent."""
        if self._command is None:
            return None
        if now - self._commanded_at > self._params.velocity_timeout + TIME_RESOLUTION:
            if self._is_silent or self._last == STOP:
                self._is_silent = True
                return None
            self._command = STOP
        self._is_silent = False
        self._last = self._smooth(self._command)
        return Twist(self._outside_deadband(self._last.v, LINEAR), self._outside_deadband(self._last.w, ANGULAR))

    def _smooth(self, command: Twist) -> Twist:
        """Return the velocity after one step towards a command."""
        current = self._last if self._params.feedback == "OPEN_LOOP" else self._odometry.mean
        wanted = Twist(self._within_velocity(command.v, LINEAR), self._within_velocity(command.w, ANGULAR))
        changes = wanted.v - current.v, wanted.w - current.w
        limits = self._limit(current.v, wanted.v, LINEAR), self._limit(current.w, wanted.w, ANGULAR)
        ratio = _common_ratio(changes, limits) if self._params.scale_velocities else 1.0
        return Twist(
            current.v + _clamp(ratio * changes[0], limits[0]), current.w + _clamp(ratio * changes[1], limits[1])
        )

    def _within_velocity(self, value: float, axis: int) -> float:
        return min(max(value, self._params.min_velocity[axis]), self._params.max_velocity[axis])

    def _limit(self, current: float, wanted: float, axis: int) -> float:
        """Largest change in one step: ``max_accel`` when speeding up without passing zero, else ``max_decel``.

        It is a quotient as in Nav2: its rounding decides which limit the step after the last one has.
        """
        speeds_up = abs(wanted) >= abs(current) and current * wanted >= 0.0
        change = self._params.max_accel[axis] if speeds_up else -self._params.max_decel[axis]
        return change / self._params.smoothing_frequency

    def _outside_deadband(self, value: float, axis: int) -> float:
        return 0.0 if abs(value) < self._params.deadband_velocity[axis] else value


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


def _clamp(change: float, limit: float) -> float:
    return min(max(change, -limit), limit)


def _common_ratio(changes: tuple[float, float], limits: tuple[float, float]) -> float:
    """Ratio that keeps the more restricted change within its limit; the one that differs most from 1."""
    ratios = [limit / abs(change) for change, limit in zip(changes, limits, strict=True) if abs(change) > limit > 0.0]
    return min(ratios, default=1.0)
