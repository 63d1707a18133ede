"""RPP: the worked examples T6 of the reference, a plain twin, and what must hold for any input."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from controllers.base import ControllerAbort, ControllerError, FollowerSetup, InvalidPath, Twist
from controllers.rpp import regulation
from controllers.rpp.controller import REASONS, RppFollower
from controllers.rpp.kernels import COLLISION_AHEAD, EMPTY_PLAN, OFF_COSTMAP, SINGLE_POSE
from controllers.rpp.params import RENAMED_KEYS, ROS_ONLY_KEYS, RppParams
from gym_mapbench.costmap import Costmap
from gym_mapbench.errors import ConfigError
from gym_mapbench.world.footprint import Footprint
from gym_mapbench.world.scenario import Pose
from tests.controllers.plain_rpp import PlainRpp

ORIGIN = Pose(0.0, 0.0, 0.0)
REST = Twist(0.0, 0.0)
DISC = Footprint.from_radius(0.22)


def make_setup(footprint=DISC, xy_goal_tolerance=0.25):
    return FollowerSetup(footprint, 0.05, xy_goal_tolerance, 0.25, 0.55, 3.0, np.random.default_rng(0))


def free_map(cost_at_robot=0, size=200, resolution=0.05, track_unknown=False):
    costs = np.zeros((size, size), dtype=np.uint8)
    half = size * resolution / 2
    costs[size // 2, size // 2] = cost_at_robot
    return Costmap(costs, resolution, -half, -half, track_unknown)


def follower(path, footprint=DISC, xy_goal_tolerance=0.25, **params):
    made = RppFollower(RppParams(**params))
    made.reset(make_setup(footprint, xy_goal_tolerance))
    path = np.asarray(path, dtype=float)
    made.set_plan(path if path.shape[1] == 3 else np.column_stack([path, np.zeros(len(path))]))
    return made


def drive_to(carrot, cost=0, **params):
    """Command with the carrot at a point of the robot frame and a long way to go behind it."""
    x, y = carrot
    lookahead = math.hypot(x, y) - 1e-9
    made = follower([(0, 0), carrot, (x + 3, y)], lookahead_dist=lookahead, use_interpolation=False, **params)
    command = made.compute_velocity_commands(ORIGIN, REST, free_map(cost), 0.0)
    assert made.carrot == pytest.approx(carrot)
    return command


# --- T6, in the order of the reference -------------------------------------------------------------------------------


def test_t6_1_curvature():
    assert regulation.curvature_to(0.5, 0.2) == pytest.approx(1.37931, abs=1e-5)
    assert drive_to((0.5, 0.2)) == pytest.approx((0.402778, 0.555556), abs=1e-6)
    assert drive_to((0.3, 0.4)) == pytest.approx((0.0, 0.16))
    assert drive_to((0.3, 0.4), use_rotate_to_heading=False) == pytest.approx((0.25, 0.8))


@pytest.mark.parametrize(
    ("carrot", "cost", "expected"),
    [
        ((0.6, 0.0), 100, (0.444654, 0.0)),
        ((0.55, 0.2), 200, (0.252113, 0.294439)),
        ((0.6, 0.0), 253, (0.25, 0.0)),
        ((0.6, 0.0), 40, (0.5, 0.0)),
    ],
)
def test_t6_2_cost(carrot, cost, expected):
    assert drive_to(carrot, cost) == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize(("remaining", "speed"), [(0.2, 0.166667), (0.04, 0.05)])
def test_t6_3_approach(remaining, speed):
    made = follower([(0, 0), (remaining, 0)], xy_goal_tolerance=0.01)
    assert made.compute_velocity_commands(ORIGIN, REST, free_map(), 0.0).v == pytest.approx(speed, abs=1e-6)


def test_t6_4_interpolation():
    point = regulation.circle_segment_intersection(0.5, 0.1, 0.7, 0.2, 0.6)
    assert point == pytest.approx((0.583068, 0.141534), abs=1e-6)


@pytest.mark.parametrize(
    ("angle", "turn_rate", "expected"),
    [(1.0, 0.0, 0.16), (1.0, 1.7, 1.8), (-1.0, 0.5, 0.34), (0.2, 1.8, 1.131371), (0.1, 1.0, 0.8)],
)
def test_t6_5_rotation(angle, turn_rate, expected):
    assert regulation.rotation_speed(angle, turn_rate, 1.8, 3.2, 0.05) == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize(
    ("command", "radius", "step", "poses", "reach"),
    [((0.5, 0.3), 0.234142, 0.1, 9, 0.45), ((0.0, 1.8), 0.234142, 0.118411, 8, 1.705)],
)
def test_t6_5_collision_steps(command, radius, step, poses, reach):
    tau = regulation.projection_step(*command, 0.05, radius)
    assert tau == pytest.approx(step, abs=1e-6)
    assert sum(i * tau < 1.0 for i in range(1, 100)) == poses
    assert poses * tau * max(command) == pytest.approx(reach, abs=1e-3)


# --- Jazzy: its examples that need no recorded map -------------------------------------------------------------------


def test_jazzy_carrots_and_speeds():
    # 1 and 2 of the reference: the carrot at exactly the lookahead distance, its curvature, the command.
    for (x, y), curvature, v, w in (
        ((0.550836, 0.237866), 1.321478, 0.420405, 0.555556),
        ((0.597695, 0.052541), 0.291893, 0.5, 0.145947),
        ((0.515807, 0.306502), 1.702789, 0.326262, 0.555556),
    ):
        assert regulation.curvature_to(x, y) == pytest.approx(curvature, abs=2e-5)
        made = follower([(0, 0), (x / 2, y / 2), (2 * x, 2 * y), (5, 0)], release="jazzy")
        command = made.compute_velocity_commands(ORIGIN, REST, free_map(), 0.0)
        assert made.carrot == pytest.approx((x, y), abs=2e-6)
        assert command == pytest.approx((v, w), abs=2e-5)
    assert regulation.rotation_speed(1.0, -0.645380, 1.8, 3.2, 0.05) == pytest.approx(-0.485380)


def test_jazzy_4_cost():
    beyond = regulation.cost_limited(1.0, 100, 253.0, 0.225498, 3.0, 1.0, 1.0)
    assert beyond == pytest.approx(0.534905, abs=1e-6)
    assert regulation.cost_limited(1.0, 100, 252.0, 0.225498, 3.0, 1.0, 1.0) == pytest.approx(0.533585, abs=1e-6)
    made = follower([(0, 0), (0.3, 0), (4, 0)], release="jazzy")
    assert made.compute_velocity_commands(ORIGIN, REST, free_map(200), 0.0).v == pytest.approx(0.253211, abs=3e-6)


def test_jazzy_turns_to_the_goal_until_the_next_path():
    path = [(0.0, 0.0, 1.0), (0.05, 0.0, 1.0), (0.2, 0.0, 1.0)]

    def commands(ends=False, **params):
        made = follower(path, release="jazzy", use_collision_detection=False, **params)
        first = made.compute_velocity_commands(ORIGIN, REST, free_map(), 0.0)
        if ends:
            made.end_action()
        return first, made.compute_velocity_commands(Pose(-0.2, 0.0, 0.0), REST, free_map(), 0.0)

    assert [command.v for command in commands()] == [0.0, 0.0]
    assert commands(stateful=False)[1].v > 0.0
    assert commands(ends=True)[1].v > 0.0


def test_jazzy_keeps_a_segment_of_the_plan():
    made = follower([(-2, 0), (-1, 0), (0, 0.0)], release="jazzy", use_rotate_to_heading=False)
    made.compute_velocity_commands(Pose(0.3, 0.0), REST, free_map(), 0.0)
    assert made._begin == 1
    made = follower([(-2, 0), (-1, 0), (0, 0.0)], use_rotate_to_heading=False)
    made.compute_velocity_commands(Pose(0.3, 0.0), REST, free_map(), 0.0)
    assert made._begin == 2


# --- What the examples leave open ------------------------------------------------------------------------------------


def blocked_at(distance):
    """A free map with a wall across the way, its near side at ``distance`` from the robot."""
    costmap = free_map()
    costmap.costs[:, 100 + round(distance / 0.05)] = 254
    return costmap


def straight(length=4.0, spacing=0.025):
    xs = np.arange(0, length, spacing)
    return np.column_stack([xs, np.zeros_like(xs), np.zeros_like(xs)])


def shifted(path, dx, dy=0.0):
    return path + np.array([dx, dy, 0.0])


def test_the_arc_is_checked_for_one_second_only():
    # Nine steps take the front to 0.45 + 0.23 m: into the column from 0.65 m on, not into the next.
    with pytest.raises(ControllerError, match="collision ahead"):
        follower(straight()).compute_velocity_commands(ORIGIN, REST, blocked_at(0.65), 0.0)
    assert follower(straight()).compute_velocity_commands(ORIGIN, REST, blocked_at(0.70), 0.0).v == 0.5


def test_the_arc_is_checked_up_to_the_carrot_only():
    near = follower(straight(), lookahead_dist=0.42, use_interpolation=False)
    assert near.compute_velocity_commands(ORIGIN, REST, blocked_at(0.65), 0.0).v > 0
    assert math.hypot(*near.carrot) == pytest.approx(0.425)


def test_collision_check_can_be_switched_off():
    made = follower(straight(), use_collision_detection=False)
    assert made.compute_velocity_commands(ORIGIN, REST, blocked_at(0.10), 0.0).v == 0.5


def test_a_long_robot_may_not_turn_into_a_wall():
    long = Footprint.from_corners(np.array([[0.5, 0.1], [-0.1, 0.1], [-0.1, -0.1], [0.5, -0.1]]))
    costmap = free_map()
    costmap.costs[100 + 7, :] = 254
    path = [(0, 0), (0, 1), (0, 2)]
    with pytest.raises(ControllerError, match="collision ahead"):
        follower(path, long).compute_velocity_commands(ORIGIN, Twist(0.0, 1.0), costmap, 0.0)
    assert follower(path).compute_velocity_commands(ORIGIN, Twist(0.0, 1.0), costmap, 0.0).w == pytest.approx(1.16)


def test_unknown_blocks_only_where_it_is_not_tracked():
    for track_unknown in (False, True):
        costmap = free_map(track_unknown=track_unknown)
        costmap.costs[:, 110:] = 255
        made = follower(straight())
        if track_unknown:
            assert made.compute_velocity_commands(ORIGIN, REST, costmap, 0.0).v == 0.5
        else:
            with pytest.raises(ControllerError, match="collision ahead"):
                made.compute_velocity_commands(ORIGIN, REST, costmap, 0.0)


def test_errors_are_worded_as_in_nav2():
    with pytest.raises(ControllerError, match="0 poses"):
        follower(np.empty((0, 3))).compute_velocity_commands(ORIGIN, REST, free_map(), 0.0)
    with pytest.raises(ControllerError, match="0 poses"):
        follower([(50, 0), (51, 0)]).compute_velocity_commands(ORIGIN, REST, free_map(), 0.0)
    away = Pose(20.0, 0.0, 0.0)
    with pytest.raises(ControllerError, match="Dimensions of the costmap are too small"):
        follower(shifted(straight(), 20.0)).compute_velocity_commands(away, REST, free_map(), 0.0)


def test_the_carrot_is_known_even_when_the_way_is_blocked():
    made = follower(straight(), lookahead_dist=0.6)
    assert np.isnan(made.carrot).all()
    with pytest.raises(ControllerError):
        made.compute_velocity_commands(ORIGIN, REST, blocked_at(0.3), 0.0)
    assert made.carrot == pytest.approx((0.6, 0.0))


def test_poses_behind_the_nearest_are_gone_for_good():
    made = follower(straight(), max_robot_pose_search_dist=1.0)
    made.compute_velocity_commands(Pose(0.9, 0.0, 0.0), REST, free_map(), 0.0)
    made.compute_velocity_commands(Pose(1.8, 0.0, 0.0), REST, free_map(), 0.0)
    made.compute_velocity_commands(ORIGIN, REST, free_map(), 0.0)
    assert made.carrot == pytest.approx((1.8, 0.0), abs=0.03)
    made.set_plan(straight())
    made.compute_velocity_commands(ORIGIN, REST, free_map(), 0.0)
    assert made.carrot == pytest.approx((0.6, 0.0))


def test_the_search_for_the_nearest_pose_ends_with_its_distance():
    there_and_back = np.concatenate([straight(2.0), shifted(straight(2.0)[::-1], 0.0, 0.2)])
    pose = Pose(0.5, 0.2, math.pi)
    for search_dist, carrot in ((1.0, (-0.566, 0.2)), (-1.0, (0.5, 0.0))):
        made = follower(there_and_back, max_robot_pose_search_dist=search_dist, use_rotate_to_heading=False)
        made.compute_velocity_commands(pose, REST, free_map(), 0.0)
        assert made.carrot == pytest.approx(carrot, abs=1e-3)


def test_lookahead_scales_with_the_speed():
    for speed, lookahead in ((0.0, 0.3), (0.3, 0.45), (-0.3, 0.45), (2.0, 0.9)):
        made = follower(straight(), use_velocity_scaled_lookahead_dist=True)
        made.compute_velocity_commands(ORIGIN, Twist(speed, 0.0), free_map(), 0.0)
        assert made.carrot == pytest.approx((lookahead, 0.0))


def test_reversing_stops_at_the_cusp_and_goes_on_backwards():
    forwards = straight(0.41)
    path = np.concatenate([forwards, forwards[::-1][1:], -straight(1.0)[1:]])
    options = {"allow_reversing": True, "use_rotate_to_heading": False}
    made = follower(path, **options)
    assert made.compute_velocity_commands(ORIGIN, REST, free_map(), 0.0).v == 0.5
    assert made.carrot == pytest.approx((0.4, 0.0))
    command = follower(path[17:], **options).compute_velocity_commands(Pose(0.38, 0.0, 0.0), REST, free_map(), 0.0)
    assert command == pytest.approx((-0.5, 0.0))


def test_rotating_to_the_heading_switches_reversing_off():
    made = follower(straight()[::-1] * [-1, 1, 1], allow_reversing=True)
    made.set_plan(-straight())
    command = made.compute_velocity_commands(ORIGIN, REST, free_map(), 0.0)
    assert command.v == 0.0
    assert abs(command.w) == pytest.approx(0.16)


def test_at_the_goal_it_turns_to_the_last_heading():
    path = np.array([(0.0, 0.0, 0.0), (0.1, 0.0, -1.0)])
    command = follower(path).compute_velocity_commands(Pose(0.0, 0.0, 0.5), REST, free_map(), 0.0)
    assert command == pytest.approx((0.0, -0.16))


def test_speed_limit():
    made = follower(straight())
    limits = (((50.0, True), 0.25), ((0.4, False), 0.4), ((0.8, False), 0.8), ((0.0, False), 0.5), ((0.0, True), 0.5))
    for limit, speed in limits:
        made.set_speed_limit(*limit)
        assert made.compute_velocity_commands(ORIGIN, REST, free_map(), 0.0).v == pytest.approx(speed)
    made.set_speed_limit(0.3)
    made.reset(make_setup())
    made.set_plan(straight())
    assert made.compute_velocity_commands(ORIGIN, REST, free_map(), 0.0).v == 0.5


def test_reset_forgets_the_plan():
    made = follower(straight())
    made.reset(make_setup())
    with pytest.raises(ControllerError, match="0 poses"):
        made.compute_velocity_commands(ORIGIN, REST, free_map(), 0.0)


def test_parameters_are_checked():
    with pytest.raises(ConfigError, match="did you mean 'lookahead_dist'"):
        RppParams(lookahead_distance=1.0)
    with pytest.raises(ConfigError, match="cost_scaling_dist"):
        RppParams(cost_scaling_dist=0.0)
    known = set(RppParams.model_fields)
    for elsewhere in (ROS_ONLY_KEYS, RENAMED_KEYS):
        assert known.isdisjoint(elsewhere)
    assert set(RppParams.DEFAULTS["jazzy"]) <= known
    assert set(RENAMED_KEYS.values()) <= known


# --- For any input ---------------------------------------------------------------------------------------------------

angles = st.floats(-math.pi, math.pi)
flags = st.booleans()


@st.composite
def wandering_paths(draw):
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    n = draw(st.integers(1, 80))
    heading = np.cumsum(rng.normal(0, draw(st.sampled_from([0.05, 0.4, 2.0])), n))
    steps = rng.uniform(0.01, 0.1, n)[:, None] * np.stack([np.cos(heading), np.sin(heading)], axis=1)
    return np.column_stack([np.cumsum(steps, axis=0) + rng.uniform(-0.3, 0.3, 2), rng.uniform(-3.1, 3.1, n)])


@st.composite
def costmaps(draw):
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    costs = rng.integers(0, 254, (60, 60)).astype(np.uint8)
    costs[rng.random((60, 60)) < draw(st.sampled_from([0.0, 0.002, 0.02]))] = 254
    costs[rng.random((60, 60)) < draw(st.sampled_from([0.0, 0.01]))] = 255
    costs[rng.random((60, 60)) < 0.5] = 0
    return Costmap(costs, 0.05, -1.5, -1.5, draw(flags))


every_release = {
    "lookahead_dist": st.sampled_from([0.3, 0.6]),
    "use_velocity_scaled_lookahead_dist": flags,
    "use_rotate_to_heading": flags,
    "approach_velocity_scaling_dist": st.sampled_from([0.0, 0.4, 1.0]),
    "use_collision_detection": flags,
    "use_regulated_linear_velocity_scaling": flags,
    "use_cost_regulated_linear_velocity_scaling": flags,
    "allow_reversing": flags,
}
distances = st.sampled_from([None, -1.0, 0.5, 10.0])
options = st.fixed_dictionaries({**every_release, "use_interpolation": flags, "max_robot_pose_search_dist": distances})
footprints = st.sampled_from(
    [DISC, Footprint.from_corners(np.array([[0.3, 0.1], [-0.2, 0.1], [-0.2, -0.1], [0.3, -0.1]]))]
)


since_jazzy = {
    "use_fixed_curvature_lookahead": flags,
    "curvature_lookahead_dist": st.sampled_from([0.3, 0.9]),
    "interpolate_curvature_after_goal": flags,
}
jazzy_options = st.fixed_dictionaries({**since_jazzy, "stateful": flags})
speeds, turns = st.floats(-0.6, 0.6), st.floats(-2, 2)


@settings(max_examples=400, deadline=None)
@given(wandering_paths(), costmaps(), options, footprints, angles, speeds, turns)
def test_kernels_do_what_the_plain_twin_does(path, costmap, params, footprint, yaw, v, w):
    compare(path, costmap, params, footprint, yaw, v, w)


@settings(max_examples=400, deadline=None)
@given(wandering_paths(), costmaps(), options, jazzy_options, footprints, angles, speeds, turns)
def test_jazzys_kernels_do_what_the_plain_twin_does(path, costmap, params, more, footprint, yaw, v, w):
    del params["use_interpolation"]
    path = np.repeat(path, 1 + (np.arange(len(path)) % 7 == 3), axis=0)  # places with two headings
    path[1:, 2] += np.where((np.diff(path[:, :2], axis=0) == 0).all(axis=1), 1.0, 0.0)
    compare(path, costmap, {**params, **more, "release": "jazzy"}, footprint, yaw, v, w)


def compare(path, costmap, params, footprint, yaw, v, w):
    made = follower(path, footprint, **params)
    twin = PlainRpp(made.params, make_setup(footprint), path)
    reasons = {"empty": EMPTY_PLAN, "single": SINGLE_POSE, "off": OFF_COSTMAP, "collision": COLLISION_AHEAD}
    humble = params.get("release", "humble") == "humble"
    kinds = {"empty": InvalidPath, "single": InvalidPath, "off": ControllerAbort}
    pose = Pose(0.0, 0.0, yaw)
    for _ in range(3):
        expected = twin(pose, (v, w), costmap)
        if expected in reasons:
            kind = ControllerError if humble else kinds.get(expected, ControllerError)
            with pytest.raises(kind, match=re.escape(REASONS[reasons[expected]])) as raised:
                made.compute_velocity_commands(pose, Twist(v, w), costmap, 0.0)
            assert raised.type is kind
        else:
            command = made.compute_velocity_commands(pose, Twist(v, w), costmap, 0.0)
            assert command == pytest.approx(expected, abs=1e-9)
        if twin.carrot is not None:
            assert made.carrot == pytest.approx(twin.carrot, abs=1e-9)
        pose = Pose(pose.x + 0.3, pose.y + 0.1, yaw)


@settings(max_examples=60, deadline=None)
@given(wandering_paths(), angles, st.floats(-5, 5), st.floats(-5, 5))
def test_the_command_does_not_depend_on_where_the_world_begins(path, turn, dx, dy):
    cos, sin = math.cos(turn), math.sin(turn)
    moved = np.column_stack([path[:, :2] @ [[cos, sin], [-sin, cos]] + [dx, dy], path[:, 2] + turn])
    here = follower(path, max_robot_pose_search_dist=-1.0)
    there = follower(moved, max_robot_pose_search_dist=-1.0)
    command = here.compute_velocity_commands(ORIGIN, REST, free_map(size=800), 0.0)
    assert there.compute_velocity_commands(Pose(dx, dy, turn), REST, free_map(size=800), 0.0) == pytest.approx(
        command, abs=1e-6
    )
    assert abs(command.v) <= 0.5


@settings(max_examples=100, deadline=None)
@given(st.floats(0, 0.999), angles, st.floats(1.0, 3.0), angles)
def test_an_interpolated_carrot_lies_on_its_segment_at_the_lookahead_distance(r1, a1, r2, a2):
    x1, y1, x2, y2 = r1 * math.cos(a1), r1 * math.sin(a1), r2 * math.cos(a2), r2 * math.sin(a2)
    x, y = regulation.circle_segment_intersection(x1, y1, x2, y2, 1.0)
    assert math.hypot(x, y) == pytest.approx(1.0, abs=1e-9)
    along = math.hypot(x - x1, y - y1) + math.hypot(x2 - x, y2 - y)
    assert along == pytest.approx(math.hypot(x2 - x1, y2 - y1), abs=1e-6)
