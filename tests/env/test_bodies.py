from __future__ import annotations

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import SyncVectorEnv
from stable_baselines3.common.env_checker import check_env as check_env_sb3

import gym_mapbench  # noqa: F401, registers the env
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.env.groups import OBSERVATION_KEYS
from gym_mapbench.env.render import BODY
from gym_mapbench.env.single import MapBenchEnv
from gym_mapbench.env.vector import MapBenchVectorEnv
from gym_mapbench.errors import ConfigError
from gym_mapbench.world.scenario import MapSet
from tests.env.test_vector import assert_same, compare_run, with_modes
from tests.worlds import ROOM, among, line, social

CROSSING = line((2.5, 0.8), (0.5, 0.8), 0.3)
"""Comes towards the robot, which starts at x = 0.8 m and looks at it."""

SCENARIOS = (
    among(CROSSING, line((0.5, 2.5), (2.5, 1.5), 0.5, 0.1)),
    among(),
    among(line((2.5, 1.6), (0.5, 1.6), 0.5), start=(0.8, 1.6, 0.0)),
    among(*(line((2.6, y), (0.4, y), 0.5, 0.1) for y in (0.7, 1.2, 1.7)), rows=ROOM[:1] + ROOM[1:2] * 26 + ROOM[-1:]),
)
HALL = ("#" * 60, *["#" + "." * 58 + "#"] * 28, "#" * 60)
SOCIAL = (
    among(social((5.0, 0.9), (0.6, 0.8), speed=1.2, sees_robot=False), social((4.0, 2.0), (0.6, 1.2)), rows=HALL),
    among(social((4.0, 0.8), (0.6, 1.5), (5.5, 1.5), loop=True), line((5.0, 1.5), (3.0, 2.5), 0.3), rows=HALL),
)
"""People who walk by social forces."""
OPTIONS = {
    "social force": {"scenarios": SOCIAL, "collision_ends_episode": False},
    "social force, late": {"scenarios": SOCIAL, "noise": {"latency": 0.02}, "control_hz": 25},
    "default": {},
    "nominal": {"noise": "nominal"},
    "jackal": {"robot": "jackal"},
    "jackal goes on": {"robot": "jackal", "collision_ends_episode": False},
    "goes on": {"collision_ends_episode": False, "noise": "rough"},
    "mounted scanner": {"lidar": {"beams": 16, "x": -0.06, "yaw": 0.3, "range_min": 0.12}},
    "slow scanner": {"lidar": {"beams": 16, "scan_rate": 5}},
    "late": {"noise": {"latency": 0.4}},
    "late by the whole period": {"noise": {"latency": 1.0}},
}


@pytest.mark.parametrize(("name", "mode"), with_modes(OPTIONS))
def test_every_world_with_bodies_is_the_single_env_of_its_seed(name, mode):
    options = {"observation": OBSERVATION_KEYS, "lidar": {"beams": 16}, "costmap": {"cells": 9}, "time_limit": 4.0}
    options |= {"scenarios": SCENARIOS, **OPTIONS[name]}
    alone = SyncVectorEnv([lambda: MapBenchEnv(**options)] * 6, autoreset_mode=mode)
    together = MapBenchVectorEnv(6, autoreset_mode=mode, **options)
    assert "body" in compare_run(alone, together, 100, 0.3)


def drive(scenario, action=(0.0, 0.0), **options):
    """Observations and infos of an episode with one action."""
    env = MapBenchEnv(scenarios=[scenario], time_limit=10.0, **options)
    observation, info = env.reset(seed=3)
    steps, over = [(observation, info)], False
    while not over:
        observation, _, terminated, truncated, info = env.step(action)
        steps.append((observation, info))
        over = terminated or truncated
    return steps


