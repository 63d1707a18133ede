"""Tune a controller on random maps of 30 obstacles, and print its cost in time and its result on test maps."""

from __future__ import annotations

import argparse
import os
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from evolution import bench, tune
from gym_mapbench import EnvConfig
from gym_mapbench.env.scenario_source import draw_scenarios
from gym_mapbench.world.scenario import Scenario

OBSTACLES = 30
WORLD = {"noise": "nominal", "time_limit": 120.0}


def main() -> None:
    """Tune and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("controller", help="dwb, mppi, rpp or graceful")
    parser.add_argument("--trials", type=int, default=100)
    parser.add_argument("--runs", type=int, help="budget of the search, for a control with --sampler random")
    parser.add_argument("--sampler", choices=("tpe", "random"), default="tpe")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--maps", type=int, default=24, help="training maps (default 24)")
    parser.add_argument("--test-maps", type=int, default=60)
    parser.add_argument("--workers", type=int, default=len(os.sched_getaffinity(0)))
    args = parser.parse_args()
    train, test = maps(args.maps, 11), maps(args.test_maps, 12)
    began = time.perf_counter()
    bench(train, args.controller, params="fair", workers=args.workers, **WORLD)
    per_run = (time.perf_counter() - began) / len(train)
    began = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        result = tune(
            args.controller,
            train,
            test,
            params="fair",
            out=Path(folder) / "tuning",
            workers=args.workers,
            **{name: getattr(args, name) for name in ("trials", "runs", "sampler", "seed")},
            **WORLD,
        )
    seconds, runs = time.perf_counter() - began, sum(result.summary.runs.values())
    print(f"tuning              {seconds:.0f} s, {runs} runs {result.summary.runs}")
    print(f"runs per second     {runs / seconds:.2f}")
    print(f"cost of a run       {seconds / runs / per_run:.2f} of its cost in bench")
    print("\n".join(result.verdict))


def maps(count: int, seed: int) -> Sequence[Scenario]:
    """Return the maps that ``benchmarks/fresh_maps.py --obstacles 30 --seed SEED`` draws."""
    world = EnvConfig(shapes={"n_obstacles": (OBSTACLES, OBSTACLES)})
    return draw_scenarios(world, np.random.default_rng((seed, OBSTACLES)), count)


if __name__ == "__main__":
    main()
