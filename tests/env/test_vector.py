from __future__ import annotations

import copy
import pickle

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode, SyncVectorEnv

import gym_mapbench  # noqa: F401, registers the env
from gym_mapbench.env.groups import OBSERVATION_KEYS
from gym_mapbench.env.single import MapBenchEnv
from gym_mapbench.env.vector import MapBenchVectorEnv
from gym_mapbench.errors import ConfigError, NoPathError
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.scenario import MapSet, Pose, Scenario
from tests.env.test_env import SCENARIO
from tests.worlds import ROOM, ROOM_OPTIONS

SHORT = {**ROOM_OPTIONS, "time_limit": 0.2}


def test_make_vec_takes_the_vector_entry_point():
    envs = gymnasium.make_vec("MapBench-v0", num_envs=3, **ROOM_OPTIONS)
    assert isinstance(envs, MapBenchVectorEnv)
    observations, infos = envs.reset(seed=0)
    assert envs.observation_space.contains(observations)
    assert observations["scan"].shape == (3, 360)
    assert infos["pose"].shape == (3, 3)
    observations, rewards, terminations, truncations, infos = envs.step(envs.action_space.sample())
    assert envs.observation_space.contains(observations)
    assert rewards.shape == terminations.shape == truncations.shape == (3,)
    assert infos["reward_terms"]["progress"].shape == (3,)
    envs.close()


def assert_same(one, other, where=""):
    """Nothing differs: keys, types, shapes, bits."""
    assert type(one) is type(other), where
    if isinstance(one, dict):
        assert set(one) == set(other), where
        for key in one:
            assert_same(one[key], other[key], f"{where}/{key}")
    elif isinstance(one, tuple) or (isinstance(one, np.ndarray) and one.dtype == object):
        assert len(one) == len(other), where
        for index, (first, second) in enumerate(zip(one, other, strict=True)):
            assert_same(first, second, f"{where}[{index}]")
    elif isinstance(one, np.ndarray):
        assert (one.dtype, one.shape) == (other.dtype, other.shape), where
        assert one.tobytes() == other.tobytes() or (one == other).all(), where
    else:
        assert one == other, where


def compare_run(alone, together, steps, force=1.0):
    """Drive both with the same actions, resetting what is over; returns the bodies touched, after all worlds ended."""
    assert_same(alone.reset(seed=5), together.reset(seed=5))
    together.action_space.seed(5)
    touched, ended = set(), np.zeros(together.num_envs, bool)
    for count in range(steps):
        if count % 15 == 0:
            actions = force * together.action_space.sample()
        expected = alone.step(actions)
        assert_same(expected, together.step(actions), f"step {count} ")
        touched |= set(expected[4]["touched"]) | set(expected[4].get("final_info", {}).get("touched", ()))
        over = expected[2] | expected[3]
        ended |= over
        if over.any() and together.autoreset_mode is AutoresetMode.DISABLED:
            resets = [envs.reset(options={"reset_mask": over.copy()}) for envs in (alone, together)]
            assert_same(*resets, f"reset {count} ")
    assert ended.all()
    return touched


OPTIONS = {
    "default": {},
    "normalised": {"action": "normalized"},
    "nominal": {"noise": "nominal"},
    "rough": {"noise": "rough", "collision_ends_episode": False},
    "jackal": {"robot": "jackal", "collision_ends_episode": False},
    "no progress": {"reward": {"progress": 0.0}},
    "mounted scanner": {"lidar": {"beams": 16, "x": -0.06, "yaw": 0.3, "range_min": 0.12}},
    "slow scanner": {"lidar": {"beams": 16, "scan_rate": 5}},
    "late": {"noise": {"latency": 1.0}},
    "odom frame": {"noise": {"odom_frame": "random"}},
    "families": {"family": ["doors", "pillars"], "shapes": {"size": 150}},
    "maps of two sizes": {**ROOM_OPTIONS, "maps": [ROOM, ROOM[:1] + ROOM[1:2] * 25 + ROOM[-1:]]},
}


def with_modes(options):
    """All options with ``NextStep``, which alone steps some worlds while others begin; the first with each mode."""
    later = [mode for mode in AutoresetMode if mode is not AutoresetMode.NEXT_STEP]
    return [(name, AutoresetMode.NEXT_STEP) for name in options] + [(next(iter(options)), mode) for mode in later]