def test_a_body_that_touches_the_robot_ends_the_episode():
    steps = drive(among(CROSSING), (0.1, 0.0))
    last = steps[-1][1]
    assert (last["outcome"], last["contact"], last["touched"]) == ("collision", True, "body")
    # They start 1.7 m apart, touch at 0.42 m, and approach at 0.4 m/s once the robot has accelerated.
    assert last["time"] == pytest.approx((1.7 - 0.42) / 0.4, abs=0.06)
    assert {info["touched"] for _, info in steps[:-1]} == {"nothing"}
    assert last["reward_terms"]["collision"] == -10.0


def test_a_touch_of_a_wall_is_told_from_one_of_a_body():
    assert drive(among(), (0.5, 0.0))[-1][1]["touched"] == "wall"


def test_the_episode_goes_on_where_collisions_do_not_end_it():
    stands, turns = (drive(among(CROSSING), (0.0, w), collision_ends_episode=False)[-1][1] for w in (0.0, 0.1))
    assert stands["outcome"] == turns["outcome"] == "timeout"
    assert stands["pose"][0] == pytest.approx(0.8, abs=1e-5)
    assert turns["pose"][0] < 0.7, "only a robot that moves is pushed"


def test_a_contact_is_the_body_s_if_the_robot_stood_still():
    stands, drives = (drive(among(CROSSING), (v, 0.0))[-1][1] for v in (0.0, 0.1))
    assert [info["touched"] for info in (stands, drives)] == ["body", "body"]
    assert [info["contact_by_body"] for info in (stands, drives)] == [True, False]
    assert not drive(among(), (0.5, 0.0))[-1][1]["contact_by_body"], "a wall touches nobody"


def test_the_scan_follows_the_body():
    steps = drive(among(CROSSING), lidar={"beams": 4})
    for number, (observation, info) in enumerate(steps[:-1]):
        body = 2.5 - 0.3 * number / 20
        assert observation["scan"][0] == pytest.approx(body - 0.2 - info["pose"][0], abs=1e-6)


def test_the_same_seed_is_the_same_episode():
    first, again = (drive(SCENARIOS[0], (0.1, 0.2), noise="rough") for _ in range(2))
    assert_same(tuple(first), tuple(again))


def test_an_episode_begins_with_the_bodies_at_their_start():
    env = MapBenchEnv(scenarios=[among(CROSSING)], lidar={"beams": 4})
    first, _ = env.reset(seed=0)
    for _ in range(30):
        env.step((0.0, 0.0))
    assert (env.reset(seed=0)[0]["scan"] == first["scan"]).all()


def test_bodies_are_drawn_where_they_are():
    env = MapBenchEnv(scenarios=[among(CROSSING)], render_mode="rgb_array", observation=["pose"])
    env.reset(seed=0)
    for seconds in (0, 2):
        coloured = (np.abs(env.render() - BODY).sum(axis=2) < 2).nonzero()
        x, y = coloured[1].mean() / 200, 3.0 - coloured[0].mean() / 200
        assert (x, y) == pytest.approx((2.5 - 0.3 * seconds, 0.8), abs=0.03)
        for _ in range(40):
            env.step((0.0, 0.0))


@pytest.mark.parametrize("at", [(0.8, 1.1), (2.2, 2.3)])
def test_reset_refuses_a_body_on_start_or_goal(at):
    env = MapBenchEnv(scenarios=[among(line(at, (1.5, 1.5), 0.2))])
    with pytest.raises(ConfigError, match=r"expected room for the robot .* body 0 \(line\)") as caught:
        env.reset()
    assert "\n" not in str(caught.value)


def test_a_disturbed_start_keeps_clear_of_bodies():
    beside = among(line((0.8, 0.8 + 0.43), (1.5, 1.5), 0.1))
    for seed in range(20):
        env = MapBenchEnv(scenarios=[beside], noise={"start_xy": 0.05})
        _, info = env.reset(seed=seed)
        assert np.hypot(*(info["pose"][:2] - (0.8, 1.23))) > 0.42


