"""Controller server: ours asks a follower that does what was recorded, and results, commands and calls are compared."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.base import ControllerAbort, ControllerError, FollowerSetup, Twist
from controllers.nav2_params.navigation import ControllerServer as ControllerServerParams
from controllers.navigator import error_codes
from controllers.navigator.actions import ActionServer, GoalHandle
from controllers.navigator.controller_server import ControllerServer
from controllers.navigator.rate import NEVER, TIME_RESOLUTION
from evolution.validation.around.behaviors import AT_ONCE, EARLY, same_commands
from evolution.validation.around.plant import RecordedPlant
from evolution.validation.around.recordings import AroundOracle, Record
from evolution.validation.around.robot import ReplayedRobot
from evolution.validation.measures import Cases, Measure
from gym_mapbench.costmap import Costmap
from gym_mapbench.releases import Release
from gym_mapbench.ros_params import nest_dotted, overlay
from gym_mapbench.world.scenario import Pose

SAME_TIME, SAME_PLACE = 6e-4, 6e-8
"""Differences that the rounding of the recorded calls explains: s, and m, rad, m/s and rad/s."""
VALID = "ok"
NO_COMMAND = ("PlannerException", "NoValidControl")
CODES = {
    "ControllerTFError": error_codes.CONTROLLER_TF_ERROR,
    "FailedToMakeProgress": error_codes.FAILED_TO_MAKE_PROGRESS,
    "PatienceExceeded": error_codes.PATIENCE_EXCEEDED,
    "ControllerTimedOut": error_codes.CONTROLLER_TIMED_OUT,
    "InvalidController": 102,
    "InvalidPath": error_codes.INVALID_PATH,
}
"""Error codes of the exceptions that controllers threw; that of all others is 101."""


class ThrownAbort(ControllerAbort):
    """An exception that ends the action."""

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.code = CODES.get(name, error_codes.CONTROLLER_UNKNOWN)


class ScriptedFollower:
    """Answers as recorded; it takes its time, in which the robot moves on.

    Args:
        case: The recorded run.
        robot: The robot.

    Attributes:
        calls: Time, number of the path, pose and velocity of every call.
        computing_time: How long the last answer took, s.
    """

    def __init__(self, case: Record, robot: ReplayedRobot) -> None:
        self._segments, self._robot = case["segments"], robot
        self._paths = -1
        self.calls: list[tuple[float, ...]] = []
        self.computing_time = 0.0

    def reset(self, setup: FollowerSetup) -> None:
        """Do nothing."""

    def set_plan(self, path: NDArray[np.float64]) -> None:
        """Count the paths."""
        self._paths += 1

    def move_plan(self, path: NDArray[np.float64]) -> None:
        """Do nothing: there is one frame."""

    def compute_velocity_commands(self, pose: Pose, velocity: Twist, costmap: Costmap, now: float) -> Twist:
        """Answer as the recorded controller did at that time."""
        self.calls.append((now, self._paths, *pose, *velocity))
        _, what, v, w, milliseconds = next(s for s in reversed(self._segments) if s[0] <= now + TIME_RESOLUTION)
        self.computing_time = milliseconds / 1000.0
        self._robot.move_until(now + self.computing_time)
        if what == VALID:
            return Twist(v, w)
        raise ControllerError(what) if what in NO_COMMAND else ThrownAbort(what)


class ScriptedCostmap:
    """A costmap that is not current at the recorded times."""

    next_update = 0.0

    def __init__(self, case: Record) -> None:
        self._stale = case.get("notcurrent", [])
        self.costmap = Costmap(np.zeros((1, 1), np.uint8), 1.0, 0.0, 0.0)

    def is_current(self, now: float) -> bool:
        """Whether the costmap is current at ``now``, s."""
        return not is_within(self._stale, now)


def controller_server_measures(oracle: AroundOracle) -> list[Measure]:
    """Share of runs of the controller server with the recorded result, code, times, commands and calls."""
    cases = Cases("controller_server_identical", ">= 1")
    for release in oracle.releases:
        for case in oracle.controller_server(release):
            cases.add(float(not is_identical(case, release)), f"{release} {case['id']}")
    return [cases.agreement()]


def is_identical(case: Record, release: Release) -> bool:
    """Whether our server does in one case what the recorded one did."""
    handle, robot, follower = replay(case, release)
    return (
        same_end(case, handle, release)
        and same_commands(robot.commands, case["cmds"], SAME_TIME)
        and same_calls(follower.calls, case["calls"])
    )


def same_end(case: Record, handle: GoalHandle, release: Release) -> bool:
    """Whether the action ended as recorded: result, time and, in Jazzy, error code."""
    if case["result"] == "limit":
        return bool(abs(handle.ended - case["limit"]) <= SAME_TIME)
    assert handle.outcome is not None
    code = handle.outcome.code if release == "jazzy" else case["error_code"]
    same = str(handle.outcome.result) == case["result"] and code == case["error_code"]
    return bool(same) and abs(handle.ended - case["end_time"]) <= SAME_TIME


def same_calls(ours: list[tuple[float, ...]], recorded: list[list[float]]) -> bool:
    """Whether the controller was called at the same times with the same arguments."""
    if len(ours) != len(recorded):
        return False
    difference = np.abs(np.array(ours).reshape(-1, 7) - np.array(recorded, dtype=float).reshape(-1, 7))
    return bool((difference <= (SAME_TIME, 0, *[SAME_PLACE] * 5)).all())


def replay(case: Record, release: Release) -> tuple[GoalHandle, ReplayedRobot, ScriptedFollower]:
    """Run one case on the recorded plant."""
    x, y, yaw, v, w = case["start"]
    plant = RecordedPlant(Pose(x, y, yaw), Twist(v, w), lambda now: is_stuck(case, now))
    robot = ReplayedRobot(plant, lambda now: not is_within(case.get("nopose", []), now))
    follower = ScriptedFollower(case, robot)
    executor = ControllerServer(
        follower,
        server_params(case),
        robot,
        ScriptedCostmap(case),
        robot.publish,
        release=release,
        computing_time=lambda: follower.computing_time,
    )
    server = ActionServer(executor, AT_ONCE)
    handle = drive(case, server, robot)
    return handle, robot, follower


def drive(case: Record, server: ActionServer, robot: ReplayedRobot) -> GoalHandle:
    """Send the paths at their times, and run the server to its end; returns the newest goal."""
    paths = [(time, np.array(path, dtype=float).reshape(-1, 3)) for time, path in case["paths"]]
    handle = server.send(paths.pop(0)[1], -AT_ONCE.message)
    cancel = min(case.get("cancel", NEVER), case["limit"])
    while handle.outcome is None:
        now = max(robot.now, min(server.next_time, cancel, paths[0][0] if paths else NEVER))
        robot.move_until(now)
        while paths and paths[0][0] <= now + TIME_RESOLUTION:
            handle = server.send(paths.pop(0)[1], now - EARLY)
        if cancel <= now + TIME_RESOLUTION:
            server.request_cancel(handle, now - EARLY)
            cancel = NEVER
        server.advance(now)
    return handle


def server_params(case: Record) -> ControllerServerParams:
    """Return the parameters of one case; what it does not say is Nav2's default."""
    given: dict[str, Any] = {
        "failure_tolerance": case["failure_tolerance"],
        "min_x_velocity_threshold": 0.001,
        "min_theta_velocity_threshold": 0.001,
        "progress_checker": {"plugin": case["progress"]},
        "goal_checker": {"plugin": case["goal"]},
    }
    return ControllerServerParams(**overlay(given, nest_dotted(case["params"])))


def is_stuck(case: Record, now: float) -> bool:
    """Whether the robot keeps its pose in the step that ends at ``now``, s."""
    if "stuck" not in case:
        return False
    first, last = case["stuck"]
    return is_within([[first, np.inf if last < 0 else last]], now)


def is_within(spans: list[list[float]], now: float) -> bool:
    """Whether ``now`` is within one of the spans of time, their ends excluded."""
    return any(first <= now + TIME_RESOLUTION and now < last - TIME_RESOLUTION for first, last in spans)