@pytest.mark.parametrize(("name", "mode"), with_modes(OPTIONS))
def test_every_world_is_the_single_env_of_its_seed(name, mode):
    options = {
        **{"observation": OBSERVATION_KEYS, "lidar": {"beams": 16}, "costmap": {"cells": 9}},
        **{"time_limit": 3.0, "xy_goal_tolerance": 0.5, "shapes": {"size": 80}},
        **OPTIONS[name],
    }
    alone = SyncVectorEnv([lambda: MapBenchEnv(**options)] * 4, autoreset_mode=mode)
    together = MapBenchVectorEnv(4, autoreset_mode=mode, **options)
    assert (alone.observation_space, alone.action_space) == (together.observation_space, together.action_space)
    assert alone.metadata == together.metadata
    compare_run(alone, together, 150)


def test_every_world_may_be_given_its_own_scenario():
    rooms = [Scenario(SCENARIO.map, SCENARIO.start._replace(yaw=0.1 * i), SCENARIO.goal) for i in range(3)]
    envs = MapBenchVectorEnv(3, autoreset_mode="Disabled", **ROOM_OPTIONS)
    _, infos = envs.reset(seed=0, options={"scenarios": rooms})
    assert infos["pose"][:, 2] == pytest.approx([0.0, 0.1, 0.2])
    some = np.array([False, True, False])
    envs.reset(options={"scenarios": rooms[::-1], "reset_mask": some})
    assert [envs.envs[i].scenario for i in range(3)] == [rooms[0], rooms[1], rooms[2]]
    envs.reset(options={"scenarios": rooms[1:] + rooms[:1], "reset_mask": some})
    assert [envs.envs[i].scenario for i in range(3)] == [rooms[0], rooms[2], rooms[2]]
    for bad in (rooms[:2], 3, None, dict(enumerate(rooms))):
        with pytest.raises(ConfigError, match="scenarios: expected one for each of 3 worlds"):
            envs.reset(options={"scenarios": bad})
    with pytest.raises(ConfigError, match="reset options: expected a mapping, got int"):
        envs.reset(options=3)
    assert envs.reset(options={"scenarios": MapSet(rooms)})[1]["pose"].shape == (3, 3)


def test_options_of_a_reset_stay_as_they_were_given():
    envs = MapBenchVectorEnv(2, autoreset_mode="Disabled", **ROOM_OPTIONS)
    envs.reset(seed=0)
    some = {"reset_mask": np.array([False, True])}
    for _ in range(2):
        envs.step(np.full((2, 2), 0.3))
        _, infos = envs.reset(options=some)
        assert infos["_time"].tolist() == [False, True]


def test_next_step_resets_on_the_step_after_the_end():
    envs = MapBenchVectorEnv(2, **SHORT)
    envs.reset(seed=0)
    actions = np.zeros((2, 2), np.float32)
    truncated = [envs.step(actions)[3].all() for _ in range(4)]
    assert truncated == [False, False, False, True]
    _, rewards, terminations, truncations, infos = envs.step(actions)
    assert not any(values.any() for values in (rewards, terminations, truncations))
    assert (infos["time"] == 0.0).all()


def test_same_step_resets_at_once_and_keeps_the_last_observation():
    envs = gymnasium.make_vec("MapBench-v0", num_envs=2, autoreset_mode="SameStep", **SHORT)
    assert envs.metadata["autoreset_mode"] is AutoresetMode.SAME_STEP
    envs.reset(seed=0)
    for _ in range(4):
        observations, _, _, truncations, infos = envs.step(np.full((2, 2), 0.3, np.float32))
    assert truncations.all()
    assert (infos["time"] == 0.0).all()
    assert (infos["final_info"]["outcome"] == "timeout").all()
    assert infos["final_obs"][0]["pose"][0] > observations["pose"][0, 0]


def test_disabled_worlds_are_reset_by_hand():
    envs = MapBenchVectorEnv(2, autoreset_mode="Disabled", **SHORT)
    envs.reset(seed=0)
    for _ in range(4):
        *_, truncations, _ = envs.step(np.zeros((2, 2), np.float32))
    assert truncations.all()
    _, infos = envs.reset(options={"reset_mask": np.array([True, False])})
    assert infos["_time"].tolist() == [True, False]


def test_scenarios_are_given_in_process():
    envs = MapBenchVectorEnv(2, scenarios=MapSet((SCENARIO,)))
    observations, _ = envs.reset()
    assert (observations["pose"] == SCENARIO.start).all()


def test_observations_are_not_overwritten():
    envs = MapBenchVectorEnv(2, **ROOM_OPTIONS)
    first, _ = envs.reset()
    kept = {key: value.copy() for key, value in first.items()}
    envs.step(np.ones((2, 2), np.float32))
    assert all((first[key] == kept[key]).all() for key in first)