def test_another_start_keeps_the_bodies():
    env = MapBenchEnv(scenarios=[among(CROSSING)])
    env.reset(options={"start": (0.8, 1.6, 0.0)})
    assert env.scenario.bodies == (CROSSING,)


def test_a_map_set_as_configuration_keeps_its_bodies():
    config = EnvConfig().with_maps(MapSet(SCENARIOS[:2]))
    assert [one.bodies for one in config.load_scenarios()] == [one.bodies for one in SCENARIOS[:2]]
    assert [one.digest for one in config.load_scenarios()] == [one.digest for one in SCENARIOS[:2]]
    with_start = config.replace(start=(0.8, 1.6, 0.0)).load_scenarios()
    assert with_start[0].bodies == SCENARIOS[0].bodies


@pytest.mark.parametrize("check", [check_env, check_env_sb3])
def test_the_checkers_have_nothing_to_say(check, monkeypatch):
    monkeypatch.setenv("MPLBACKEND", "agg")
    maps = EnvConfig().with_maps(MapSet(SCENARIOS[:1])).maps
    check(gymnasium.make("MapBench-v0", maps=maps, action="normalized").unwrapped)


def twin_of_people(pose, poses, velocities, radii, count):
    """The plain twin: every body by itself, sorted by the distance to its outline."""
    rows = []
    for (x, y, _), velocity, radius in zip(poses, velocities, radii, strict=True):
        turn = np.array([[np.cos(pose[2]), np.sin(pose[2])], [-np.sin(pose[2]), np.cos(pose[2])]])
        rows.append([*(turn @ [x - pose[0], y - pose[1]]), *(turn @ velocity), radius, 1.0])
    rows.sort(key=lambda row: np.hypot(row[0], row[1]) - row[4])
    return np.array([*rows, *[[0.0] * 6] * count][:count])


@pytest.mark.parametrize("nearest", [1, 3])
@pytest.mark.parametrize("robot", ["turtlebot3_waffle", "jackal"])
def test_people_are_the_nearest_bodies_in_the_frame_of_the_robot(nearest, robot):
    options = {"observation": ["people"], "people": {"nearest": nearest}, "robot": robot}
    env = MapBenchEnv(scenarios=SCENARIOS[:1], **options)
    observation, info = env.reset(seed=0)
    for _ in range(30):
        world = env.simulation.world
        velocities = [[-0.3, 0.0], 0.5 * np.array([2.0, -1.0]) / np.hypot(2.0, 1.0)]
        expected = twin_of_people(info["pose"], world.poses, velocities, world.radii, nearest)
        assert observation["people"].reshape(-1, 6) == pytest.approx(expected, abs=1e-6)
        if robot == "turtlebot3_waffle":
            outlines = np.hypot(*(world.poses[:, :2] - info["pose"][:2]).T) - world.radii - env.robot.radius
            assert info["nearest_body"] == pytest.approx(outlines.min())
        observation, *_, info = env.step((0.1, 0.3))


def test_the_nearest_body_is_measured_from_the_outline_of_a_polygon():
    env = MapBenchEnv(scenarios=[among(line((0.8, 1.4), (0.8, 1.4), 0.0, 0.1))], robot="jackal", observation=["people"])
    _, info = env.reset(seed=0)
    half_width = np.array(env.robot.footprint)[:, 1].max()
    assert info["nearest_body"] == pytest.approx(1.4 - 0.8 - half_width - 0.1)


def test_an_env_without_bodies_has_none_near():
    env = MapBenchEnv(scenarios=[among()], observation=["people"])
    observation, info = env.reset(seed=0)
    assert info["nearest_body"] == np.inf
    assert not observation["people"].any()


def test_the_document_of_a_config_knows_people_only_where_they_are_configured():
    assert "people" not in EnvConfig().model_dump(mode="json")
    window = EnvConfig(people={"nearest": 2})
    assert EnvConfig.build(window.model_dump(mode="json")) == window
