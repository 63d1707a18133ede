"""Time the main parts of the simulation and print medians with their ratio to a calibration loop of the same run.

With ``--against DIR``, another checkout of this project, both are timed in turns, and the ratio of medians is printed.
"""

from __future__ import annotations

import argparse
import itertools
import json
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from sampled_maps import full_costmap, map_with_path

from controllers.base import ControllerError, FollowerSetup, PathFollower, Twist
from controllers.dwb.controller import DwbFollower
from controllers.dwb.params import DwbParams
from controllers.mppi.controller import MppiFollower
from controllers.mppi.params import MppiParams
from controllers.nav2_params import NavigationParams, load_preset
from controllers.rpp.controller import RppFollower
from controllers.rpp.params import RppParams
from evolution.driving import RunResult, calibration_loop, run_job
from evolution.search import experiment_of
from evolution.search import load_preset as load_search
from evolution.search.sections import ValidationSettings
from evolution.search.validation_stage.selection import select
from gym_mapbench.costmap import Costmap, LaserScan, LayeredCostmap
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.env.single import MapBenchEnv
from gym_mapbench.generator import FamilySpec, ShapeSettings, draw_from
from gym_mapbench.planners import make_planner
from gym_mapbench.world.footprint import Footprint
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.lidar import Lidar, LidarSettings
from gym_mapbench.world.scenario import Pose, Scenario
from gym_mapbench.world.simulation import Simulation
from gym_mapbench.world.world import World

WINDOW_CELLS = 60
FOLLOWERS = {"MPPI": (MppiFollower, MppiParams), "DWB": (DwbFollower, DwbParams), "RPP": (RppFollower, RppParams)}
TIMED = (("MPPI", "thesis"), ("MPPI", "jazzy"), ("DWB", "thesis"), ("RPP", "thesis"))
"""Controllers, and the preset each takes its parameters from; Nav2's recorded times are Humble's, as in ``thesis``."""


@dataclass(frozen=True)
class Timing:
    """Median seconds of one call and of one iteration of the calibration loop, and Nav2's milliseconds if recorded."""

    name: str
    seconds: float
    calibration: float
    nav2_ms: float | None = None

    def line(self) -> str:
        """One line of the table."""
        nav2 = "" if self.nav2_ms is None else f"{self.nav2_ms:10.3f} {self.nav2_ms / (1e3 * self.seconds):8.1f}x"
        return f"{self.name:44s} {1e3 * self.seconds:10.4f} {self.seconds / self.calibration:12.0f} {nav2}"


def measure(name: str, call: Callable[[], object], calls: int = 200, nav2_ms: float | None = None) -> Timing:
    """Time a call; the calibration loop runs in between, so that both see the same machine."""
    for _ in range(5):
        call()
    seconds, loops = [], []
    for index in range(calls):
        began = time.perf_counter()
        call()
        seconds.append(time.perf_counter() - began)
        if index % 20 == 0:
            loops.append(calibration_loop())
    return Timing(name, statistics.median(seconds), statistics.median(loops), nav2_ms)


def footprint(navigation: NavigationParams) -> Footprint:
    return navigation.local_costmap.make_footprint(EnvConfig().robot)


