"""What reinforcement learning relies on: checkers over every choice of spaces, wrappers, vector envs, learning."""

from __future__ import annotations

import warnings
from functools import partial
from itertools import combinations

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AsyncVectorEnv, AutoresetMode, SyncVectorEnv
from gymnasium.wrappers import (
    FlattenObservation,
    FrameStackObservation,
    RecordEpisodeStatistics,
    RecordVideo,
    RescaleAction,
)
from stable_baselines3.common.env_checker import check_env as check_env_sb3

import gym_mapbench  # noqa: F401, registers the env
from evolution.driving import environment_for, run_episode
from gym_mapbench.env.groups import OBSERVATION_KEYS
from gym_mapbench.env.single import MapBenchEnv
from tests.contracts.test_envs import NORMALISED

SMALL = {"lidar": {"beams": 6}, "costmap": {"cells": 36}, "path": {"points": 3}, "time_limit": 3.0}
COUNTS = (1, 2, len(OBSERVATION_KEYS) - 1, len(OBSERVATION_KEYS))
SELECTIONS = [keys for count in COUNTS for keys in combinations(OBSERVATION_KEYS, count)]
"""Every key alone, with each other one, missing, and all keys."""
LEARNABLE = {**SMALL, "observation": ["goal", "velocity", "scan"], "action": "normalized", "control_hz": 5.0}


def make(**options):
    return gymnasium.make("MapBench-v0", **{**SMALL, "observation": OBSERVATION_KEYS, **options})


@pytest.mark.parametrize("action", ["normalized", "physical"])
def test_checkers_over_selections_of_observations(action, monkeypatch):
    monkeypatch.setenv("MPLBACKEND", "agg")
    for keys in SELECTIONS:
        with warnings.catch_warnings():
            if action == "physical":
                warnings.filterwarnings("ignore", message=f".*({NORMALISED})")
            check_env(make(observation=keys, action=action).unwrapped, skip_render_check=True)
            check_env_sb3(make(observation=keys, action=action).unwrapped, skip_render_check=True)


def actions(count, seed=3):
    rng = np.random.default_rng(seed)
    return rng.uniform((0.2, -1.0), (1.0, 1.0), (count, 2)).astype(np.float32)


def recorded(env, seed=7, scale=None):
    """Drive until the end; every observation, the rewards, and how it ended."""
    observation, info = env.reset(seed=seed)
    seen, rewards = [observation], []
    for action in actions(70):
        observation, reward, terminated, truncated, info = env.step(action if scale is None else action * scale)
        seen.append(observation)
        rewards.append(reward)
        if terminated or truncated:
            break
    return seen, rewards, info


@pytest.fixture(scope="module")
def bare():
    return recorded(make(action="normalized"))


def same(one, other):
    return one.keys() == other.keys() and all(np.array_equal(one[key], other[key]) for key in one)


class TestWrappersGiveTheSameEpisode:
    def test_flatten_observation(self, bare):
        env = make(action="normalized")
        seen, rewards, info = recorded(FlattenObservation(env))
        assert rewards == bare[1]
        assert info["outcome"] == bare[2]["outcome"]
        for flat, observation in zip(seen, bare[0], strict=True):
            assert np.array_equal(flat, gymnasium.spaces.flatten(env.observation_space, observation))

    def test_rescale_action_makes_physical_actions_normalised(self):
        robot = make().unwrapped.robot
        bounds = np.float32([robot.max_linear_velocity, robot.max_angular_velocity])
        physical = make(action="physical", robot={**robot.model_dump(), "max_reverse_velocity": bounds[0].item()})
        _, rewards, info = recorded(RescaleAction(physical, np.float32(-1.0), np.float32(1.0)))
        _, expected, ended = recorded(physical, scale=bounds)
        assert rewards == pytest.approx(expected, abs=1e-6)
        assert info["outcome"] == ended["outcome"]

    def test_frame_stack(self, bare):
        seen, rewards, _ = recorded(FrameStackObservation(make(action="normalized"), 3))
        assert rewards == bare[1]
        assert same({key: frames[-1] for key, frames in seen[5].items()}, bare[0][5])
        assert same({key: frames[0] for key, frames in seen[5].items()}, bare[0][3])

    def test_record_episode_statistics(self, bare):
        seen, rewards, info = recorded(RecordEpisodeStatistics(make(action="normalized")))
        assert all(same(one, other) for one, other in zip(seen, bare[0], strict=True))
        assert info["episode"]["r"] == pytest.approx(sum(bare[1]))
        assert info["episode"]["l"] == len(rewards)

    def test_record_video(self, bare, tmp_path):
        pytest.importorskip("moviepy")
        env = RecordVideo(make(action="normalized", render_mode="rgb_array"), str(tmp_path))
        _, rewards, _ = recorded(env)
        env.close()
        assert rewards == bare[1]
        assert list(tmp_path.glob("*.mp4"))


def make_bare(options):
    return MapBenchEnv(**options)


@pytest.mark.parametrize("form", ["sync", "async", "entry point"])
def test_vector_envs_give_the_episodes_of_the_single_env(form):
    options = {**LEARNABLE, "observation": list(OBSERVATION_KEYS), "noise": "nominal"}
    mode = AutoresetMode.SAME_STEP
    if form == "entry point":
        envs = gymnasium.make_vec("MapBench-v0", num_envs=3, autoreset_mode=mode, **options)
    else:
        kind = SyncVectorEnv if form == "sync" else AsyncVectorEnv
        envs = kind([partial(make_bare, options)] * 3, autoreset_mode=mode)
    singles = [make_bare(options) for _ in range(3)]
    together, _ = envs.reset(seed=11)
    alone = [env.reset(seed=11 + i)[0] for i, env in enumerate(singles)]
    ended = 0
    for step in range(40):
        assert same(together, {key: np.stack([one[key] for one in alone]) for key in together})
        command = actions(3, seed=step)
        together, rewards, terminated, truncated, infos = envs.step(command)
        for i, env in enumerate(singles):
            alone[i], reward, over, late, info = env.step(command[i])
            assert (rewards[i], terminated[i], truncated[i]) == (reward, over, late)
            if over or late:
                ended += 1
                assert infos["final_info"]["outcome"][i] == info["outcome"]
                alone[i], _ = env.reset()
    envs.close()
    assert ended >= 3


@pytest.mark.parametrize("algorithm", ["PPO", "A2C", "SAC", "TD3", "DDPG"])
def test_stable_baselines3_learns_on_the_env_as_it_is_and_the_model_drives(algorithm, tmp_path):
    import stable_baselines3

    from controllers.registry import make_controller
    from gym_mapbench.env.scenario_source import draw_scenario

    replay = {"buffer_size": 400, "learning_starts": 50} if algorithm in ("SAC", "TD3", "DDPG") else {"n_steps": 64}
    env = gymnasium.make("MapBench-v0", **LEARNABLE)
    model = getattr(stable_baselines3, algorithm)(
        "MultiInputPolicy", env, seed=0, policy_kwargs={"net_arch": [8]}, **replay
    )
    before = {name: value.clone() for name, value in model.policy.state_dict().items()}
    model.learn(256)
    assert any((before[name] != value).any() for name, value in model.policy.state_dict().items())
    model.save(tmp_path / "model.zip")
    controller = make_controller(f"learned={tmp_path / 'model.zip'}")
    config = env.unwrapped.config.replace(time_limit=1.0)
    scenario = draw_scenario(config, np.random.default_rng(0))
    episode = run_episode(environment_for(config, controller), controller, scenario, name="learned", seed=0)
    assert len(episode.commands) == 5
