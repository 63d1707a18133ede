from __future__ import annotations

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

import gym_mapbench  # noqa: F401, registers the env
from gym_mapbench.env import MapBenchEnv
from gym_mapbench.errors import ConfigError
from gym_mapbench.scenario import MapSet
from gym_mapbench.vector import MapBenchVectorEnv
from tests.test_env import SCENARIO
from tests.worlds import ROOM_OPTIONS

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


def test_every_world_is_the_single_env_of_its_seed():
    options = {"noise": "nominal", "collision_ends_episode": False}
    envs = MapBenchVectorEnv(3, **options)
    singles = [MapBenchEnv(**options) for _ in range(3)]
    together, _ = envs.reset(seed=5)
    alone = [env.reset(seed=5 + i)[0] for i, env in enumerate(singles)]
    for _ in range(10):
        for key in together:
            assert (together[key] == np.stack([one[key] for one in alone])).all()
        together, *_ = envs.step(np.tile(np.float32([0.4, 0.5]), (3, 1)))
        alone = [env.step(np.float32([0.4, 0.5]))[0] for env in singles]


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


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"num_envs": 0}, "num_envs: expected at least 1, got 0"),
        ({"autoreset_mode": "Never"}, "autoreset_mode: expected one of 'NextStep'"),
        ({"tiem_limit": 1}, "did you mean 'time_limit'"),
    ],
)
def test_bad_options_are_one_clear_line(options, message):
    with pytest.raises(ConfigError, match=message):
        MapBenchVectorEnv(**options)
