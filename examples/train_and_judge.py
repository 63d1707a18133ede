"""Train a policy and judge it on maps that it has never seen, beside one of Nav2's controllers.

Shows: `train`, the learning curve it keeps, and `bench` with a learned policy; `pip install "gym-mapbench[rl]"` first.
Takes: about ten minutes on two cores. That is a beginning, not a good policy: see `mapbench train --help`.
Comes out: `runs/train_and_judge` with the model, its curve and figure, success on held-out maps with 95 % intervals.
"""

import os

import numpy as np

from evolution import bench, train
from evolution.report import verdict_of_benchmark
from gym_mapbench import EnvConfig
from gym_mapbench.env.scenario_source import draw_scenario

SMALL = bool(os.environ.get("MAPBENCH_SMALL"))  # the tests run a small form
STEPS, MAPS, TIME_LIMIT = (256, 2, 20.0) if SMALL else (400_000, 40, 100.0)
OBSTACLES = (5, 10)
# What is not said here, the package says for PPO
SETTINGS = {
    "obstacles": [{"after": 0.0, "fewest": 0, "most": 10}],
    "evaluation": {"every": STEPS // 4, "maps": MAPS, "obstacles": [10], "time_limit": TIME_LIMIT},
    **({"envs": 4, "hyperparameters": {"batch_size": 128}} if SMALL else {}),
}

training = train("ppo", config=SETTINGS, steps=STEPS, seed=1, out="runs/train_and_judge")
print(training.table())

# The evaluations above chose the best model, so they flatter it. These maps chose nothing.
world, rng = EnvConfig(shapes={"n_obstacles": OBSTACLES}), np.random.default_rng(2026)
fresh = [draw_scenario(world, rng) for _ in range(MAPS)]
result = bench(fresh, [f"learned={training.best}", "rpp"], params="fair", time_limit=TIME_LIMIT)
for line in verdict_of_benchmark(result.rows, ["learned", "rpp"]):
    print(line)
