"""ControllerServer: Nav2's FollowPath action around one path follower.

Source: nav2_controller (Humble, Jazzy and Lyrical) src/controller_server.cpp, ``computeControl`` and what it calls.
Paths come in the frame of the map; everything else, checkers included, is in the frame of the local costmap. In Nav2
every controller transforms the plan into that frame in every cycle; here the server does it for them, with the newest
transform.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from controllers.base import STOP, ControllerAbort, ControllerError, GoalChecker, LocalPlan, PathFollower, Twist
from controllers.nav2_params.navigation import ControllerServer as ControllerServerParams
from controllers.navigator import error_codes
from controllers.navigator.actions import Executor, Outcome, Result
from controllers.navigator.checkers import make_goal_checker, make_progress_checker
from controllers.navigator.costmap_wait import CostmapWait, ServedCostmap
from controllers.navigator.path_handler import FeasiblePathHandler
from controllers.navigator.rate import NEVER, TIME_RESOLUTION, Rate
from controllers.navigator.robot_state import RobotState
from gym_mapbench.releases import Release
from gym_mapbench.world.frames import IDENTITY, transform_path
from gym_mapbench.world.scenario import Pose

REACHED = Outcome(Result.SUCCEEDED)


def no_time() -> float:
    """Return 0 s: the follower computes its command at once."""
    return 0.0


class ControllerServer(Executor):
    """Follows a path until its end is reached or the follower has failed for too long.

    It cycles at ``controller_frequency``, and waits for the local costmap where that has been cleared.

    Args:
        follower: DWB, MPPI or any other :class:`controllers.base.PathFollower`.
        params: The parameters: checkers, thresholds and failure tolerance.
        robot: What is measured of the robot.
        costmap: The local costmap.
        publish: Takes the commands.
        abort_is_exception: Whether ``failure_tolerance`` also covers a ControllerAbort; in Nav2 such an exception ends
            the action at once.
        release: The release of Nav2. Since Jazzy the goal is checked before the follower is asked, and a controller is
            reset whenever an action ends: its ``end_action()`` is called, if it has one. In Lyrical a path handler cuts
            the local plan first.
        goal_checker: The goal checker; one of ``params`` if None.
        computing_time: Returns how long the follower took for its last command, s in simulated time.

    Attributes:
        next_time: When the next cycle begins, s.
        seconds: Wall-clock seconds spent inside the follower.
        calls: Number of calls of the follower.
    """

    _path: NDArray[np.float64]
    _goal: Pose
    _map_seen: Pose
    _last_valid_time: float

    def __init__(
        self,
        follower: PathFollower,
        params: ControllerServerParams,
        robot: RobotState,
        costmap: ServedCostmap,
        publish: Callable[[Twist], None],
        *,
        abort_is_exception: bool = False,
        release: Release = "humble",
        goal_checker: GoalChecker | None = None,
        computing_time: Callable[[], float] = no_time,
    ) -> None:
        self._follower, self._params, self._robot, self._costmap = follower, params, robot, costmap
        self._publish, self._computing_time = publish, computing_time
        self._abort_is_exception = abort_is_exception
        self._noise_v, self._noise_w = params.min_x_velocity_threshold, params.min_theta_velocity_threshold
        self._goal_checker = goal_checker or make_goal_checker(params.goal_checker)
        self._progress_checker = make_progress_checker(params.progress_checker)
        self._rate = Rate(1.0 / params.controller_frequency, restarts=True)
        self._checks_goal_first = release != "humble"
        self._stops_at_goal = params.publish_zero_velocity
        self._stops_elsewhere = params.publish_zero_velocity or release != "jazzy"
        self._wait = CostmapWait(costmap, NEVER if release == "humble" else params.costmap_update_timeout)
        self._path_handler = FeasiblePathHandler(params.path_handler) if release == "lyrical" else None
        self._local_plan: LocalPlan | None = None
        self._take_local_plan = getattr(follower, "take_local_plan", None)
        self._end_action = getattr(follower, "end_action", None) if release != "humble" else None
        self.next_time = NEVER
        self.seconds = 0.0
        self.calls = 0

    @property
    def listens(self) -> bool:
        """Whether cancellations and new paths are looked at: not while the server waits for the costmap."""
        return not self._wait.is_waiting

    def begin(self, goal: NDArray[np.float64], now: float) -> None:
        """Begin to follow a path, ``(n, 3)`` x, y in m and yaw in rad on the map."""
        self._set_plan(goal)
        self._progress_checker.reset()
        self._last_valid_time = self.next_time = now
        self._wait.forget()
        self._rate.start(now)

    def update(self, goal: NDArray[np.float64], now: float) -> bool:
        """Go on with a new path; the goal checker begins anew, the progress checker does not."""
        self._set_plan(goal)
        return True

    def step(self, now: float) -> Outcome | None:
        """Do the cycle that is due, or go on waiting for the costmap."""
        if not len(self._path):
            return self._abort("Path is empty.", error_codes.INVALID_PATH)
        if not self._wait.is_over(now):
            self.next_time = self._wait.next_time
            return None
        if self._wait.has_failed:
            return self._abort("Costmap timed out waiting for update", error_codes.CONTROLLER_TIMED_OUT)
        try:
            outcome = self._cycle(now)
        except ControllerAbort as error:
            outcome = self._abort(str(error), error.code)
        self.next_time = self._rate.next_after(now + self._spent)
        return None if outcome is None else outcome._replace(delay=self._spent)

    def cancel(self) -> None:
        """Stop the robot."""
        self._end(self._stops_elsewhere)

    def _cycle(self, now: float) -> Outcome | None:
        """Check progress, ask for a command, and test the goal: in Humble last, with a fresh pose, later first."""
        self._spent = 0.0
        pose = self._robot.local_pose
        self._place_plan()
        if self._path_handler is not None:
            self._local_plan = self._path_handler.local_plan(pose, self._costmap.costmap)
        if self._checks_goal_first and self._is_goal_reached():
            return self._reach()
        if not self._progress_checker.check(pose, now):
            return self._abort("Failed to make progress", error_codes.FAILED_TO_MAKE_PROGRESS)
        outcome = self._command(pose, now)
        if outcome is None and not self._checks_goal_first and self._is_goal_reached():
            return self._reach()
        return outcome

    def _command(self, pose: Pose, now: float) -> Outcome | None:
        """Ask the follower for a command and publish it; an outcome if the server's patience is over."""
        try:
            command = self._compute(pose, now)
            self._last_valid_time = now + self._spent
        except (ControllerError, ControllerAbort) as error:
            if not self._is_patient_with(error, now + self._spent):
                return self._abort(str(error), self._code_of(error))
            command = STOP
        self._publish(command)
        return None

    def _compute(self, pose: Pose, now: float) -> Twist:
        """Ask the follower for a command, and measure how long it takes."""
        began = time.perf_counter()
        try:
            velocity = self._without_noise(self._robot.odometry)
            if self._local_plan is not None and self._take_local_plan is not None:
                self._take_local_plan(self._local_plan)
            return self._follower.compute_velocity_commands(pose, velocity, self._costmap.costmap, now)
        finally:
            self.seconds += time.perf_counter() - began
            self.calls += 1
            self._spent = self._computing_time()

    def _set_plan(self, path: NDArray[np.float64]) -> None:
        self._path, self._map_seen = path, IDENTITY
        self._goal_checker.reset()
        if len(path):
            self._goal = Pose(*map(float, path[-1]))
            self._follower.set_plan(path)
            if self._path_handler is not None:
                self._path_handler.set_plan(path)

    def _place_plan(self) -> None:
        """Give the follower the path at its new place, if the frames have moved."""
        map_in_costmap = self._robot.map_in_local
        if map_in_costmap == self._map_seen:
            return
        self._map_seen = map_in_costmap
        path = transform_path(map_in_costmap, self._path)
        self._goal = Pose(*path[-1].tolist())
        self._follower.move_plan(path)
        if self._path_handler is not None:
            self._path_handler.move_plan(path)

    def _is_goal_reached(self) -> bool:
        """Whether the newest pose is at the end of the path."""
        robot = self._robot
        velocity = self._without_noise(robot.odometry)
        return self._goal_checker.is_goal_reached(robot.local_pose, self._goal, velocity, self._local_plan)

    def _without_noise(self, odometry: Twist) -> Twist:
        """Return the measured velocity with components below the thresholds set to 0."""
        v, w = odometry
        if abs(v) > self._noise_v and abs(w) > self._noise_w:
            return odometry
        return Twist(v if abs(v) > self._noise_v else 0.0, w if abs(w) > self._noise_w else 0.0)

    def _is_patient_with(self, error: ControllerError | ControllerAbort, now: float) -> bool:
        """Whether the action goes on although the controller has no valid command."""
        tolerance = self._params.failure_tolerance
        if tolerance == 0.0 or (isinstance(error, ControllerAbort) and not self._abort_is_exception):
            return False
        return tolerance == -1.0 or now - self._last_valid_time <= tolerance + TIME_RESOLUTION

    def _code_of(self, error: ControllerError | ControllerAbort) -> int:
        """Return the error code of an exception that ends the action."""
        if isinstance(error, ControllerAbort):
            return error.code
        impatient = self._params.failure_tolerance == 0.0
        return error_codes.NO_VALID_CONTROL if impatient else error_codes.PATIENCE_EXCEEDED

    def _reach(self) -> Outcome:
        self._end(self._stops_at_goal)
        return REACHED

    def _abort(self, reason: str, code: int) -> Outcome:
        self._end(self._stops_elsewhere)
        return Outcome(Result.ABORTED, code, reason)

    def _end(self, stops: bool) -> None:
        """Stop the robot if ``stops`` says so, and since Jazzy reset the controller (``onGoalExit``)."""
        if stops:
            self._publish(STOP)
        if self._end_action is not None:
            self._end_action()
