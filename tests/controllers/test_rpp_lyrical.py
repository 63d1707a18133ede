"""Lyrical's RPP: worked examples of the dynamic window and of the checked way, and a plain twin."""

from __future__ import annotations

import dataclasses
import math
import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from controllers.base import ControllerAbort, ControllerError, InvalidPath, Twist
from controllers.rpp.controller import REASONS
from controllers.rpp.dynamic_window import command_on_curve
from controllers.rpp.kernels import COLLISION_AHEAD, OFF_COSTMAP, SINGLE_POSE
from controllers.rpp.lyrical import LyricalRppFollower
from controllers.rpp.params import RppParams
from gym_mapbench.world.scenario import Pose
from tests.controllers.plain_follower import local_plan
from tests.controllers.plain_rpp_lyrical import PlainLyricalRpp, fastest_on_line, point_at
from tests.controllers.test_rpp import (
    DISC,
    ORIGIN,
    REST,
    angles,
    blocked_at,
    costmaps,
    every_release,
    flags,
    footprints,
    free_map,
    make_setup,
    since_jazzy,
    speeds,
    straight,
    turns,
    wandering_paths,
)

REASON_OF = {"single": SINGLE_POSE, "off": OFF_COSTMAP, "collision": COLLISION_AHEAD}
KIND_OF = {"single": InvalidPath, "off": ControllerAbort, "collision": ControllerError}


class Says:
    """A goal checker that always says the same."""

    def __init__(self, arrived):
        self.arrived = arrived

    def is_position_reached(self, pose, local):
        return self.arrived


def setup_with(arrived, footprint=DISC):
    return dataclasses.replace(make_setup(footprint), goal_checker=Says(arrived))


def follower(path, footprint=DISC, arrived=False, **params):
    made = LyricalRppFollower(RppParams(release="lyrical", **params))
    made.reset(setup_with(arrived, footprint))
    made.take_local_plan(local_plan(path))
    return made


# --- Worked examples -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("window_v", "window_w", "curvature", "sign", "expected"),
    [
        ((0.1, 0.3), (-0.2, 0.2), 0.5, 1, (0.3, 0.15)),  # the top speed of the window lies on the curve
        ((0.1, 0.3), (-0.2, 0.1), 0.5, 1, (0.2, 0.1)),  # the turn rate limits it
        ((-0.3, -0.1), (-0.2, 0.2), 0.5, -1, (-0.3, -0.15)),  # backwards
        ((0.1, 0.3), (0.4, 0.6), 0.5, 1, (0.3, 0.4)),  # no common point: the nearest corner
        ((0.1, 0.3), (0.4, 0.6), 0.0, 1, (0.3, 0.4)),  # straight on: the turn rate nearest to 0
        ((0.1, 0.3), (-0.2, 0.2), 0.0, 1, (0.3, 0.0)),
        ((0.2, 0.2), (1.0, 1.005), 10.0, 1, (0.2, 1.005)),  # 0.0995 and 0.0990 away: the nearer corner
        ((-0.3, -0.1), (0.4, 0.6), 0.002, -1, (-0.1, 0.4)),  # 0.4006 and 0.4002 away: nearer, although slower
    ],
)
def test_the_fastest_command_of_a_window(window_v, window_w, curvature, sign, expected):
    assert command_on_curve((*window_v, *window_w), curvature, float(sign)) == pytest.approx(expected)
    assert fastest_on_line(window_v, window_w, curvature, sign) == pytest.approx(expected)


def test_the_window_lies_around_the_last_command():
    # 2.5 m/s^2 and 0.05 s: 0.125 m/s more a cycle, as fast as the regulated 0.5 m/s; after an action it starts from 0.
    made = follower(straight(), use_dynamic_window=True)
    driven = [made.compute_velocity_commands(ORIGIN, REST, free_map(), 0.0).v for _ in range(5)]
    assert driven == pytest.approx([0.125, 0.25, 0.375, 0.5, 0.5])
    made.end_action()
    assert made.compute_velocity_commands(ORIGIN, REST, free_map(), 0.0).v == pytest.approx(0.125)


def test_the_carrot_is_found_by_arc_length():
    corner = [(0.0, 0.0, 0.0), (0.4, 0.0, 0.0), (0.4, 1.0, 0.0)]
    made = follower(corner, use_rotate_to_heading=False)
    made.compute_velocity_commands(ORIGIN, REST, free_map(), 0.0)
    assert made.carrot == pytest.approx((0.4, 0.2))  # lookahead 0.6 m


def test_a_distance_to_obstacles_is_looked_at_beyond_the_carrot():
    # The wall is 0.80 m ahead: beyond the second that is checked by default, within 0.7 m of driving from the centre.
    wall = blocked_at(0.8)
    assert follower(straight()).compute_velocity_commands(ORIGIN, REST, wall, 0.0).v == 0.5
    scaled = {"use_velocity_scaled_lookahead_dist": True, "min_lookahead_dist": 0.3, "max_lookahead_dist": 0.9}
    with pytest.raises(ControllerError, match="collision ahead"):
        follower(straight(), min_distance_to_obstacle=0.7, **scaled).compute_velocity_commands(ORIGIN, REST, wall, 0.0)
    short = straight(0.41)
    beyond = {"min_distance_to_obstacle": 0.7, "approach_velocity_scaling_dist": 0.2, **scaled}
    assert follower(short, **beyond).compute_velocity_commands(ORIGIN, REST, wall, 0.0).v == 0.5
    checked = follower(short, allow_obstacle_checking_beyond_goal=True, **beyond)
    with pytest.raises(ControllerError, match="collision ahead"):
        checked.compute_velocity_commands(ORIGIN, REST, wall, 0.0)