def window_of(costmap: Costmap, pose: Pose) -> Costmap:
    """A 3 m window of a costmap around a pose."""
    row, col = costmap.world_to_map(pose.x, pose.y) or (0, 0)
    rows, cols = costmap.costs.shape
    row = min(max(row - WINDOW_CELLS // 2, 0), rows - WINDOW_CELLS)
    col = min(max(col - WINDOW_CELLS // 2, 0), cols - WINDOW_CELLS)
    costs = np.ascontiguousarray(costmap.costs[row : row + WINDOW_CELLS, col : col + WINDOW_CELLS])
    return Costmap(costs, costmap.resolution, col * costmap.resolution, row * costmap.resolution)


def follower_timings(scenario: Scenario, nav2: dict[tuple[str, str], float]) -> Iterator[Timing]:
    """Commands of each controller along the path, on the full map and in the 3 m window."""
    navigation = load_preset("thesis")
    full = full_costmap(scenario, navigation)
    path = make_planner("navfn").plan(full, scenario.start, scenario.goal)
    setup = FollowerSetup(footprint(navigation), 0.05, 0.25, 0.25, 0.55, 3.0, np.random.default_rng(0))
    for name, preset in TIMED:
        make, params = FOLLOWERS[name]
        plugin = load_preset(preset).controller(name.lower())
        follower: PathFollower = make(params(**plugin.params))  # type: ignore[operator]
        title = name if preset == "thesis" else f"{name} ({preset})"
        recorded = nav2 if preset == "thesis" else {}
        for kind in ("full", "rolling"):
            calls = commands_along(follower, setup, path, full, rolling=kind == "rolling")
            yield measure(f"{title} command, {kind} costmap", lambda c=calls: next(c), 300, recorded.get((name, kind)))


def commands_along(
    follower: PathFollower, setup: FollowerSetup, path: np.ndarray, full: Costmap, *, rolling: bool
) -> Iterator[Twist | None]:
    """Endless calls at poses along the path, each with the costmap it would have there."""
    poses = [Pose(x, y, np.arctan2(*(path[i + 2, :2] - path[i, :2])[::-1])) for i, (x, y, _) in enumerate(path[:-2])]
    scenes = [(pose, window_of(full, pose) if rolling else full) for pose in poses[::7]]
    follower.reset(setup)
    now = 0.0
    while True:
        follower.set_plan(path)
        for pose, costmap in scenes:
            now += 0.05
            try:
                yield follower.compute_velocity_commands(pose, Twist(0.2, 0.0), costmap, now)
            except ControllerError:
                yield None


def world_timings(scenario: Scenario) -> Iterator[Timing]:
    """Planner, costmap, physics and env."""
    navigation = load_preset("thesis")
    full = full_costmap(scenario, navigation)
    planner = make_planner("navfn")
    yield measure("inflate a 150 x 150 map", lambda: full_costmap(scenario, navigation), 100)
    yield from costmap_timings(scenario)
    yield measure("NavFn plan, 150 x 150", lambda: planner.plan(full, scenario.start, scenario.goal), 100)
    simulation = Simulation(World(scenario.map), EnvConfig().robot, scenario.start)
    yield measure("5 Box2D ticks", lambda: simulation.advance(0.1, 0.3, 5), 1000)
    for beams in (0, 100, 360):
        yield random_steps(scenario, beams)
        yield free_steps(beams)
    env = MapBenchEnv(observation=("pose", "velocity"))
    yield measure("env reset", lambda: env.reset(options={"scenario": scenario}), 100)


def generator_timings() -> Iterator[Timing]:
    """Maps of a motif: built from sampled genes, and sampled until the robot can drive them."""
    families, shapes, rng = [FamilySpec(name="gates")], ShapeSettings(), np.random.default_rng(0)
    family = families[0].make()
    yield measure("build a map of gates", lambda: family.build(family.draw_genes(rng), shapes))
    yield measure("sample a drivable map of gates", lambda: draw_from(rng, families, shapes, EnvConfig().robot))


def costmap_timings(scenario: Scenario) -> Iterator[Timing]:
    """Updates of both costmaps along a drive, each with a new scan of 360 beams."""
    navigation, lidar = load_preset("thesis"), LidarSettings()
    path = make_planner("navfn").plan(full_costmap(scenario, navigation), scenario.start, scenario.goal)
    poses = [Pose(x, y, np.arctan2(*(path[i + 2, :2] - path[i, :2])[::-1])) for i, (x, y, _) in enumerate(path[:-2])]
    noise = np.random.default_rng(0)
    scanner, increment = Lidar(lidar, World(scenario.map)), 2 * np.pi / lidar.beams
    drive = [(pose, scanner.scan(pose) + noise.normal(0, 0.01, lidar.beams).astype(np.float32)) for pose in poses[::4]]
    for name, params in (("local", navigation.local_costmap), ("global", navigation.global_costmap)):
        costmap = LayeredCostmap(params, scenario.map, footprint(navigation))
        seen = itertools.cycle(drive)

        def update(costmap: LayeredCostmap = costmap, seen: Iterator[tuple[Pose, np.ndarray]] = seen) -> None:
            pose, ranges = next(seen)
            costmap.observe(LaserScan(ranges, 0.0, increment, 0.12, lidar.range_max), pose)
            costmap.update(pose)

        yield measure(f"{name} costmap, scan and update", update, 400)


def run_timings(scenario: Scenario) -> Iterator[Timing]:
    """One control step of a whole run with noise: the controllers and the world of the default search."""
    plan = experiment_of(load_search("robust")).plan
    for place, spec in enumerate(plan.controllers):
        job = plan.job(scenario, place, 0)
        steps = run_job(job).time_s * plan.settings.environment.control_hz
        timing = measure(f"control step of a run, {spec.name}", partial(run_job, job), 5)
        yield replace(timing, seconds=timing.seconds / steps)


def selection_timings(candidates: int = 50, repeats: int = 12) -> Iterator[Timing]:
    """The selection of the validation stage among the candidates of a search of 3000 runs, on which one is slow."""
    experiment, rng = experiment_of(load_search("robust")), np.random.default_rng(0)
    counts = {"n_contacts": 0, "n_recoveries": 0}

    def runs(seconds: float, share: float) -> tuple[RunResult, ...]:
        times = seconds * (1.0 + share * rng.normal(size=repeats))
        return tuple(RunResult("goal", float(time_s), 8.0, metrics=counts) for time_s in times)

    maps = {
        f"map_{number}": (runs(20.0, 0.02), runs(20.0 + float(rng.exponential(25.0)), 0.15), runs(21.0, 0.02))
        for number in range(candidates)
    }
    call = partial(select, maps, experiment.fitness, experiment.search.maps_per_set, ValidationSettings())
    yield measure(f"select a set among {candidates} maps", call, 5)


def command_timings() -> Iterator[Timing]:
    """A whole command that drives once: imports, a worker, and one run."""
    office = Path(__file__).parents[1] / "examples" / "office.yaml"
    command = [sys.executable, "-m", "evolution", "bench", str(office), "--controllers", "rpp", "--workers", "1"]
    call = partial(subprocess.run, command, stdout=subprocess.DEVNULL, check=True)
    yield measure("mapbench bench, one run of RPP", call, 5)


def random_steps(scenario: Scenario, beams: int) -> Timing:
    """One env step with random actions, which soon lead to a wall and along it."""
    env = endless(scenario, beams)
    actions = np.random.default_rng(0).uniform([-0.1, -1.0], [0.4, 1.0], (64, 2)).astype(np.float32)
    count, touched = iter(range(10**9)), []

    def step() -> None:
        touched.append(env.step(actions[next(count) % 64])[4]["contact"])

    timing = measure("", step, 2000)
    return replace(timing, name=f"env step, {beams} beams, touching in {100 * statistics.fmean(touched):.0f} %")


def free_steps(beams: int) -> Timing:
    """One env step on a circle that touches nothing."""
    env = endless(Scenario(GridMap(np.zeros((150, 150), np.bool_)), Pose(3.75, 3.75), Pose(7.0, 7.0)), beams)
    action = np.array([0.3, 0.5], np.float32)
    return measure(f"env step, {beams} beams, free", lambda: env.step(action), 2000)


def endless(scenario: Scenario, beams: int) -> MapBenchEnv:
    """Return an env whose episode does not end, after its reset."""
    observed = ("pose", "velocity", "goal", "scan") if beams else ("pose", "velocity", "goal")
    env = MapBenchEnv(
        observation=observed, lidar={"beams": max(beams, 1)}, collision_ends_episode=False, time_limit=1e5
    )
    env.reset(seed=0, options={"scenario": scenario})
    return env


def recorded_nav2(directory: str | None) -> dict[tuple[str, str], float]:
    """Nav2's recorded milliseconds per call by (controller, costmap), from the first preset recorded for each."""
    if directory is None:
        return {}
    entries = json.loads((Path(directory) / "timing.json").read_text(encoding="utf-8"))["entries"]
    found: dict[tuple[str, str], float] = {}
    for entry in entries:
        found.setdefault((entry["what"].split()[0], entry["local_costmap"]), entry["median_ms"])
    return found


def timed_in(checkout: Path) -> dict[str, float]:
    """Run this benchmark in a checkout; return the milliseconds by name, without the share of contacts in a name."""
    script = checkout / "benchmarks" / "speed.py"
    environment = {**os.environ, "PYTHONPATH": str(checkout)}
    command = [sys.executable, str(script)]
    lines = subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout.splitlines()
    return {line[:44].split(", touching")[0].strip(): float(line[44:55]) for line in lines[1:]}


def compare_checkouts(other: Path, rounds: int) -> None:
    """Time both checkouts in turns, and print the medians and their ratio."""
    here = Path(__file__).parents[1]
    runs = [(timed_in(other), timed_in(here)) for _ in range(rounds)]
    print(f"{'what':44s} {'other ms':>10s} {'here ms':>10s} {'here/other':>11s}")
    for name in (name for name in runs[0][1] if name in runs[0][0]):
        before, after = (statistics.median(run[place][name] for run in runs) for place in (0, 1))
        print(f"{name:44s} {before:10.4f} {after:10.4f} {after / before:11.2f}")


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--oracle", metavar="DIR", help="recorded Nav2 results, for their times per call")
    parser.add_argument(
        "--against", type=Path, metavar="DIR", help="another checkout, to be timed in turns with this one"
    )
    parser.add_argument("--rounds", type=int, default=3, help="runs of each with --against (default 3)")
    args = parser.parse_args()
    if args.against:
        compare_checkouts(args.against.resolve(), args.rounds)
        return
    nav2, scenario = recorded_nav2(args.oracle), map_with_path(load_preset("thesis"))
    print(f"{'what':44s} {'ms':>10s} {'x loop':>12s} {'Nav2 ms':>10s} {'faster':>9s}")
    for timing in (
        *follower_timings(scenario, nav2),
        *world_timings(scenario),
        *generator_timings(),
        *run_timings(scenario),
        *selection_timings(),
        *command_timings(),
    ):
        print(timing.line(), flush=True)


if __name__ == "__main__":
    main()