def test_worlds_without_an_episode_are_not_stepped():
    envs = MapBenchVectorEnv(2, autoreset_mode="Disabled", **SHORT)
    actions = np.zeros((2, 2))
    with pytest.raises(ResetNeeded, match="call reset first"):
        envs.step(actions)
    envs.reset()
    for _ in range(4):
        envs.step(actions)
    with pytest.raises(ResetNeeded, match="call reset first"):
        envs.step(actions)


BLOCKED = GridMap.from_rows([*ROOM[:15], "#" * len(ROOM[0]), *ROOM[16:]], 0.1)
NO_WAY = Scenario(BLOCKED, Pose(0.8, 0.5, 0.0), Pose(0.8, 2.5, 0.0), "no way")
NO_ROOM = Scenario(SCENARIO.map, Pose(0.15, 0.15, 0.0), SCENARIO.goal, "no room")


@pytest.mark.parametrize("mode", list(AutoresetMode))
@pytest.mark.parametrize(("bad", "error"), [(NO_WAY, NoPathError), (NO_ROOM, ConfigError)])
def test_no_world_is_stepped_after_a_reset_that_failed(bad, error, mode):
    envs = MapBenchVectorEnv(2, autoreset_mode=mode, observation=("path", "goal", "pose"), scenarios=[SCENARIO])
    envs.reset(seed=0)
    actions = np.full((2, 2), 0.3)
    envs.step(actions)
    with pytest.raises(error):
        envs.reset(options={"scenarios": [SCENARIO, bad]})
    with pytest.raises(ResetNeeded, match="call reset first"):
        envs.step(actions)
    envs.reset(seed=0, options={"reset_mask": np.array([False, True])})
    *_, infos = envs.step(actions)
    assert infos["time"] == pytest.approx([0.05, 0.05])


def test_a_single_env_is_not_stepped_after_a_reset_that_failed():
    env = MapBenchEnv(observation=("path", "pose"), scenarios=[SCENARIO])
    for options in ({"options": {"scenario": NO_WAY}}, {"options": {"scenario": NO_ROOM}}, {"seed": -1}):
        env.reset(seed=0)
        with pytest.raises((NoPathError, ConfigError, gymnasium.error.Error)):
            env.reset(**options)
        with pytest.raises(ResetNeeded, match="call reset first"):
            env.step((0.3, 0.0))


@pytest.mark.parametrize(
    "actions", [np.zeros((3, 2)), np.zeros(2), "go", None, [[0.0, np.nan], [0.0, 0.0]], [[0.0], [0.0, 1.0]]]
)
def test_bad_actions_are_one_clear_line(actions):
    envs = MapBenchVectorEnv(2, **ROOM_OPTIONS)
    envs.reset()
    with pytest.raises(ConfigError, match="actions: expected") as caught:
        envs.step(actions)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy, pickle.dumps])
def test_copies_are_refused_as_worlds_share_their_arrays(copied):
    envs = gymnasium.make_vec("MapBench-v0", num_envs=2, **ROOM_OPTIONS)
    for one in (envs, envs.envs[0]):
        with pytest.raises(TypeError, match="cannot be copied or pickled"):
            copied(one)


def test_worlds_are_rendered():
    envs = MapBenchVectorEnv(2, render_mode="rgb_array", **SHORT)
    envs.reset()
    before = envs.render()
    envs.step(np.full((2, 2), 0.3))
    after = envs.render()
    assert len(before) == len(after) == 2
    assert (before[0] != after[0]).any()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"num_envs": 0}, "num_envs: expected a whole number, at least 1, got 0"),
        ({"num_envs": 2.5}, "num_envs: expected a whole number, at least 1, got 2.5"),
        ({"num_envs": "2"}, "num_envs: expected a whole number, at least 1, got '2'"),
        ({"autoreset_mode": "Never"}, "autoreset_mode: expected one of 'NextStep'"),
        ({"tiem_limit": 1}, "did you mean 'time_limit'"),
    ],
)
def test_bad_options_are_one_clear_line(options, message):
    with pytest.raises(ConfigError, match=message):
        MapBenchVectorEnv(**options)


def test_a_mask_before_the_first_reset_is_refused():
    worlds = gymnasium.make_vec("MapBench-v0", num_envs=2)
    with pytest.raises(ResetNeeded, match="reset: the mask leaves out worlds"):
        worlds.reset(seed=0, options={"reset_mask": np.array([True, False])})
    observations, _ = worlds.reset(seed=0, options={"reset_mask": np.array([True, True])})
    assert len(observations["pose"]) == 2
