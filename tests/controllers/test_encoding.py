from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from controllers.learned.encoding import FEATURES, Encoder, EncodingSettings, source_of
from controllers.learned.kernels import free_arcs
from controllers.learned.memory import Frames, Sight
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.env.single import MapBenchEnv
from gym_mapbench.errors import ConfigError

WORLD = EnvConfig(lidar={"beams": 8, "range_max": 3.5}, path={"points": 3}, costmap={"cells": 4})


def encoded(feature, values, **settings):
    encoder = Encoder(EncodingSettings(features=(feature,), **settings), WORLD)
    return encoder.encode({source_of(feature): np.array([values], dtype=float)})[0]


@pytest.mark.parametrize(
    ("velocity", "shares"),
    [((0.5, 1.9), (1, 1)), ((0.25, -0.95), (0.5, -0.5)), ((-0.35, 0), (-1, 0)), ((0, 0), (0, 0))],
)
def test_velocity_is_a_share_of_the_limit_in_its_direction(velocity, shares):
    assert encoded("velocity", velocity) == pytest.approx(shares)


def test_a_robot_without_reverse_speed():
    world = WORLD.replace(robot=WORLD.robot.replace(max_reverse_velocity=0.0))
    encoder = Encoder(EncodingSettings(features=("velocity",)), world)
    assert np.isfinite(encoder.encode({"velocity": np.array([[-0.1, 0.0], [0.0, 0.0]])})).all()


def test_goal_as_bearing_distance_and_heading():
    ahead = encoded("goal", (5.0, 0.0, np.pi), reach=10.0)
    assert ahead == pytest.approx([1, 0, 0, 1 - 2 * np.exp(-10), -1, 0], abs=1e-6)
    left = encoded("goal", (0.0, 20.0, 0.0), reach=10.0)
    assert left[:3] == pytest.approx([0, 1, 1], abs=1e-6)


def test_scan_by_its_logarithm():
    scan = encoded("scan", [0.0, 0.2, 0.2 * 17.5**0.5, 3.5, 1, 1, 1, 1], near=0.2)
    assert scan[:4] == pytest.approx([-1, -1, 0, 1], abs=1e-6)


def test_people_by_bearing_nearness_and_velocity():
    radius = WORLD.robot.circumscribed_radius
    left = [0.0, 1.25 + radius, 1.0, -2.0, 0.25, 1.0]
    encoded_people = encoded("people", [*left, *[0.0] * 24])
    assert encoded_people[:6] == pytest.approx([0, 1, np.exp(-1.0), 0.5, -1.0, 1], abs=1e-6)
    assert (encoded_people[6:] == 0).all()


@pytest.mark.parametrize("x", [0.0, 0.1])
def test_a_person_at_the_robot_s_place_is_nearness_one(x):
    assert encoded("people", [x, 0, 0, 0, 0.25, 1, *[0.0] * 24])[2] == 1.0


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


@given(st.integers(0, 10_000))
def test_a_trail_is_where_the_robot_was_as_it_sees_it_now(seed):
    env = MapBenchEnv(WORLD, observation=("goal",), collision_ends_episode=False, control_hz=5.0)
    sight = Sight(1, EncodingSettings(features=("goal",), trail=(1, 4)), env.config)
    observation, info = env.reset(seed=seed)
    env.action_space.seed(seed)
    poses = [info["pose"]] * 5
    seen = sight.begin({"goal": observation["goal"][np.newaxis]}, np.ones(1, dtype=bool))
    assert (seen[0, 6:] == 0).all()
    for _ in range(6):
        observation, _, _, _, info = env.step(env.action_space.sample())
        poses.append(info["pose"])
        seen = sight.push({"goal": observation["goal"][np.newaxis]})
    x, y, yaw = poses[-1]
    for number, ago in enumerate((1, 4)):
        east, north = poses[-1 - ago][0] - x, poses[-1 - ago][1] - y
        ahead, left = math.cos(yaw) * east + math.sin(yaw) * north, math.cos(yaw) * north - math.sin(yaw) * east
        near = np.array([ahead, left]) / (1.0 + math.hypot(ahead, left))
        assert seen[0, 6 + 2 * number : 8 + 2 * number] == pytest.approx(near, abs=1e-5)


