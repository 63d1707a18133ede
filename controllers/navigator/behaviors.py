"""Recovery behaviours: spin, drive on heading, back up and wait.

Source: nav2_behaviors (Humble and Jazzy) plugins/spin.cpp, drive_on_heading.hpp, back_up.cpp, wait.cpp and
timed_behavior.hpp. Angles and speeds of a goal are numbers of single precision in its message.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator

import numpy as np

from controllers.base import Twist
from controllers.behaviors import NO_LIMITS, DriveLimits
from controllers.behaviors import BehaviorServer as BehaviorServerParams
from controllers.navigator.rate import TIME_RESOLUTION
from gym_mapbench.world.scenario import Pose, wrap_angle


class Behavior(ABC):
    """One run of a behaviour.

    Args:
        time_allowance: Seconds after which the behaviour fails; 0 for no limit.

    Attributes:
        moves: Whether the behaviour commands the robot; it then also stops it at its end.
        checks_collisions: Whether a command is published only if the poses ahead are free.
    """

    moves = True
    checks_collisions = True

    def __init__(self, time_allowance: float = 0.0) -> None:
        self.time_allowance = time_allowance

    def on_run(self, pose: Pose) -> bool:
        """Begin at ``pose``; False if the goal makes no sense."""
        return True

    @abstractmethod
    def is_complete(self, pose: Pose, elapsed: float) -> bool:
        """Whether the behaviour is complete ``elapsed`` s after its start."""

    def next_command(self, pose: Pose) -> Twist | None:
        """Return the command of this cycle; None for none."""
        return None

    def poses_ahead(self, pose: Pose, command: Twist) -> Iterator[Pose]:
        """Yield the poses that must be free of collision for ``command`` to be published."""
        return iter(())


class Spin(Behavior):
    """Turns on the spot by ``spin_dist`` rad.

    Nav2's look-ahead is copied with its quirk: it ends where the simulated turn reaches the turn already made, so the
    first cycle checks nothing.
    """

    def __init__(self, spin_dist: float, params: BehaviorServerParams, time_allowance: float = 10.0) -> None:
        super().__init__(time_allowance)
        self._target = single(spin_dist)
        self._params = params

    def on_run(self, pose: Pose) -> bool:
        """Begin to add up the angle turned."""
        self._travelled = 0.0
        self._last_yaw = pose.yaw
        return True

    def is_complete(self, pose: Pose, elapsed: float) -> bool:
        """Whether the robot has turned far enough."""
        self._travelled += wrap_angle(pose.yaw - self._last_yaw)
        self._last_yaw = pose.yaw
        return self._remaining < 1e-6

    @property
    def _remaining(self) -> float:
        return abs(self._target) - abs(self._travelled)

    def next_command(self, pose: Pose) -> Twist:
        """Turn as fast as the robot may and still stop within the rest of the turn."""
        return Twist(0.0, math.copysign(self.turn_rate(self._remaining), self._target))

    def turn_rate(self, remaining: float) -> float:
        """Return the turn rate, rad/s, at ``remaining`` rad before the end."""
        braking = math.sqrt(2.0 * self._params.rotational_acc_lim * remaining)
        return min(max(braking, self._params.min_rotational_vel), self._params.max_rotational_vel)

    def poses_ahead(self, pose: Pose, command: Twist) -> Iterator[Pose]:
        """Simulate the turn onwards, by no more than the robot has turned already."""
        for seconds in cycle_times(self._params):
            turn = command.w * seconds
            if abs(self._travelled) - abs(turn) <= 0.0:
                return
            yield Pose(pose.x, pose.y, pose.yaw + turn)


class DriveOnHeading(Behavior):
    """Drives straight for ``dist`` m at ``speed`` m/s within ``limits``; both are negative for driving backwards."""

    def __init__(
        self,
        dist: float,
        speed: float,
        params: BehaviorServerParams,
        time_allowance: float = 10.0,
        limits: DriveLimits = NO_LIMITS,
    ) -> None:
        super().__init__(time_allowance)
        self._target, self._speed = dist, single(speed)
        self._params, self._limits = params, limits

    def on_run(self, pose: Pose) -> bool:
        """Measure the distance from here; False if distance and speed have different signs."""
        self._start, self._last_speed = pose, 0.0
        return (self._target > 0.0) == (self._speed > 0.0)

    def is_complete(self, pose: Pose, elapsed: float) -> bool:
        """Whether the straight-line distance from the start is covered."""
        self._remaining = abs(self._target) - math.hypot(pose.x - self._start.x, pose.y - self._start.y)
        return self._remaining <= 0.0

    def next_command(self, pose: Pose) -> Twist:
        """Drive at the speed of the goal, or as fast as the limits of the acceleration allow."""
        self._last_speed = self._limited_speed()
        return Twist(math.copysign(self._last_speed, self._speed), 0.0)

    def _limited_speed(self) -> float:
        """Return the speed without its sign, m/s."""
        limits, cycle, speed = self._limits, self._params.cycle_frequency, abs(self._speed)
        if limits.acceleration_limit and limits.deceleration_limit:
            slowest = self._last_speed + limits.deceleration_limit / cycle
            fastest = self._last_speed + limits.acceleration_limit / cycle
            stopping = math.sqrt(2.0 * abs(limits.deceleration_limit) * self._remaining)
            speed = min(max(speed, slowest), fastest, stopping)
        return max(speed, limits.minimum_speed)

    def poses_ahead(self, pose: Pose, command: Twist) -> Iterator[Pose]:
        """Simulate the drive onwards, up to the end of the distance."""
        for seconds in cycle_times(self._params):
            ahead = command.v * seconds
            if self._remaining - abs(ahead) <= 0.0:
                return
            yield Pose(pose.x + ahead * math.cos(pose.yaw), pose.y + ahead * math.sin(pose.yaw), pose.yaw)


class BackUp(DriveOnHeading):
    """Drives ``backup_dist`` m backwards at ``backup_speed`` m/s, whatever their signs."""

    def __init__(
        self, backup_dist: float, backup_speed: float, params: BehaviorServerParams, time_allowance: float = 10.0
    ) -> None:
        super().__init__(-abs(backup_dist), -abs(backup_speed), params, time_allowance, params.backup)


class Wait(Behavior):
    """Waits for ``wait_duration`` s; it commands nothing."""

    moves = False

    def __init__(self, wait_duration: float) -> None:
        super().__init__()
        self._duration = wait_duration

    def is_complete(self, pose: Pose, elapsed: float) -> bool:
        """Whether the time is up."""
        return elapsed >= self._duration - TIME_RESOLUTION


def single(value: float) -> float:
    """Return a number as a message holds it in single precision."""
    return float(np.float32(value))


def cycle_times(params: BehaviorServerParams) -> Iterator[float]:
    """Yield the times of the look-ahead, s from now: one for each cycle of the server."""
    for cycle in range(int(params.cycle_frequency * params.simulate_ahead_time)):
        yield cycle / params.cycle_frequency
