"""Recovery behaviours: spin, back up and wait, and the server that runs them.

Source: nav2_behaviors (Humble and Jazzy) plugins/spin.cpp, drive_on_heading.hpp, back_up.cpp, wait.cpp and
timed_behavior.hpp. The behaviours look at the local costmap that the controller sees, without the delay of its topic.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator

from controllers.base import STOP, Twist
from controllers.nav2_params.navigation import BehaviorServer as BehaviorServerParams
from controllers.navigator.behavior_tree import Status
from controllers.navigator.rate import TIME_RESOLUTION, Rate
from gym_mapbench.costmap import LETHAL_OBSTACLE, Costmap
from gym_mapbench.kernels.footprint import footprint_cost
from gym_mapbench.world.footprint import Footprint
from gym_mapbench.world.scenario import Pose, wrap_angle


class Behavior(ABC):
    """One run of a behaviour.

    Args:
        time_allowance: Seconds after which the behaviour fails; None for no limit.
    """

    def __init__(self, time_allowance: float | None = None) -> None:
        self.time_allowance = time_allowance

    @abstractmethod
    def on_run(self, pose: Pose) -> None:
        """Remember where the behaviour begins."""

    @abstractmethod
    def next_command(self, pose: Pose, elapsed: float) -> Twist | None:
        """Return the command of this cycle, or None once the behaviour is complete."""

    @abstractmethod
    def poses_ahead(self, pose: Pose, command: Twist) -> Iterator[Pose]:
        """Yield the poses that must be free of collision for ``command`` to be published."""


class Spin(Behavior):
    """Turns on the spot by ``spin_dist`` rad.

    Nav2's look-ahead is copied with its quirk: it ends where the simulated turn reaches the turn already made, so the
    first cycle checks nothing.
    """

    def __init__(self, spin_dist: float, params: BehaviorServerParams, time_allowance: float = 10.0) -> None:
        super().__init__(time_allowance)
        self._target = spin_dist
        self._params = params

    def on_run(self, pose: Pose) -> None:
        """Begin to add up the angle turned."""
        self._travelled = 0.0
        self._last_yaw = pose.yaw

    def next_command(self, pose: Pose, elapsed: float) -> Twist | None:
        """Turn as fast as the robot may and still stop within the rest of the turn."""
        self._travelled += wrap_angle(pose.yaw - self._last_yaw)
        self._last_yaw = pose.yaw
        remaining = abs(self._target) - abs(self._travelled)
        if remaining < 1e-6:
            return None
        return Twist(0.0, math.copysign(self.turn_rate(remaining), self._target))

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


class BackUp(Behavior):
    """Drives ``backup_dist`` m backwards at ``backup_speed`` m/s, whatever their signs."""

    def __init__(
        self, backup_dist: float, backup_speed: float, params: BehaviorServerParams, time_allowance: float = 10.0
    ) -> None:
        super().__init__(time_allowance)
        self._distance = abs(backup_dist)
        self._speed = -abs(backup_speed)
        self._params = params

    def on_run(self, pose: Pose) -> None:
        """Measure the distance from here."""
        self._start = pose

    def next_command(self, pose: Pose, elapsed: float) -> Twist | None:
        """Drive until the straight-line distance from the start is covered."""
        self._remaining = self._distance - math.hypot(pose.x - self._start.x, pose.y - self._start.y)
        return Twist(self._speed, 0.0) if self._remaining > 0.0 else None

    def poses_ahead(self, pose: Pose, command: Twist) -> Iterator[Pose]:
        """Simulate the drive onwards, up to the end of the distance."""
        for seconds in cycle_times(self._params):
            ahead = command.v * seconds
            if self._remaining - abs(ahead) <= 0.0:
                return
            yield Pose(pose.x + ahead * math.cos(pose.yaw), pose.y + ahead * math.sin(pose.yaw), pose.yaw)


class Wait(Behavior):
    """Stands still for ``wait_duration`` s."""

    def __init__(self, wait_duration: float) -> None:
        super().__init__()
        self._duration = wait_duration

    def on_run(self, pose: Pose) -> None:
        """Do nothing: there is nothing to remember."""

    def next_command(self, pose: Pose, elapsed: float) -> Twist | None:
        """Stand until the time is up."""
        return STOP if elapsed < self._duration - TIME_RESOLUTION else None

    def poses_ahead(self, pose: Pose, command: Twist) -> Iterator[Pose]:
        """Yield nothing: standing needs no look-ahead."""
        return iter(())


def cycle_times(params: BehaviorServerParams) -> Iterator[float]:
    """Yield the times of the look-ahead, s from now: one for each cycle of the server."""
    for cycle in range(int(params.cycle_frequency * params.simulate_ahead_time)):
        yield cycle / params.cycle_frequency


class BehaviorServer:
    """Runs one behaviour at a time, at its own slower rate; a command is held until the next cycle.

    Attributes:
        command: The command in force.
    """

    _behavior: Behavior
    _started: float

    def __init__(self, params: BehaviorServerParams, footprint: Footprint) -> None:
        self.command = STOP
        self._rate = Rate(params.cycle_frequency)
        self._footprint = footprint

    def run(self, behavior: Behavior, pose: Pose, now: float) -> None:
        """Start a behaviour; the next :meth:`step` is its first cycle."""
        behavior.on_run(pose)
        self._behavior = behavior
        self._started = now
        self._rate.start(now)

    def step(self, pose: Pose, costmap: Costmap, now: float) -> Status:
        """Do the cycle that is due now, or hold the command of the last one."""
        if not self._rate.is_due(now):
            return Status.RUNNING
        status, self.command = self._cycle(pose, costmap, now - self._started)
        return status

    def cancel(self) -> None:
        """Stop the robot."""
        self.command = STOP

    def _cycle(self, pose: Pose, costmap: Costmap, elapsed: float) -> tuple[Status, Twist]:
        """Do one ``onCycleUpdate``: the behaviour is out of time, complete, blocked or on its way."""
        behavior = self._behavior
        if behavior.time_allowance is not None and elapsed > behavior.time_allowance + TIME_RESOLUTION:
            return Status.FAILURE, STOP
        command = behavior.next_command(pose, elapsed)
        if command is None:
            return Status.SUCCESS, STOP
        if not all(self._is_free(ahead, costmap) for ahead in behavior.poses_ahead(pose, command)):
            return Status.FAILURE, STOP
        return Status.RUNNING, command

    def _is_free(self, pose: Pose, costmap: Costmap) -> bool:
        """Whether the outline at ``pose`` touches neither an obstacle nor unknown space, and stays on the map."""
        if costmap.world_to_map(pose.x, pose.y) is None:
            return False
        cost = footprint_cost(
            costmap.costs,
            costmap.resolution,
            costmap.origin_x,
            costmap.origin_y,
            *pose,
            self._footprint.corners,
        )
        return bool(cost < LETHAL_OBSTACLE)