def test_trails_of_worlds_that_begin_anew_are_forgotten_alone():
    sight = Sight(2, EncodingSettings(features=("goal",), trail=(1,)), WORLD)
    goal = np.array([[3.0, 0.0, 0.5], [3.0, 0.0, 0.5]])
    sight.begin({"goal": goal}, np.ones(2, dtype=bool))
    moved = goal - np.array([1.0, 0.0, 0.0])
    assert sight.push({"goal": moved})[:, 6:] == pytest.approx(np.array([[-0.5, 0.0], [-0.5, 0.0]]), abs=1e-6)
    begun = sight.begin({"goal": moved}, np.array([True, False]))
    assert begun[:, 6:] == pytest.approx(np.array([[0.0, 0.0], [-0.5, 0.0]]), abs=1e-6)


@given(st.integers(0, 10_000), st.integers(0, 30))
def test_every_entry_lies_within_one(seed, steps):
    settings = EncodingSettings(features=tuple(FEATURES))
    easy = {"n_obstacles": (0, 10)}  # on one map in thousands of the densest NavFn cannot follow its plan
    env = MapBenchEnv(WORLD, observation=settings.keys, collision_ends_episode=False, shapes=easy)
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
    ("features", "message"),
    [(("pose",), "unknown feature 'pose'"), ((), "at least one"), (("scan", "scan"), "each once")],
)
def test_features_that_there_are_not(features, message):
    with pytest.raises(ConfigError, match=message):
        EncodingSettings(features=features)


def test_a_trail_needs_the_goal():
    with pytest.raises(ConfigError, match="trail: expected goal among the features"):
        EncodingSettings(features=("scan",), trail=(5,))


def plain_free_length(point, radius, curvature, reach, backwards):
    """Drive along the arc in steps of half a millimetre until the disc covers the point."""
    length = np.arange(0.0, reach, 0.0005) * (-1 if backwards else 1)
    if curvature == 0:
        x, y = length, np.zeros_like(length)
    else:
        x, y = np.sin(length * curvature) / curvature, (1 - np.cos(length * curvature)) / curvature
    covered = np.hypot(x - point[0], y - point[1]) < radius
    return abs(length[covered.argmax()]) if covered.any() else reach


@given(
    st.floats(0.3, 3.0),
    st.floats(-math.pi, math.pi),
    st.sampled_from([0.0, 0.3, -0.3, 1.2, -2.0, 3.5, -7.0]),
    st.booleans(),
)
def test_free_arcs_end_where_the_disc_meets_the_point(distance, angle, curvature, backwards):
    point = distance * math.cos(angle), distance * math.sin(angle)
    free = np.empty((1, 1, 2, 1))
    beams = np.array([[math.cos(angle), math.sin(angle)]])
    free_arcs(np.array([[distance]]), beams, 0.0, 0.0, 3.5, np.array([0.25]), np.array([curvature]), 2.5, free)
    expected = plain_free_length(point, 0.25, curvature, 2.5, backwards)
    grazing = plain_free_length(point, 0.248, curvature, 2.5, backwards)
    if abs(expected - grazing) < 0.02:  # where the disc only grazes the point, a rounding decides
        assert free[0, 0, int(backwards), 0] == pytest.approx(expected, abs=0.002)


def test_beams_without_a_reading_are_no_obstacle_and_covered_points_leave_the_way_back():
    scan = np.array([3.5, 0.0, 3.5, 3.5, 0.1, 3.5, 3.5, 3.5])
    free = encoded("arcs", scan, curvatures=(0.0,), margins=(0.02,))
    assert free == pytest.approx([1.0, -1.0])
    scan[4] = 3.5
    assert encoded("arcs", scan, curvatures=(0.0,), margins=(0.02,)) == pytest.approx([1.0, 1.0])


def test_arcs_know_where_the_scanner_sits():
    world = EnvConfig(lidar={"beams": 1, "x": -0.1})
    settings = EncodingSettings(features=("arcs",), curvatures=(0.0,), margins=(0.0,), arc_reach=3.0)
    free = Encoder(settings, world).encode({"scan": np.array([[1.0]])})[0, 0]
    assert free == pytest.approx(2 * math.sqrt((1.0 - 0.1 - 0.22) / 3.0) - 1, abs=1e-6)