def test_a_path_of_one_pose_is_refused_only_with_a_second_carrot_beyond_its_end():
    # Without the second carrot Nav2 switches the interpolation off, with a warning (parameter_handler.cpp).
    made = follower([(0.5, 0.0, 0.0)], interpolate_curvature_after_goal=True)
    assert made.compute_velocity_commands(ORIGIN, REST, free_map(), 0.0).v > 0.0
    second = {"interpolate_curvature_after_goal": True, "use_fixed_curvature_lookahead": True}
    with pytest.raises(InvalidPath, match="length of one"):
        follower([(0.5, 0.0, 0.0)], **second).compute_velocity_commands(ORIGIN, REST, free_map(), 0.0)


def test_at_the_goal_it_turns_when_the_goal_checker_says_so():
    path = [(0.0, 0.0, 0.0), (0.2, 0.0, -1.0)]
    assert follower(path).compute_velocity_commands(ORIGIN, REST, free_map(), 0.0).v > 0.0
    command = follower(path, arrived=True).compute_velocity_commands(ORIGIN, REST, free_map(), 0.0)
    assert command == pytest.approx((0.0, -0.16))


# --- For any input ---------------------------------------------------------------------------------------------------

options = st.fixed_dictionaries(
    {
        **every_release,
        **since_jazzy,
        "use_dynamic_window": flags,
        "min_distance_to_obstacle": st.sampled_from([-1.0, 0.5, 1.5]),
        "allow_obstacle_checking_beyond_goal": flags,
        "min_linear_vel": st.sampled_from([-0.5, 0.1]),
        "max_angular_vel": st.sampled_from([0.0, 2.5]),
        "min_angular_vel": st.sampled_from([-2.5, 0.1]),
        "max_linear_decel": st.sampled_from([-2.5, -0.5]),
        "max_angular_decel": st.sampled_from([-3.2, -1.0]),
    }
)


@settings(max_examples=400, deadline=None)
@given(wandering_paths(), costmaps(), options, footprints, flags, angles, speeds, turns)
def test_kernels_do_what_the_plain_twin_does(path, costmap, params, footprint, arrived, yaw, v, w):
    made = follower(path, footprint, arrived, **params)
    twin = PlainLyricalRpp(made.params, make_setup(footprint), path)
    made.last_command, twin.last = Twist(v, w), (v, w)
    pose = Pose(0.0, 0.0, yaw)
    for _ in range(3):
        expected = twin(pose, (v, w), arrived, costmap)
        if expected in REASON_OF:
            with pytest.raises(KIND_OF[expected], match=re.escape(REASONS[REASON_OF[expected]])):
                made.compute_velocity_commands(pose, Twist(v, w), costmap, 0.0)
        else:
            assert made.compute_velocity_commands(pose, Twist(v, w), costmap, 0.0) == pytest.approx(expected, abs=1e-9)
        if twin.carrot is not None:
            assert made.carrot == pytest.approx(twin.carrot, abs=1e-9)
        pose = Pose(pose.x + 0.3, pose.y + 0.1, yaw)


bounds = st.tuples(st.floats(-1, 1), st.floats(-1, 1)).map(sorted).map(tuple)


@settings(max_examples=400, deadline=None)
@given(bounds, bounds, st.floats(-5, 5), st.sampled_from([-1, 1]))
def test_the_fastest_command_is_in_the_window(window_v, window_w, curvature, sign):
    v, w = command_on_curve((*window_v, *window_w), curvature, float(sign))
    assert window_v[0] - 1e-9 <= v <= window_v[1] + 1e-9
    assert window_w[0] - 1e-9 <= w <= window_w[1] + 1e-9
    shares = np.linspace(0.0, 1.0, 21)
    reachable = window_v[0] + shares * (window_v[1] - window_v[0])
    on_curve = [each for each in reachable if window_w[0] <= curvature * each <= window_w[1]]
    if on_curve and abs(curvature) >= 1e-3:
        assert v * sign >= max(each * sign for each in on_curve) - 1e-9


@settings(max_examples=100, deadline=None)
@given(wandering_paths(), st.floats(0.0, 1.5), flags)
def test_the_carrot_lies_at_its_arc_length(path, length, beyond):
    local = [tuple(pose) for pose in path.tolist()]
    if len(local) == 1:
        return
    x, y = point_at(local, length, beyond)
    whole = float(np.hypot(*np.diff(path[:, :2], axis=0).T).sum())
    missing = max(0.0, length - whole)
    assert math.dist((x, y), local[0][:2]) <= length + 1e-9
    if missing:
        assert math.dist((x, y), local[-1][:2]) == pytest.approx(missing if beyond else 0.0, abs=1e-9)
