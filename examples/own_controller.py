"""Write a controller of your own, and compare it with Nav2's.

Shows: a path follower in 30 lines; Nav2's planner, checkers and recoveries around it; a benchmark against Regulated
Pure Pursuit and DWB with noise, and what its result holds.
Takes: half a minute on two cores; the first time on a machine about a minute more, for compiling.
Comes out: a table, and a sentence for each controller with 95 % intervals.

The command does the same in this folder: `mapbench bench hall.yaml office.yaml --controllers
rpp,dwb,mine=own_controller:careful --params fair --noise nominal --repeats 5 --time-limit 120 --contact slides`.
"""

import os
from pathlib import Path

import numpy as np

from controllers.base import ControllerError, Twist
from controllers.navigator.navigator import Navigator
from evolution import bench
from evolution.report import verdict_of_benchmark

SMALL = bool(os.environ.get("MAPBENCH_SMALL"))  # the tests run a small form
REPEATS = 1 if SMALL else 5
MAPS = [Path(__file__).parent / name for name in ("hall.yaml", "office.yaml")]


class Careful:
    """Pure pursuit that slows down where the costmap says that walls are near; `nav2_core::Controller` in Nav2."""

    def __init__(self, speed, lookahead):
        self.speed, self.lookahead = speed, lookahead

    def reset(self, setup):
        self.tolerance = setup.xy_goal_tolerance

    def set_plan(self, path):
        self.path, self.passed = path, 0

    def move_plan(self, path):  # the same plan, where the odom frame has it now
        self.path = path

    def compute_velocity_commands(self, pose, velocity, costmap, now):
        offsets = self.path[self.passed :, :2] - (pose.x, pose.y)
        nearest = int(np.hypot(*offsets.T).argmin())
        self.passed += nearest
        ahead = offsets[nearest:]
        far = np.hypot(*ahead.T) >= self.lookahead
        dx, dy = ahead[far.argmax() if far.any() else -1]
        if np.hypot(*offsets[-1]) < self.tolerance:
            dx, dy = np.cos(self.path[-1, 2]), np.sin(self.path[-1, 2])  # turn to the goal's heading on the spot
        bearing = (np.arctan2(dy, dx) - pose.yaw + np.pi) % (2 * np.pi) - np.pi
        if np.hypot(*offsets[-1]) < self.tolerance or abs(bearing) > 0.8:
            return Twist(0.0, 1.0 * np.sign(bearing))
        cost = costmap.costs[costmap.world_to_map(pose.x, pose.y)]
        if cost >= 253:  # the robot's outline touches something: Nav2 plans again, then recovers
            raise ControllerError("no room")
        speed = self.speed * (1.0 - 0.7 * cost / 252)
        return Twist(speed, 2.0 * speed * np.sin(bearing) / np.hypot(dx, dy))


def careful(navigation, speed=0.45, lookahead=0.6):
    """Make the controller; `navigation` holds all other parameters of Nav2."""
    return Navigator(Careful(speed, lookahead), navigation, "mine")


if __name__ == "__main__":  # worker processes import this file, which must not begin a benchmark of their own
    result = bench(
        MAPS,
        ["rpp", "dwb", "mine=own_controller:careful"],
        params="fair",
        noise="nominal",
        repeats=REPEATS,
        time_limit=120.0,
        collision_ends_episode=False,
    )
    print(result.table())
    for line in [*verdict_of_benchmark(result.rows, ["rpp", "dwb", "mine"]), *result.failures]:
        print(line)
