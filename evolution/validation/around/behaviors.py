"""Behaviours: ours are run on the recorded plant, and their commands compared with the recorded ones."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from controllers.base import STOP, Twist
from controllers.behaviors import BehaviorServer as BehaviorServerParams
from controllers.behaviors import DriveLimits
from controllers.navigator.actions import ActionServer, GoalHandle
from controllers.navigator.behavior_server import BehaviorServer
from controllers.navigator.behaviors import BackUp, Behavior, DriveOnHeading, Spin, Wait
from controllers.navigator.latency import Latency
from controllers.navigator.rate import TIME_RESOLUTION
from evolution.validation.around.plant import STEP, RecordedPlant
from evolution.validation.around.recordings import AroundOracle, Record
from evolution.validation.around.robot import Command, ReplayedRobot
from evolution.validation.measures import Cases, Measure
from gym_mapbench.costmap import Costmap
from gym_mapbench.ros_params import nest_dotted
from gym_mapbench.world.footprint import Footprint
from gym_mapbench.world.scenario import Pose

SIDE, RESOLUTION = 100, 0.05
LONGEST = 60.0
AT_ONCE, EARLY = Latency(message=1e-7), 2e-7
"""Messages that take next to no time, though the server waits for its next cycle; and how much earlier a message is
sent that has to count for the cycle of its time, s."""
SAME_TIME, SAME_SPEED = 1e-6, 2e-8
"""Differences that the rounding of the recordings explains, s and m/s or rad/s."""


def behavior_measures(oracle: AroundOracle) -> list[Measure]:
    """Share of runs of a behaviour with the recorded result, times and commands."""
    cases = Cases("behavior_commands_identical", ">= 1")
    for case in oracle.behaviors:
        cases.add(float(not is_identical(case, replay(oracle, case, None))), str(case["id"]))
    for case in oracle.disturbed_behaviors:
        cases.add(float(not is_identical(case, replay(oracle, case, case))), f"with smoother {case['id']}")
    return [cases.agreement()]


def is_identical(case: Record, replayed: tuple[GoalHandle, list[Command]]) -> bool:
    """Whether result, end and all commands are the recorded ones."""
    handle, commands = replayed
    result = None if handle.outcome is None else str(handle.outcome.result)
    if result != case["result"] or abs(handle.ended - case["end_time"]) > SAME_TIME:
        return False
    return same_commands(commands, case["cmds"])


def same_commands(ours: list[Command], recorded: list[list[float]], same_time: float = SAME_TIME) -> bool:
    """Whether commands and their times are the recorded ones, but for the rounding of the recording."""
    if len(ours) != len(recorded):
        return False
    difference = np.abs(np.array(ours).reshape(-1, 3) - np.array(recorded, dtype=float).reshape(-1, 3))
    return bool((difference <= (same_time, SAME_SPEED, SAME_SPEED)).all())


def replay(oracle: AroundOracle, case: Record, zeros: Record | None) -> tuple[GoalHandle, list[Command]]:
    """Run one behaviour; ``zeros`` says when something else commands the robot to stop."""
    given = nest_dotted(case.get("params", {}))
    limits = DriveLimits(**given.pop("drive_on_heading", {}))
    params = BehaviorServerParams(**given)
    start = case.get("start") or [case["x"], case["y"], case["yaw"]]
    stuck = case.get("stuck", np.inf)
    velocity = Twist(case.get("v", 0.0), case.get("w", 0.0))
    plant = RecordedPlant(Pose(*start), velocity, lambda now: now >= stuck - TIME_RESOLUTION)
    robot, costmap = ReplayedRobot(plant), costmap_of(case.get("obstacles", []))
    footprint = Footprint.from_corners(np.array(oracle.footprints[case["footprint"]]), 0.0)
    server = ActionServer(BehaviorServer(params, footprint, robot, lambda: costmap, robot.publish), AT_ONCE)
    handle = server.send(behavior_of(case, params, limits), -AT_ONCE.message)
    for step in range(round(LONGEST / STEP)):
        now = step * STEP
        robot.move_until(now)
        if abs(case.get("cancel", np.inf) - now) < STEP / 2:
            server.request_cancel(handle, now - EARLY)
        server.advance(now)
        if handle.outcome is not None:
            break
        if zeros is not None and is_disturbed(zeros, now):
            plant.command = STOP
    return handle, robot.commands


def is_disturbed(zeros: Record, now: float) -> bool:
    """Whether something else commands the robot to stop before the step of the plant that begins at ``now``, s."""
    first, last, period = zeros["first_zero_s"], zeros["zeros_until_s"], zeros["zero_period_s"]
    if first is None:
        return False
    zero = first + period * max(0, math.ceil((now - first - TIME_RESOLUTION) / period))
    return bool(zero <= last + TIME_RESOLUTION and zero < now + STEP - TIME_RESOLUTION)


def behavior_of(case: Record, params: BehaviorServerParams, limits: DriveLimits) -> Behavior:
    """Make the recorded behaviour."""
    target, speed, allowance = case["target"], case["speed"], case.get("time_allowance", 10.0)
    makers: dict[str, Any] = {
        "spin": lambda: Spin(target, params, allowance),
        "backup": lambda: BackUp(target, speed, params, allowance),
        "drive_on_heading": lambda: DriveOnHeading(target, speed, params, allowance, limits),
        "wait": lambda: Wait(target),
    }
    behavior: Behavior = makers[case["kind"]]()
    return behavior


def costmap_of(obstacles: list[list[int]]) -> Costmap:
    """Return the recorded costmap: free but for blocks ``[col0, row0, col1, row1, cost]``, both ends included."""
    costs = np.zeros((SIDE, SIDE), np.uint8)
    for col0, row0, col1, row1, cost in obstacles:
        costs[row0 : row1 + 1, col0 : col1 + 1] = cost
    return Costmap(costs, RESOLUTION, 0.0, 0.0)
