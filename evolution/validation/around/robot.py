"""The robot of a replay: a recorded plant in real time, as the servers of the navigator measure it."""

from __future__ import annotations

from collections.abc import Callable

from controllers.base import ControllerAbort, Twist
from controllers.navigator import error_codes
from evolution.validation.around.plant import STEP, RecordedPlant
from gym_mapbench.world.frames import IDENTITY
from gym_mapbench.world.scenario import Pose

ROUNDING = 1e-10
"""Much less than the ns by which a rate may be early, s."""
Command = tuple[float, float, float]


class NoPose(ControllerAbort):
    """The pose of the robot is not known."""

    code = error_codes.CONTROLLER_TF_ERROR


class ReplayedRobot:
    """A recorded plant that is driven by what the servers publish.

    Args:
        plant: The plant.
        has_pose: Whether the robot's pose is known at a time, s.

    Attributes:
        now: The time, s.
        commands: What was published: time, s, and the two speeds.
    """

    map_in_local = IDENTITY

    def __init__(self, plant: RecordedPlant, has_pose: Callable[[float], bool] = lambda now: True) -> None:
        self.now = 0.0
        self.commands: list[Command] = []
        self._plant, self._has_pose, self._steps = plant, has_pose, 0

    @property
    def local_pose(self) -> Pose:
        """Pose of the robot, m and rad.

        Raises:
            NoPose: If it is not known.
        """
        if not self._has_pose(self.now):
            raise NoPose("no pose")
        return self._plant.pose

    @property
    def odometry(self) -> Twist:
        """Velocity of the robot, m/s and rad/s."""
        return self._plant.velocity

    def publish(self, command: Twist) -> None:
        """Take a command, which acts from the next step of the plant on."""
        self.commands.append((self.now, *command))
        self._plant.command = command

    def move_until(self, now: float) -> None:
        """Let the plant do all steps that end until ``now``, s."""
        while (self._steps + 1) * STEP <= now + ROUNDING:
            self._steps += 1
            self._plant.advance(self._steps * STEP)
        self.now = now
