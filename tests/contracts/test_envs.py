"""What every registered form of the env keeps: Gymnasium's and Stable-Baselines3's checkers, warnings as errors."""

from __future__ import annotations

import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from stable_baselines3.common.env_checker import check_env as check_env_sb3

import gym_mapbench  # noqa: F401, registers the env
from gym_mapbench.env.groups import OBSERVATION_KEYS

NORMALISED = "normalized space|normalized Box action space"
"""What both checkers recommend for actions. The default's are m/s and rad/s; ``action="normalized"`` follows it."""

FORMS = {
    "thesis": {},
    "all keys": {"observation": OBSERVATION_KEYS},
    "noisy": {"observation": OBSERVATION_KEYS, "noise": "nominal"},
    "rough": {"observation": OBSERVATION_KEYS, "noise": "rough", "lidar": {"no_reading": "zero"}},
    "jackal": {"robot": "jackal"},
    "burger": {"robot": "turtlebot3_burger", "collision_ends_episode": False, "lidar": {"beams": 24}},
}


def make(form, **options):
    return gymnasium.make("MapBench-v0", **{**FORMS[form], **options})


@pytest.mark.parametrize("form", FORMS)
def test_gymnasiums_checker_has_nothing_to_say(form, monkeypatch):
    monkeypatch.setenv("MPLBACKEND", "agg")
    check_env(make(form, action="normalized").unwrapped)


@pytest.mark.parametrize("form", FORMS)
def test_stable_baselines3s_checker_has_nothing_to_say(form):
    check_env_sb3(make(form, action="normalized").unwrapped)


@pytest.mark.parametrize("check", [check_env, check_env_sb3])
def test_physical_actions_only_lack_the_recommended_scale(check, monkeypatch):
    monkeypatch.setenv("MPLBACKEND", "agg")
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=f".*({NORMALISED})")
        check(make("thesis").unwrapped)


@pytest.mark.parametrize("form", FORMS)
def test_the_same_seed_is_the_same_episode_and_another_is_not(form):
    def episode(seed):
        env = make(form)
        env.action_space.seed(1)
        observations, done = [env.reset(seed=seed)[0]], False
        while not done and len(observations) < 40:
            observation, _, terminated, truncated, _ = env.step(env.action_space.sample())
            observations.append(observation)
            done = terminated or truncated
        return observations

    first, again, other = episode(3), episode(3), episode(4)
    for one, two in zip(first, again, strict=True):
        assert all((one[key] == two[key]).all() for key in one)
    # Another seed is another map; what depends on it differs.
    depends = [key for key in first[0] if key in ("scan", "costmap", "path")]
    assert any((first[0][key] != other[0][key]).any() for key in depends)


@pytest.mark.parametrize("form", FORMS)
def test_no_element_of_an_observation_is_constant(form):
    env = make(form, collision_ends_episode=False)
    low, high = {}, {}
    for seed in range(6):
        observation, _ = env.reset(seed=seed)
        for _ in range(40):
            for key in set(observation) - {"costmap", "people"}:
                low[key] = np.minimum(low.get(key, np.inf), observation[key])
                high[key] = np.maximum(high.get(key, -np.inf), observation[key])
            observation, *_ = env.step(env.unwrapped.action_space.high)
    assert all((low[key] < high[key]).all() for key in low)
