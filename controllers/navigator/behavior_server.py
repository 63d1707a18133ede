"""BehaviorServer: runs the recovery behaviours, cycle by cycle.

Source: nav2_behaviors (Humble and Jazzy) timed_behavior.hpp.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

from controllers.base import STOP, Twist
from controllers.behaviors import BehaviorServer as BehaviorServerParams
from controllers.navigator.actions import Executor, Outcome, Result
from controllers.navigator.behaviors import Behavior
from controllers.navigator.rate import NEVER, TIME_RESOLUTION, Rate
from controllers.navigator.robot_state import RobotState
from controllers.navigator.topic_collisions import is_collision_free
from gym_mapbench.costmap import Costmap
from gym_mapbench.world.footprint import Footprint
from gym_mapbench.world.scenario import Pose

DONE, FAILED = Outcome(Result.SUCCEEDED), Outcome(Result.ABORTED)


class BehaviorServer(Executor):
    """Runs one behaviour at a time, at its own slower rate; it is what an action server of a behaviour executes.

    Args:
        params: The parameters.
        footprint: The padded footprint.
        robot: What is measured of the robot.
        costmap: Returns the local costmap as it was last published; None if it never was.
        publish: Takes the commands.

    Attributes:
        next_time: When the next cycle begins, s.
    """

    _behavior: Behavior
    _started: float

    def __init__(
        self,
        params: BehaviorServerParams,
        footprint: Footprint,
        robot: RobotState,
        costmap: Callable[[], Costmap | None],
        publish: Callable[[Twist], None],
    ) -> None:
        self._rate = Rate(1.0 / params.cycle_frequency)
        self._footprint, self._robot, self._costmap, self._publish = footprint, robot, costmap, publish
        self.next_time = NEVER

    def begin(self, goal: Behavior, now: float) -> None:
        """Start a behaviour; its first cycle begins at once."""
        self._behavior, self._started, self.next_time = goal, now, now
        self._makes_sense = goal.on_run(self._robot.local_pose)
        self._rate.start(now)

    def step(self, now: float) -> Outcome | None:
        """Do the cycle that is due."""
        if not self._makes_sense:
            return FAILED
        outcome = self._cycle(self._robot.local_pose, now - self._started)
        self.next_time = self._rate.next_after(now)
        if outcome is not None and self._behavior.moves:
            self._publish(STOP)
        return outcome

    def cancel(self) -> None:
        """Stop the robot."""
        self._publish(STOP)

    def _cycle(self, pose: Pose, elapsed: float) -> Outcome | None:
        """Do one ``onCycleUpdate``: the behaviour is out of time, complete, blocked or on its way."""
        behavior = self._behavior
        if behavior.time_allowance > 0.0 and elapsed > behavior.time_allowance + TIME_RESOLUTION:
            return FAILED
        if behavior.is_complete(pose, elapsed):
            return DONE
        command = behavior.next_command(pose)
        if command is None:
            return None
        if behavior.checks_collisions and self._is_blocked(behavior.poses_ahead(pose, command)):
            return FAILED
        self._publish(command)
        return None

    def _is_blocked(self, poses: Iterable[Pose]) -> bool:
        """Whether the robot touches something at one of some poses; it does as long as there is no costmap."""
        costmap = self._costmap()
        return costmap is None or not all(is_collision_free(pose, costmap, self._footprint) for pose in poses)
