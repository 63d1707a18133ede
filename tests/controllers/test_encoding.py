from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from controllers.encoding import FEATURES, Encoder, EncodingSettings, Frames
from gym_mapbench.config import EnvConfig
from gym_mapbench.env import MapBenchEnv
from gym_mapbench.errors import ConfigError

WORLD = EnvConfig(lidar={"beams": 8, "range_max": 3.5}, path={"points": 3}, costmap={"cells": 4})


def encoded(key, values, **settings):
    return Encoder(EncodingSettings(keys=(key,), **settings), WORLD).encode({key: np.array([values], dtype=float)})[0]


@pytest.mark.parametrize(
    ("velocity", "shares"),
    [((0.5, 1.9), (1, 1)), ((0.25, -0.95), (0.5, -0.5)), ((-0.35, 0), (-1, 0)), ((0, 0), (0, 0))],
)
def test_velocity_is_a_share_of_the_limit_in_its_direction(velocity, shares):
    assert encoded("velocity", velocity) == pytest.approx(shares)


def test_a_robot_without_reverse_speed():
    world = WORLD.replace(robot=WORLD.robot.replace(max_reverse_velocity=0.0))
    encoder = Encoder(EncodingSettings(keys=("velocity",)), world)
    assert np.isfinite(encoder.encode({"velocity": np.array([[-0.1, 0.0], [0.0, 0.0]])})).all()


def test_goal_as_bearing_distance_and_heading():
    ahead = encoded("goal", (5.0, 0.0, np.pi), reach=10.0)
    assert ahead == pytest.approx([1, 0, 0, 1 - 2 * np.exp(-10), -1, 0], abs=1e-6)
    left = encoded("goal", (0.0, 20.0, 0.0), reach=10.0)
    assert left[:3] == pytest.approx([0, 1, 1], abs=1e-6)


def test_scan_by_its_logarithm():
    scan = encoded("scan", [0.0, 0.2, 0.2 * 17.5**0.5, 3.5, 1, 1, 1, 1], near=0.2)
    assert scan[:4] == pytest.approx([-1, -1, 0, 1], abs=1e-6)


def test_frames_are_the_newest_first_and_as_far_apart_as_told():
    frames = Frames(2, 1, EncodingSettings(frames=3, frame_spacing=2))
    both = np.ones(2, dtype=bool)
    frames.begin(np.zeros((2, 1), np.float32), both)
    for number in range(1, 6):
        stacked = frames.push(np.full((2, 1), number, np.float32))
    assert stacked.tolist() == [[5, 3, 1], [5, 3, 1]]
    begun = frames.begin(np.full((2, 1), 9, np.float32), np.array([True, False]))
    assert begun.tolist() == [[9, 9, 9], [5, 3, 1]]


@pytest.mark.parametrize("count", [1, 2])
def test_a_stack_that_was_returned_does_not_change(count):
    frames = Frames(1, 1, EncodingSettings(frames=count))
    first = frames.begin(np.zeros((1, 1), np.float32), np.ones(1, dtype=bool))
    frames.push(np.ones((1, 1), np.float32))
    assert (first == 0).all()


@given(st.integers(0, 10_000), st.integers(0, 30))
def test_every_entry_lies_within_one(seed, steps):
    settings = EncodingSettings(keys=tuple(FEATURES))
    env = MapBenchEnv(WORLD, observation=settings.keys, collision_ends_episode=False)
    encoder = Encoder(settings, env.config)
    observation, _ = env.reset(seed=seed)
    env.action_space.seed(seed)
    for _ in range(steps):
        observation, *_ = env.step(env.action_space.sample())
    features = encoder.encode({key: value[np.newaxis] for key, value in observation.items()})
    assert features.shape == (1, encoder.size)
    assert features.dtype == np.float32
    assert (np.abs(features) <= 1).all()


@pytest.mark.parametrize(
    ("keys", "message"),
    [(("pose",), "unknown observation key of a network 'pose'"), ((), "at least one"), (("scan", "scan"), "each once")],
)
def test_keys_that_cannot_be_encoded(keys, message):
    with pytest.raises(ConfigError, match=message):
        EncodingSettings(keys=keys)
