"""The policies that come as examples: that they load, and that they drive."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from controllers.learned import read_card
from evolution import bench
from evolution.training import train_settings
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.env.scenario_source import draw_scenario

POLICIES = Path(__file__).resolve().parents[3] / "examples" / "policies"
SEEN = {"ppo": ("goal", "velocity", "scan"), "ppo_path": ("goal", "velocity", "scan", "path")}
MAPS = 8


@pytest.mark.parametrize("name", SEEN)
def test_it_is_small_and_says_what_it_was_trained_for(name):
    policy = POLICIES / f"{name}.zip"
    assert policy.stat().st_size < 1_000_000
    card = read_card(policy)
    assert (card.algorithm, card.world.robot.name, card.world.control_hz) == ("ppo", "turtlebot3_waffle", 5.0)
    assert card.encoding.keys == SEEN[name]
    assert card.world.lidar.beams <= 64
    assert {"steps", "seed", "success"} <= set(card.training)


def test_the_one_with_a_path_was_trained_with_the_settings_beside_it():
    card, settings = read_card(POLICIES / "ppo_path.zip"), train_settings(config=POLICIES / "ppo_path.yaml")
    assert card.encoding == settings.encoding
    assert card.world == settings.world


@pytest.mark.slow
@pytest.mark.parametrize("name", SEEN)
def test_it_reaches_the_goal_on_nearly_all_fresh_maps_at_the_robot_s_speed(name):
    pytest.importorskip("stable_baselines3")
    world = EnvConfig(shapes={"n_obstacles": (15, 15)})
    rng = np.random.default_rng(20_261_122)
    maps = [draw_scenario(world, rng) for _ in range(MAPS)]
    runs = bench(maps, [f"policy={POLICIES / name}.zip"], time_limit=60.0, workers=1).table("runs")
    reached = [run for run in runs if run["outcome"] == "goal"]
    assert len(reached) >= MAPS - 2
    # The straight way is 9 m long, and the robot drives 0.5 m/s.
    assert np.median([run["time_s"] for run in reached]) < 30.0
