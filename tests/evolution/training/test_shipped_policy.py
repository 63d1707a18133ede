"""The policy that comes as an example: that it loads, and that it drives."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from controllers.learned import read_card
from evolution import bench
from gym_mapbench.config import EnvConfig
from gym_mapbench.scenario_source import draw_scenario

POLICY = Path(__file__).resolve().parents[3] / "examples" / "policies" / "ppo.zip"
MAPS = 8


def test_it_is_small_and_says_what_it_was_trained_for():
    assert POLICY.stat().st_size < 1_000_000
    card = read_card(POLICY)
    assert (card.algorithm, card.world.robot.name, card.world.control_hz) == ("ppo", "turtlebot3_waffle", 5.0)
    assert card.encoding.keys == ("goal", "velocity", "scan")
    assert card.world.lidar.beams <= 64
    assert {"steps", "seed", "success"} <= set(card.training)


def test_it_reaches_the_goal_on_nearly_all_fresh_maps_at_the_robot_s_speed():
    pytest.importorskip("stable_baselines3")
    world = EnvConfig(shapes={"n_obstacles": (15, 15)})
    rng = np.random.default_rng(20_261_122)
    maps = [draw_scenario(world, rng) for _ in range(MAPS)]
    runs = bench(maps, [f"policy={POLICY}"], time_limit=60.0, workers=1).table("runs")
    reached = [run for run in runs if run["outcome"] == "goal"]
    assert len(reached) >= MAPS - 2
    # The straight way is 9 m long, and the robot drives 0.5 m/s.
    assert np.median([run["time_s"] for run in reached]) < 30.0
