"""ControllerServer: Nav2's FollowPath action around one path follower.

Source: nav2_controller (Humble and Jazzy) src/controller_server.cpp, ``computeControl`` and what it calls. Paths come
in the frame of the map; everything else, checkers included, is in the frame of the local costmap. In Nav2 every
controller transforms the plan into that frame in every cycle; here the server does it for them, with the newest
transform.
"""

from __future__ import annotations

import time

import numpy as np
from numpy.typing import NDArray

from controllers.base import STOP, ControllerAbort, ControllerError, InvalidPath, PathFollower, Twist
from controllers.nav2_params.navigation import ControllerServer as ControllerServerParams
from controllers.navigator.behavior_tree import Status
from controllers.navigator.checkers import make_goal_checker, make_progress_checker
from controllers.navigator.rate import TIME_RESOLUTION, Rate
from controllers.releases import Release
from gym_mapbench.costmap import Costmap
from gym_mapbench.world.frames import IDENTITY, transform_path
from gym_mapbench.world.scenario import Pose


class ControllerServer:
    """Follows a path until its end is reached or the follower has failed for too long.

    It cycles at ``controller_frequency``; a command is held until the next cycle.

    Args:
        follower: DWB, MPPI or any other :class:`controllers.base.PathFollower`.
        params: The parameters: checkers, thresholds and failure tolerance.
        abort_is_exception: Whether ``failure_tolerance`` also covers a ControllerAbort; in Nav2 such an exception ends
            the action at once.
        release: The release of Nav2. In Jazzy a controller is reset whenever an action ends: its ``end_action()`` is
            called, if it has one.

    Attributes:
        command: The command in force.
        failure_reason: Why the action was aborted.
        recovery_would_help: Whether the failure is one that, by Jazzy's error codes, a recovery may help against.
        seconds: Wall-clock seconds spent inside the follower.
        calls: Number of calls of the follower.
    """

    def __init__(
        self,
        follower: PathFollower,
        params: ControllerServerParams,
        *,
        abort_is_exception: bool = False,
        release: Release = "humble",
    ) -> None:
        self._follower = follower
        self._params = params
        self._abort_is_exception = abort_is_exception
        self._goal_checker = make_goal_checker(params.goal_checker)
        self._progress_checker = make_progress_checker(params.progress_checker)
        self._rate = Rate(params.controller_frequency)
        self.command = STOP
        self.failure_reason = ""
        self.recovery_would_help = False
        self._end_action = getattr(follower, "end_action", None) if release != "humble" else None
        self.seconds = 0.0
        self.calls = 0

    def start(self, path: NDArray[np.float64], now: float) -> None:
        """Begin to follow ``path``, ``(n, 3)`` x, y in m and yaw in rad on the map."""
        self.set_plan(path)
        self._progress_checker.reset()
        self._last_valid_time = now
        self._rate.start(now)

    def set_plan(self, path: NDArray[np.float64]) -> None:
        """Take a new path; the goal checker begins anew, the progress checker does not."""
        self._path, self._map_seen = path, IDENTITY
        self._goal_checker.reset()
        if len(path):
            self._goal = Pose(*map(float, path[-1]))
            self._follower.set_plan(path)

    def step(
        self, pose: Pose, odometry: Twist, costmap: Costmap, now: float, map_in_costmap: Pose = IDENTITY
    ) -> Status:
        """Do a cycle if one is due: check progress, ask for a command, and test the goal at the same pose.

        Args:
            pose: Pose of the robot, in the costmap's frame.
            odometry: Measured velocity.
            costmap: The local costmap.
            now: Seconds since the start of the run.
            map_in_costmap: Pose of the map's frame in the costmap's frame.
        """
        if not self._rate.is_due(now):
            return Status.RUNNING
        if not len(self._path):
            return self._abort("Path is empty.", recovery_would_help=False)
        if map_in_costmap != self._map_seen:
            self._move_plan(map_in_costmap)
        if not self._progress_checker.check(pose, now):
            return self._abort("Failed to make progress")
        velocity = self._without_noise(odometry)
        try:
            self.command = self._compute(pose, velocity, costmap, now)
            self._last_valid_time = now
        except (ControllerError, ControllerAbort) as error:
            if not self._is_patient_with(error, now):
                return self._abort(str(error), recovery_would_help=not isinstance(error, InvalidPath))
            self.command = STOP
        if self._goal_checker.is_goal_reached(pose, self._goal, velocity):
            self._end()
            return Status.SUCCESS
        return Status.RUNNING

    def cancel(self) -> None:
        """Stop the robot."""
        self._end()

    def _end(self) -> None:
        """Stop the robot and, in Jazzy, reset the controller."""
        self.command = STOP
        if self._end_action is not None:
            self._end_action()

    def _move_plan(self, map_in_costmap: Pose) -> None:
        """Give the follower the path at its new place."""
        self._map_seen = map_in_costmap
        path = transform_path(map_in_costmap, self._path)
        self._goal = Pose(*path[-1].tolist())
        self._follower.move_plan(path)

    def _compute(self, pose: Pose, velocity: Twist, costmap: Costmap, now: float) -> Twist:
        """Ask the follower for a command, and measure how long it takes."""
        began = time.perf_counter()
        try:
            return self._follower.compute_velocity_commands(pose, velocity, costmap, now)
        finally:
            self.seconds += time.perf_counter() - began
            self.calls += 1

    def _without_noise(self, odometry: Twist) -> Twist:
        """Return the measured velocity with components below the thresholds set to 0."""
        v = odometry.v if abs(odometry.v) > self._params.min_x_velocity_threshold else 0.0
        w = odometry.w if abs(odometry.w) > self._params.min_theta_velocity_threshold else 0.0
        return Twist(v, w)

    def _is_patient_with(self, error: ControllerError | ControllerAbort, now: float) -> bool:
        """Whether the action goes on although the controller has no valid command."""
        tolerance = self._params.failure_tolerance
        if tolerance == 0.0 or (isinstance(error, ControllerAbort) and not self._abort_is_exception):
            return False
        return tolerance == -1.0 or now - self._last_valid_time <= tolerance + TIME_RESOLUTION

    def _abort(self, reason: str, *, recovery_would_help: bool = True) -> Status:
        self._end()
        self.failure_reason, self.recovery_would_help = reason, recovery_would_help
        return Status.FAILURE
