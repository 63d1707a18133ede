from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gym_mapbench.env.config import EnvConfig
from gym_mapbench.env.observation import has_path, plan_path
from gym_mapbench.env.random_task import NEAREST, draw_task
from gym_mapbench.env.scenario_source import draw_scenario
from gym_mapbench.env.single import MapBenchEnv
from gym_mapbench.env.task import distance_to_goal
from gym_mapbench.errors import ConfigError
from gym_mapbench.generator import ShapeSettings
from gym_mapbench.world.clearance import check_clearance
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.robot import ROBOTS
from gym_mapbench.world.scenario import Pose, Scenario


@given(st.integers(0, 10_000), st.sampled_from(sorted(ROBOTS.built_in)))
def test_the_robot_stands_free_at_both_ends_and_there_is_a_way(seed, robot):
    rng = np.random.default_rng(seed)
    config = EnvConfig(robot=robot)
    scenario = draw_task(draw_scenario(config, rng).map, config.robot, rng)
    assert scenario is not None
    check_clearance(scenario, config.robot)
    assert distance_to_goal(scenario, config.robot).solvable
    assert np.hypot(scenario.goal.x - scenario.start.x, scenario.goal.y - scenario.start.y) >= NEAREST


def test_there_is_none_where_the_robot_has_no_room():
    narrow = GridMap.from_rows(["#" * 40, *["#" + "." * 38 + "#"] * 6, "#" * 40])
    assert draw_task(narrow, EnvConfig().robot, np.random.default_rng(0)) is None


def test_distances_are_spread():
    rng = np.random.default_rng(3)
    config = EnvConfig(shapes={"n_obstacles": (5, 5)})
    away = []
    for _ in range(200):
        scenario = draw_task(draw_scenario(config, rng).map, config.robot, rng)
        away.append(np.hypot(scenario.goal.x - scenario.start.x, scenario.goal.y - scenario.start.y))
    assert np.mean(np.array(away) < 3) > 0.15
    assert np.mean(np.array(away) > 6) > 0.15


def test_a_path_that_is_observed_can_be_planned():
    dense = EnvConfig(observation=("goal", "path"), shapes=ShapeSettings(n_obstacles=(45, 45)))
    without = dense.replace(observation=("goal",))
    refused = 123  # the way on its first map is longer than NavFn follows
    assert not has_path(dense, draw_scenario(without, np.random.default_rng(refused)))
    for seed in range(refused - 2, refused + 3):
        assert has_path(dense, draw_scenario(dense, np.random.default_rng(seed)))


def test_a_path_keeps_room_where_there_is_a_way_with_room():
    wall = [*"#" * 22, *"." * 10, *"#" * 18, *"." * 29, "#"]  # a gap of 0.5 m on the way, one of 1.45 m aside
    rows = ["#" * 80, *["#" + "." * 78 + "#"] * 29, *["".join(wall)] * 2, *["#" + "." * 78 + "#"] * 29, "#" * 80]
    scenario = Scenario(GridMap.from_rows(rows), Pose(1.35, 0.5), Pose(1.35, 2.6))

    def crossing(*rooms):
        path = plan_path(EnvConfig(path={"rooms": rooms}), scenario)
        return path[np.argmin(np.abs(path[:, 1] - 1.55)), 0]

    assert 1.1 < crossing(0.0) < 1.6
    assert 2.5 < crossing(0.2, 0.0) < 3.95
    assert crossing(5.0, 0.0) == crossing(0.0)


def test_maps_are_sampled_until_a_given_task_can_be_driven():
    task = {"start": (2.0, 2.0, 0.0), "goal": (5.0, 5.0, 0.0)}
    env = MapBenchEnv(observation=["goal"], shapes={"n_obstacles": (30, 40)}, **task)
    other = MapBenchEnv(observation=["goal"], shapes={"n_obstacles": (30, 40)})
    for seed in range(10):
        env.reset(seed=seed)
        other.reset(seed=seed, options=task)
        assert env.scenario == other.scenario
        assert distance_to_goal(env.scenario, env.robot).solvable


def test_a_given_start_that_no_map_has_room_for_is_named():
    with pytest.raises(ConfigError, match=r"start: expected a free cell, got an obstacle at \(0, 0\)"):
        draw_scenario(EnvConfig(start=(0.0, 0.0, 0.0)), np.random.default_rng(0))
