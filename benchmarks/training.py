"""What an env step costs in training: ours, alone and many together, beside LunarLander and ir-sim in the same run.

CPU time of one process with random actions, resets included. The envs take turns, so that all see the same machine.
Gymnasium's LunarLander needs ``pip install gymnasium[box2d]`` or pygame, ir-sim ``pip install ir-sim``; what is not
installed is left out, and the table says so.
"""

from __future__ import annotations

import argparse
import importlib.util
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import yaml
from gymnasium.vector import SyncVectorEnv
from PIL import Image

import gym_mapbench  # noqa: F401, registers the env
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.env.scenario_source import draw_scenario
from gym_mapbench.env.single import MapBenchEnv

BEAMS = 64
RANGE_MAX = 3.5
OPTIONS: dict[str, Any] = {
    "observation": ("goal", "velocity", "scan"),
    "lidar": {"beams": BEAMS, "range_max": RANGE_MAX},
    "action": "normalized",
}
Run = Callable[[int], None]


def single(env: gymnasium.Env[Any, Any]) -> Run:
    """Steps of one env, which is reset when an episode ends."""
    env.reset(seed=0)
    env.action_space.seed(0)
    actions = [env.action_space.sample() for _ in range(256)]

    def run(steps: int) -> None:
        for count in range(steps):
            *_, terminated, truncated, _ = env.step(actions[count % len(actions)])
            if terminated or truncated:
                env.reset()

    return run


def together(envs: gymnasium.vector.VectorEnv[Any, Any, Any]) -> Run:
    """Steps of a vector env, counted world by world."""
    envs.reset(seed=0)
    envs.action_space.seed(0)
    actions = [envs.action_space.sample() for _ in range(64)]

    def run(steps: int) -> None:
        for count in range(max(1, steps // envs.num_envs)):
            envs.step(actions[count % len(actions)])

    return run


def irsim(folder: Path) -> Run:
    """Steps of ir-sim with the same robot, lidar and kind of map; it is put back when it has hit something."""
    import irsim as package

    env = package.make(irsim_world(folder), headless=True, disable_all_plot=True, log_level="ERROR")
    rng = np.random.default_rng(0)

    def run(steps: int) -> None:
        for _ in range(steps):
            env.step(rng.uniform([-0.35, -1.9], [0.5, 1.9]).reshape(2, 1))
            env.get_lidar_scan()
            if env.done():
                env.reset()

    return run


def irsim_world(folder: Path) -> str:
    """Write a random map and ir-sim's description of a world with it; return the file's name."""
    config = EnvConfig()
    scenario = draw_scenario(config, np.random.default_rng(0))
    picture = np.where(scenario.map.to_image_array(), 0, 255).astype(np.uint8)
    Image.fromarray(picture).save(folder / "map.png")
    rows, cols = scenario.map.shape
    lidar = {"name": "lidar2d", "range_max": RANGE_MAX, "angle_range": 2 * np.pi, "number": BEAMS}
    robot = {
        "kinematics": {"name": "diff"},
        "shape": {"name": "circle", "radius": config.robot.radius},
        "state": list(scenario.start),
        "goal": list(scenario.goal),
        "sensors": [lidar],
    }
    world = {
        "width": cols * scenario.map.resolution,
        "height": rows * scenario.map.resolution,
        "step_time": 1.0 / config.control_hz,
        "collision_mode": "stop",
        "obstacle_map": str(folder / "map.png"),
    }
    (folder / "world.yaml").write_text(yaml.safe_dump({"world": world, "robot": [robot]}), encoding="utf-8")
    return str(folder / "world.yaml")


def runs(num_envs: int, folder: Path) -> dict[str, tuple[Run, int]]:
    """What is timed: by name, how to run it, and for how many steps a turn."""
    options = {**OPTIONS, "disable_env_checker": True}
    timed = {
        f"make_vec, {num_envs} worlds": (together(gymnasium.make_vec("MapBench-v0", num_envs, **OPTIONS)), 40_000),
        "make, one world": (single(gymnasium.make("MapBench-v0", **options)), 5_000),
        f"SyncVectorEnv of {num_envs}": (together(SyncVectorEnv([lambda: MapBenchEnv(**OPTIONS)] * num_envs)), 6_000),
    }
    if importlib.util.find_spec("pygame"):
        timed["LunarLander-v3"] = (single(gymnasium.make("LunarLander-v3", disable_env_checker=True)), 5_000)
    else:
        print("LunarLander-v3 is left out: pip install pygame")
    if importlib.util.find_spec("irsim"):
        timed["ir-sim"] = (irsim(folder), 60)
    else:
        print("ir-sim is left out: pip install ir-sim")
    return timed


def draws_a_second(draws: int = 300) -> float:
    """Random maps drawn a second, each with its distances to the goal and known to be solvable."""
    config, rng = EnvConfig(), np.random.default_rng(0)
    draw_scenario(config, rng)
    began = time.process_time()
    for _ in range(draws):
        draw_scenario(config, rng)
    return draws / (time.process_time() - began)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--envs", type=int, default=64, help="worlds stepped together")
    parser.add_argument("--turns", type=int, default=7, help="turns of every env; the best one counts")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        timed = runs(args.envs, Path(folder))
        best = dict.fromkeys(timed, np.inf)
        draws = 0.0
        for run, steps in timed.values():
            run(max(1, steps // 10))
        for _ in range(args.turns):
            draws = max(draws, draws_a_second())
            for name, (run, steps) in timed.items():
                began = time.process_time()
                run(steps)
                best[name] = min(best[name], (time.process_time() - began) / steps)
    print(f"{'env':28s} {'us a step':>10s}")
    for name, seconds in best.items():
        print(f"{name:28s} {1e6 * seconds:10.1f}")
    print(f"random maps drawn and prepared a second: {draws:.0f}")


if __name__ == "__main__":
    main()
