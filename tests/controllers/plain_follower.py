"""A follower, a robot and a map so simple that what the navigator does stands out."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from controllers.base import STOP, Context, LocalPlan, Twist
from controllers.nav2_params import NavigationParams, load_preset
from controllers.navigator.navigator import Navigator
from gym_mapbench.costmap import CostmapParams
from gym_mapbench.world.frames import IDENTITY, compose
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.robot import make_robot
from gym_mapbench.world.scenario import Pose, wrap_angle

PERIOD = 0.05
START, GOAL = Pose(1.0, 1.0, 0.0), Pose(4.0, 1.0, 0.0)
ROWS = ("#" * 100, *["#" + "." * 98 + "#"] * 58, "#" * 100)
OPEN = GridMap.from_rows(ROWS, 0.05)


def local_plan(path) -> LocalPlan:
    """All of a path as Lyrical's local plan."""
    path = np.asarray(path, dtype=float)
    length = float(np.hypot(*np.diff(path[:, :2], axis=0).T).sum())
    return LocalPlan(path, length, Pose(*path[-1].tolist()))


def walled_off() -> GridMap:
    """The open map with a wall across it: nothing leads to the goal, nor to within a metre of it."""
    occupancy = OPEN.occupancy.copy()
    occupancy[:, 50:54] = True
    return GridMap(occupancy, 0.05)


class PlainFollower:
    """Drives at the point 0.4 m ahead on the path; ``answer`` may raise, or return another command."""

    def __init__(self, answer: Callable[[float], Twist | None] = lambda now: None) -> None:
        self.answer = answer
        self.log: list[tuple] = []

    def reset(self, setup) -> None:
        self.setup = setup
        self.log = []

    def set_plan(self, path) -> None:
        self.path = path
        self.log.append(("set_plan", len(path)))

    def move_plan(self, path) -> None:
        self.path = path
        self.log.append(("move_plan", len(path)))

    def compute_velocity_commands(self, pose, velocity, costmap, now) -> Twist:
        self.log.append(("compute", now, pose, velocity))
        self.costmap = costmap
        given = self.answer(now)
        if given is not None:
            return given
        distance = np.hypot(self.path[:, 0] - pose.x, self.path[:, 1] - pose.y)
        ahead = self.path[min(int(distance.argmin()) + 16, len(distance) - 1)]
        bearing = math.atan2(ahead[1] - pose.y, ahead[0] - pose.x)
        return Twist(0.4, 2.0 * wrap_angle(bearing - pose.yaw))

    def calls(self, kind: str) -> list[tuple]:
        return [entry for entry in self.log if entry[0] == kind]


def plain_navigation(recoveries: bool = False, **changes) -> NavigationParams:
    """The thesis' parameters, or Jazzy's, on the whole known map; without recoveries and without a smoother."""
    release = changes.get("release", "humble")
    preset = load_preset("thesis" if release == "humble" else release)
    plugins = ("static_layer", "inflation_layer")
    known = {
        "velocity_smoother": None,
        "local_costmap": CostmapParams.example_local(rolling_window=False, plugins=plugins, release=release),
        "global_costmap": CostmapParams.example_global(plugins=plugins, release=release),
    }
    changes = {**known, "bt": preset.bt.replace(recoveries=recoveries), **changes}
    return preset.replace(**changes)


def context(grid: GridMap = OPEN, start: Pose = START, goal: Pose = GOAL) -> Context:
    return Context(make_robot("turtlebot3_waffle"), grid, start, goal, PERIOD, np.random.default_rng(0))


class Drive:
    """A robot without inertia under a navigator, until the run is over; it always knows where it is."""

    def __init__(
        self, navigator: Navigator, start: Pose = START, velocity: Twist = STOP, map_in_odom: Pose = IDENTITY
    ) -> None:
        self.navigator = navigator
        self.map_in_odom = map_in_odom
        self.pose, self.velocity = start, velocity
        self.commands: list[Twist] = []

    def step(self) -> Twist:
        odom = compose(self.map_in_odom, self.pose)
        poses = {"pose": np.array(self.pose), "odom": np.array(odom)}
        command = self.navigator.act({**poses, "velocity": np.array(self.velocity)})
        self.commands.append(command)
        x, y, yaw = self.pose
        v, w = command
        self.pose = Pose(x + v * math.cos(yaw) * PERIOD, y + v * math.sin(yaw) * PERIOD, wrap_angle(yaw + w * PERIOD))
        self.velocity = command
        return command

    def run(self, steps: int = 4000) -> Drive:
        while self.navigator.status == "running" and len(self.commands) < steps:
            self.step()
        return self

    @property
    def time(self) -> float:
        """Time of the last tick, s."""
        return (len(self.commands) - 1) * PERIOD
