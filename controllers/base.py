"""The interface of a controller, a policy over the env API, and of Nav2's path followers inside a controller.

:class:`Controller` is all that a run needs: ``reset`` and ``act``. Nav2's controllers are
:class:`PathFollower` objects; :class:`controllers.navigator.navigator.Navigator` turns any of them into a
Controller by adding planning, checkers and recoveries.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from gym_mapbench.costmap import Costmap
from gym_mapbench.errors import MapBenchError
from gym_mapbench.world.footprint import Footprint
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.lidar import LidarSettings
from gym_mapbench.world.robot import RobotSpec
from gym_mapbench.world.scenario import Pose

Observation = Mapping[str, Any]


class Twist(NamedTuple):
    """Forward speed in m/s and turn rate in rad/s."""

    v: float
    w: float


STOP = Twist(0.0, 0.0)


class ControllerError(MapBenchError):
    """The controller has no valid command now; ``failure_tolerance`` says how long the server waits for one.

    Humble's ``PlannerException``, Jazzy's ``NoValidControl``.
    """


class ControllerAbort(MapBenchError):  # noqa: N818 - it ends the action, whatever the tolerance
    """The action ends at once: any other exception of a controller, such as the runtime errors of Humble's MPPI.

    Attributes:
        code: The error code of Jazzy's ``FollowPath``.
    """

    code = 101


class InvalidPath(ControllerAbort):
    """Nothing is left of the path to follow (Jazzy's ``InvalidPath``): no recovery would help."""

    code = 104


class LocalPlan(NamedTuple):
    """The part of the plan that Lyrical's path handler gives to all controllers and to the goal checker.

    Args:
        path: ``(n, 3)`` x, y in m and yaw in rad, from the pose nearest to the robot on; at least one pose.
        length: Its length, m.
        goal: The last pose of the whole plan.
    """

    path: NDArray[np.float64]
    length: float
    goal: Pose


@dataclass(frozen=True)
class Context:
    """The run, as a controller is told before it starts.

    Args:
        robot: Shape and limits of the robot.
        grid: The static map.
        start: Start pose on the map.
        goal: Goal pose on the map.
        control_period: Seconds between two calls of ``act``.
        rng: The run's own generator; the only source of randomness a controller may use.
        lidar: The lidar that measures the observation's ``scan``: its beams and its place on the robot.
    """

    robot: RobotSpec
    grid: GridMap
    start: Pose
    goal: Pose
    control_period: float
    rng: np.random.Generator
    lidar: LidarSettings = field(default_factory=LidarSettings)


class Controller(Protocol):
    """A policy over the env API.

    ``observation_keys`` names the parts of the observation that it needs; one that was trained with certain sensors
    also has ``fit(config)``, which returns an :class:`~gym_mapbench.env.config.EnvConfig` with them. A controller that
    decides by itself when its run is over (as Nav2 does) also has ``decides_goal = True`` and the attributes of
    :class:`controllers.navigator.navigator.Navigator`: ``status`` and ``events``.
    """

    @property
    def observation_keys(self) -> tuple[str, ...]:
        """Keys of the observation this controller reads."""
        ...

    def reset(self, context: Context) -> None:
        """Forget the last run and prepare for the next."""
        ...

    def act(self, observation: Observation) -> NDArray[np.float64] | tuple[float, float]:
        """Return the command ``(v m/s, omega rad/s)`` for one control period."""
        ...


class GoalChecker(Protocol):
    """Says whether a goal pose is reached."""

    def reset(self) -> None:
        """Forget what was reached."""
        ...

    def is_goal_reached(self, pose: Pose, goal: Pose, velocity: Twist, local: LocalPlan | None = None) -> bool:
        """Return whether the robot at ``pose``, moving with ``velocity``, is at ``goal``; ``local`` is Lyrical's."""
        ...

    def is_position_reached(self, pose: Pose, local: LocalPlan) -> bool:
        """Return whether the goal's position is reached, as Lyrical's controllers ask."""
        ...


@dataclass(frozen=True)
class FollowerSetup:
    """What Nav2's controller server hands a controller plugin before a run.

    Args:
        footprint: The padded footprint.
        control_period: Seconds between two calls, 1 / ``controller_frequency``.
        xy_goal_tolerance: The goal checker's tolerance of the position, m.
        yaw_goal_tolerance: The goal checker's tolerance of the heading, rad.
        inflation_radius: The radius of the local costmap's inflation layer, m.
        cost_scaling_factor: The cost scaling factor of the same layer, 1/m.
        rng: The run's own generator.
        goal_checker: The goal checker, which Lyrical's controllers share with the server.
        custom_inscribed_radius: Lyrical: the inscribed radius of the same layer, m; negative for the footprint's.
    """

    footprint: Footprint
    control_period: float
    xy_goal_tolerance: float
    yaw_goal_tolerance: float
    inflation_radius: float
    cost_scaling_factor: float
    rng: np.random.Generator
    goal_checker: GoalChecker | None = None
    custom_inscribed_radius: float = -1.0


class PathFollower(Protocol):
    """A controller plugin in Nav2's sense (``nav2_core::Controller``).

    Plan, pose and costmap are all given in the frame of the local costmap, into which Nav2's controllers transform the
    plan themselves. That frame moves against the map, and the plan moves with it: see :meth:`move_plan`.

    A follower with the method ``set_speed_limit(speed: float, percentage: bool)`` obeys the limits of speed filters: in
    m/s or per cent of its top speed, 0 for none. Others cannot drive with such filters.

    A follower with the method ``take_local_plan(local: LocalPlan)`` follows the local plan in Lyrical: the server calls
    it before every :meth:`compute_velocity_commands`.
    """

    def reset(self, setup: FollowerSetup) -> None:
        """Forget everything of the last run."""
        ...

    def set_plan(self, path: NDArray[np.float64]) -> None:
        """Take a new global plan, ``(n, 3)`` x, y in m and yaw in rad, start to goal."""
        ...

    def move_plan(self, path: NDArray[np.float64]) -> None:
        """Take the whole plan of the last :meth:`set_plan` again, at its new place.

        It is the same plan with the same number of poses, only shifted and turned. The poses that the robot has
        passed stay passed, and nothing else is forgotten either.
        """
        ...

    def compute_velocity_commands(self, pose: Pose, velocity: Twist, costmap: Costmap, now: float) -> Twist:
        """Return the next command.

        Args:
            pose: Pose of the robot, in the costmap's frame.
            velocity: Odometry, already thresholded.
            costmap: Local costmap.
            now: Seconds since the start of the run.

        Raises:
            ControllerError: If no valid command exists now.
            ControllerAbort: If the action must end at once.
        """
        ...
