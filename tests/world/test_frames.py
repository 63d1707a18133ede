from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gym_mapbench.kernels.frames import count_motion
from gym_mapbench.world.frames import IDENTITY, compose, relate, transform_path
from gym_mapbench.world.scenario import Pose, wrap_angle

METRES = st.floats(-50, 50)
POSES = st.builds(Pose, METRES, METRES, st.floats(-math.pi, math.pi).map(wrap_angle))


def matrix(pose):
    """The plain twin: homogeneous matrices."""
    cos, sin = math.cos(pose.yaw), math.sin(pose.yaw)
    return np.array([[cos, -sin, pose.x], [sin, cos, pose.y], [0, 0, 1]])


def assert_same(one, other):
    assert one[:2] == pytest.approx(other[:2], abs=1e-9)
    assert abs(wrap_angle(one.yaw - other.yaw)) < 1e-9
    assert -math.pi < one.yaw <= math.pi


@given(POSES, POSES)
def test_composing_is_multiplying_matrices(frame, pose):
    assert matrix(compose(frame, pose)) == pytest.approx(matrix(frame) @ matrix(pose), abs=1e-9)


@given(POSES, POSES, POSES, st.tuples(*[st.floats(-0.1, 0.1)] * 3))
def test_wheels_count_a_motion_with_their_errors(before, now, counted, errors):
    distance, turn, veer = errors
    motion = np.linalg.inv(matrix(before)) @ matrix(now)
    ahead, aside = motion[:2, 2]
    turned = math.atan2(motion[1, 0], motion[0, 0]) * (1 + turn) + ahead * veer
    expected = matrix(counted) @ matrix(Pose(ahead * (1 + distance), aside * (1 + distance), turned))
    found = Pose(*count_motion(tuple(before), tuple(now), tuple(counted), *errors))
    if abs(abs(wrap_angle(now.yaw - before.yaw)) - math.pi) > 1e-6:
        assert matrix(found) == pytest.approx(expected, abs=1e-6)


@given(POSES, POSES)
def test_relate_finds_the_frame_in_which_a_pose_is_where_it_is(here, there):
    assert_same(compose(relate(here, there), here), there)


@given(POSES)
def test_the_identity_changes_no_bit(pose):
    assert compose(IDENTITY, pose) == pose
    assert relate(pose, pose) == IDENTITY
    path = np.array([pose, pose])
    assert transform_path(IDENTITY, path)[:, :2].tolist() == path[:, :2].tolist()


@given(POSES, st.lists(POSES, min_size=1, max_size=5))
def test_a_path_is_moved_pose_by_pose(frame, poses):
    moved = transform_path(frame, np.array(poses))
    for one, pose in zip(moved.tolist(), poses, strict=True):
        assert_same(Pose(*one), compose(frame, pose))


@given(POSES, st.integers(0, 2**31))
def test_a_path_is_moved_to_the_same_bits_as_by_numpy(frame, seed):
    path = np.random.default_rng(seed).uniform(-math.pi, math.pi, (50, 3))
    cos, sin = math.cos(frame.yaw), math.sin(frame.yaw)
    x, y = frame.x + (cos * path[:, 0] - sin * path[:, 1]), frame.y + (sin * path[:, 0] + cos * path[:, 1])
    yaw = -(np.mod(-(frame.yaw + path[:, 2]) + np.pi, 2 * np.pi) - np.pi)
    assert transform_path(frame, path).tolist() == np.stack([x, y, yaw], axis=1).tolist()
