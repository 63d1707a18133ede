"""Where policies search: a wall across the map, its gap near the point that is nearest to the goal, or far from it.

``python benchmarks/gap_in_a_wall.py [--controllers A B ...] [--seeds R] [--workers W] [--plot FILE]`` prints the median
times of the shipped policies and of Nav2's controllers by the distance of the gap from that point, then by the width of
the gap. ``straight`` is ``ppo_path.zip`` that observes a straight line to the goal in place of the planned path.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from mechanisms import ROOT_SEED, WAFFLE, draw_runs, settings_of, times
from run_tables import of

from controllers.base import Context, Controller, Observation
from controllers.registry import make_controller
from evolution import bench
from evolution.driving import ControllerSpec
from evolution.pictures import new_figure
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.scenario import Pose, Scenario

PPO, PPO_PATH = "examples/policies/ppo.zip", "examples/policies/ppo_path.zip"
CONTROLLERS = (f"ppo={PPO}", f"ppo_path={PPO_PATH}", "straight=gap_in_a_wall:straight", "dwb", "mppi", "rpp")
SIDE, RESOLUTION, THICKNESS = 7.5, 0.05, 0.2
START, GOAL = Pose(6.9, 0.6, 2.356), Pose(0.6, 6.9, 2.356)
DISTANCES = (0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0)
USUAL_WIDTH = 0.95
FAR = 3.0
WIDTHS = (0.75, 0.95, 1.25, 1.5, 2.0)
SHOWN_DISTANCES = (1.0, FAR, 5.0)


class StraightPath:
    """``ppo_path.zip`` whose observed path is the straight line to the goal."""

    name = "straight"

    def __init__(self) -> None:
        self._policy: Any = make_controller(PPO_PATH)
        self.observation_keys = self._policy.observation_keys

    def fit(self, config: EnvConfig) -> EnvConfig:
        """Return the world that the policy was trained for, and note its window of the path."""
        fitted: EnvConfig = self._policy.fit(config)
        self._window = fitted.path
        return fitted

    def reset(self, context: Context) -> None:
        """Begin an episode."""
        self._policy.reset(context)

    def act(self, observation: Observation) -> tuple[float, float]:
        """Return the policy's command, ``(v m/s, omega rad/s)``, on a straight path."""
        x, y, _ = observation["goal"]
        distance = math.hypot(x, y)
        along = np.minimum(np.arange(self._window.points) * self._window.spacing, distance) / distance
        command: tuple[float, float] = self._policy.act(
            {**observation, "path": np.outer(along, (x, y)).astype(np.float32).ravel()}
        )
        return command


def straight() -> Controller:
    """Make the policy with a straight path."""
    return StraightPath()


def build(distance: float, width: float = USUAL_WIDTH) -> Scenario:
    """Return a wall half-way, whose gap is so far from the point of the wall that is nearest to the goal, m."""
    cells = round(SIDE / RESOLUTION)
    walls = np.zeros((cells, cells), dtype=bool)
    walls[[0, -1]] = walls[:, [0, -1]] = True
    half = round(THICKNESS / RESOLUTION / 2)
    first = round((GOAL.x + distance - width / 2) / RESOLUTION)
    wall = slice(cells // 2 - half, cells // 2 + half)
    walls[wall] = True
    walls[wall, first : first + round(width / RESOLUTION)] = False
    return Scenario(GridMap(walls, RESOLUTION), START, GOAL, f"gap_{distance:g}_{width:g}")


def print_times(head: str, maps: dict[float, Scenario], controllers: Sequence[str], options: dict[str, Any]) -> None:
    """Print a line for each map, with a column for each controller."""
    names = [text.partition("=")[0] for text in controllers]
    print(f"| {head} | " + " | ".join(f"{name}, s" for name in names) + " |\n|---" + "|---" * len(names) + "|")
    for value, scenario in maps.items():
        rows = bench([scenario], list(controllers), **options).rows
        print(f"| {value:g} | " + " | ".join(times(of(rows, controller=name)) for name in names) + " |", flush=True)


def plot(file: str) -> None:
    """Draw gaps near the point that is nearest to the goal and far from it, with runs of both policies and of MPPI."""
    specs = (
        ControllerSpec(name="ppo", kind=PPO),
        ControllerSpec(name="ppo_path", kind=PPO_PATH),
        ControllerSpec(name="mppi"),
    )
    figure, places = new_figure(len(SHOWN_DISTANCES), width=12.0, height=4.6)
    for axes, distance in zip(places, SHOWN_DISTANCES, strict=True):
        draw_runs(axes, build(distance), specs)
    figure.savefig(file, dpi=90)


def main() -> None:
    """Print both tables, and draw them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--controllers", nargs="+", default=CONTROLLERS)
    parser.add_argument("--seeds", type=int, default=16)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--plot", help="file of the picture")
    args = parser.parse_args()
    options = {
        "settings": settings_of(WAFFLE, "fair"),
        "seed": ROOT_SEED,
        "repeats": args.seeds,
        "workers": args.workers,
    }
    print_times("distance, m", {one: build(one) for one in DISTANCES}, args.controllers, options)
    print_times("width, m", {one: build(FAR, one) for one in WIDTHS}, args.controllers, options)
    if args.plot:
        plot(args.plot)


if __name__ == "__main__":
    main()
