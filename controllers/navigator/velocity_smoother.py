"""VelocitySmoother: bounds velocity and acceleration between the controller and the base.

Source: nav2_velocity_smoother (Humble and Jazzy) src/velocity_smoother.cpp.
"""

from __future__ import annotations

from collections import deque

from controllers.base import Twist
from controllers.nav2_params.navigation import VelocitySmoother as VelocitySmootherParams
from controllers.navigator.rate import TIME_RESOLUTION

LINEAR, ANGULAR = 0, 2
"""Places of forward speed and turn rate in Nav2's ``[x, y, theta]`` lists."""


class VelocitySmoother:
    """Turns commands into commands the base can follow.

    One call is one smoothing step and lasts one control period, whatever ``smoothing_frequency`` says. Every call has a
    command, so ``velocity_timeout`` never passes.

    Args:
        params: The parameters: limits, feedback, deadband.
        control_period: Seconds between two calls.
    """

    def __init__(self, params: VelocitySmootherParams, control_period: float) -> None:
        self._params = params
        self._period = control_period
        self._last = Twist(0.0, 0.0)
        self._measured: deque[Twist] = deque(maxlen=int(params.odom_duration / control_period + TIME_RESOLUTION) + 1)

    def smooth(self, command: Twist, odometry: Twist) -> Twist:
        """Return the command for the base, given the controller's command and the measured velocity."""
        self._measured.append(odometry)
        current = self._last if self._params.feedback == "OPEN_LOOP" else self._mean_odometry()
        wanted = Twist(self._within_velocity(command.v, LINEAR), self._within_velocity(command.w, ANGULAR))
        changes = wanted.v - current.v, wanted.w - current.w
        limits = self._limit(current.v, wanted.v, LINEAR), self._limit(current.w, wanted.w, ANGULAR)
        ratio = _common_ratio(changes, limits) if self._params.scale_velocities else 1.0
        self._last = Twist(
            current.v + _clamp(ratio * changes[0], limits[0]), current.w + _clamp(ratio * changes[1], limits[1])
        )
        return Twist(self._outside_deadband(self._last.v, LINEAR), self._outside_deadband(self._last.w, ANGULAR))

    def _mean_odometry(self) -> Twist:
        count = len(self._measured)
        return Twist(sum(t.v for t in self._measured) / count, sum(t.w for t in self._measured) / count)

    def _within_velocity(self, value: float, axis: int) -> float:
        return min(max(value, self._params.min_velocity[axis]), self._params.max_velocity[axis])

    def _limit(self, current: float, wanted: float, axis: int) -> float:
        """Largest change in one step: ``max_accel`` when speeding up without passing zero, else ``max_decel``."""
        speeds_up = abs(wanted) >= abs(current) and current * wanted >= 0.0
        return (self._params.max_accel[axis] if speeds_up else -self._params.max_decel[axis]) * self._period

    def _outside_deadband(self, value: float, axis: int) -> float:
        return 0.0 if abs(value) < self._params.deadband_velocity[axis] else value


def _clamp(change: float, limit: float) -> float:
    return min(max(change, -limit), limit)


def _common_ratio(changes: tuple[float, float], limits: tuple[float, float]) -> float:
    """Ratio by which both changes shrink so that the more restricted one keeps within its limit."""
    ratios = [limit / abs(change) for change, limit in zip(changes, limits, strict=True) if abs(change) > limit > 0.0]
    return min(ratios, default=1.0)
