"""Graceful: worked examples, a plain twin, what must hold for any input, and how it drives."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from controllers.base import ControllerError, InvalidPath
from controllers.graceful.controller import REASONS, GracefulFollower
from controllers.graceful.kernels.following import COLLISION, EMPTY_PLAN
from controllers.graceful.params import GracefulParams
from gym_mapbench.costmap import Costmap
from gym_mapbench.errors import ConfigError
from gym_mapbench.world.footprint import Footprint
from gym_mapbench.world.scenario import Pose
from tests.controllers.plain_graceful import PlainGraceful
from tests.controllers.test_rpp import (
    DISC,
    ORIGIN,
    REST,
    angles,
    blocked_at,
    costmaps,
    flags,
    free_map,
    make_setup,
    shifted,
    straight,
    wandering_paths,
)

BOX = Footprint.from_corners(np.array([[0.3, 0.1], [-0.2, 0.1], [-0.2, -0.1], [0.3, -0.1]]))
RELEASES = ("humble", "jazzy")
each_release = pytest.mark.parametrize("release", RELEASES)


def follower(path, footprint=DISC, **params):
    made = GracefulFollower(GracefulParams(**params))
    made.reset(make_setup(footprint))
    made.set_plan(np.asarray(path, dtype=float))
    return made


def command_of(made, pose=ORIGIN, costmap=None):
    return made.compute_velocity_commands(pose, REST, costmap or free_map(), 0.0)


def one_target(x, y, heading, **params):
    """Command with one target at a pose of the robot's frame, a long way before the goal."""
    path = [(0, 0, 0), (x, y, heading), (x, y + 9, heading - 1), (x, y + 9.05, 0)]
    reach = {"humble": {"motion_target_dist": 0.01 + math.hypot(x, y) / 2}, "jazzy": {"max_lookahead": 3.0}}
    return command_of(follower(path, **{**reach[params["release"]], **params}), costmap=free_map(size=800))


# --- Worked examples -------------------------------------------------------------------------------------------------


@each_release
def test_straight_ahead_it_slows_down_in_the_slowdown_radius(release):
    assert one_target(2.0, 0.0, 0.0, release=release) == pytest.approx((0.5, 0.0))
    assert one_target(0.6, 0.0, 0.0, release=release) == pytest.approx((0.5 * 0.6 / 1.5, 0.0))
    assert one_target(0.26, 0.0, 0.0, release=release) == pytest.approx((0.1, 0.0))


def test_the_law_by_hand():
    # r = 1, line of sight -0.3; phi = 0.2 - 0.3 = -0.1, delta = -0.3; k_phi 2, k_delta 1:
    # kappa = -[(-0.3 - atan(0.2)) + (1 + 2 / 1.04) sin(-0.3)] = 0.497396 + 0.863829 = 1.361224.
    v, w = one_target(math.cos(0.3), math.sin(0.3), 0.2, release="jazzy")
    assert w / v == pytest.approx(1.361224, abs=2e-6)
    assert v == pytest.approx(0.5 / (1 + 0.4 * 1.361224**2), abs=1e-6)
    # Humble, k_phi 3, k_delta 2: kappa = 2 (0.3 + atan(0.3)) + (1 + 3 / 1.09) sin 0.3 = 1.182914 + 1.108879.
    v, w = one_target(math.cos(0.3), math.sin(0.3), 0.2, release="humble")
    assert w / v == pytest.approx(2.291792, abs=2e-6)
    assert v == pytest.approx(0.5 / (1 + 0.2 * 2.291792**2), abs=1e-6)


def test_the_curve_is_kept_where_the_turn_rate_is_at_its_limit():
    fast = one_target(1.0, 0.5, -0.5, release="jazzy", beta=0.0)
    slow = one_target(1.0, 0.5, -0.5, release="jazzy", beta=0.0, v_angular_max=0.2)
    assert abs(slow.w) == 0.2
    assert slow.w / slow.v == pytest.approx(fast.w / fast.v)


def test_first_turn():
    # Half the bearing times v_angular_max; Jazzy's is at least 0.25.
    assert one_target(0.0, 1.0, 0.0, release="jazzy") == pytest.approx((0.0, math.pi / 4))
    assert one_target(0.0, -1.0, 0.0, release="humble") == pytest.approx((0.0, -math.pi / 4))
    slow = {"rotation_scaling_factor": 0.1}
    assert one_target(0.0, 1.0, 0.0, release="jazzy", **slow) == pytest.approx((0.0, 0.25))
    assert one_target(0.0, 1.0, 0.0, release="humble", **slow) == pytest.approx((0.0, 0.05 * math.pi))
    assert one_target(0.0, 1.0, 0.0, release="jazzy", initial_rotation=False).v > 0.0


def test_the_turn_at_the_goal():
    end = [(0.0, 0.0, 0.0), (0.1, 0.0, 0.0), (0.2, 0.0, -1.0)]
    for release in RELEASES:
        made = follower(end, release=release)
        assert command_of(made) == pytest.approx((0.0, -0.5))
        # Once there, it turns until the next path, wherever it is pushed.
        assert command_of(made, Pose(-0.3, 0.0, 0.0)) == pytest.approx((0.0, -0.5))
        made.set_plan(np.array(end))
        assert command_of(made, Pose(-0.3, 0.0, 0.0)) == pytest.approx((0.0, -0.5))
    assert command_of(follower(end, release="humble", final_rotation=False)).v > 0.0


def test_jazzy_turns_first_only_once_a_path():
    path = [(0.0, 0.0, 0.0), (0.5, 0.0, 0.0), (0.9, 0.0, 0.0), (5.0, 0.0, 0.0)]
    aside = Pose(0.0, 0.0, 1.5)
    made = {release: follower(path, release=release) for release in RELEASES}
    for release in RELEASES:
        assert command_of(made[release], aside).v == 0.0
        assert command_of(made[release]).v > 0.0
    assert command_of(made["humble"], aside).v == 0.0
    assert command_of(made["jazzy"], aside).v > 0.0
    made["jazzy"].set_plan(np.array(path))
    assert command_of(made["jazzy"], aside).v == 0.0


# --- What the examples leave open ------------------------------------------------------------------------------------


def test_jazzy_takes_the_farthest_target_it_can_reach():
    bend = [(0.05 * i, 0.0, 0.0) for i in range(12)] + [(0.55, 0.05 * i, 0.0) for i in range(1, 80)]
    free = command_of(follower(bend, release="jazzy"))
    costmap = free_map()
    costmap.costs[102:] = 254  # the way to the farthest target, but not to one before the bend
    nearer = command_of(follower(bend, release="jazzy"), costmap=costmap)
    assert free.w > 0.1
    assert nearer.w < free.w - 0.01
    short = command_of(follower(bend, release="jazzy", max_lookahead=0.5))
    assert short.w == pytest.approx(0.0, abs=1e-9)


def test_no_target_may_be_nearer_than_the_least_lookahead():
    wall = blocked_at(0.1)
    with pytest.raises(ControllerError, match="Collision detected in trajectory"):
        command_of(follower(straight(), release="jazzy"), costmap=wall)
    assert command_of(follower(straight(), release="jazzy", min_lookahead=0.1), costmap=wall).v == pytest.approx(0.1)


def test_humble_looks_at_one_target():
    command_of(follower(straight(), release="humble"), costmap=blocked_at(0.9))
    with pytest.raises(ControllerError, match="Collision detected in the trajectory"):
        command_of(follower(straight(), release="humble"), costmap=blocked_at(0.3))


@each_release
def test_a_disc_is_its_centre_and_another_shape_its_outline(release):
    costmap = free_map()
    costmap.costs[:, 102:] = 253
    with pytest.raises(ControllerError, match="Collision"):
        command_of(follower(straight(), release=release), costmap=costmap)
    command_of(follower(straight(), BOX, release=release), costmap=costmap)
    with pytest.raises(ControllerError, match="Collision"):
        command_of(follower(straight(), BOX, release=release), costmap=blocked_at(0.4))


@each_release
def test_unknown_blocks_only_where_it_is_not_tracked(release):
    for tracked in (False, True):
        costmap = free_map(track_unknown=tracked)
        costmap.costs[:, 102:] = 255
        if tracked:
            assert command_of(follower(straight(), release=release), costmap=costmap).v > 0.0
        else:
            with pytest.raises(ControllerError, match="Collision"):
                command_of(follower(straight(), release=release), costmap=costmap)


def test_headings_that_the_planner_did_not_set():
    # NavFn's path to the north-east, all headings 0 but the last: Jazzy drives straight on, Humble bends to heading 0.
    diagonal = np.array([(0.03 * i, 0.03 * i, 0.0) for i in range(100)])
    north_east = Pose(0.0, 0.0, math.pi / 4)
    assert command_of(follower(diagonal, release="jazzy"), north_east).w == pytest.approx(0.0, abs=1e-6)
    assert command_of(follower(diagonal, release="humble"), north_east).w > 0.3
    # Headings that differ are believed in both.
    diagonal[1:-1, 2] = 0.2 * (np.arange(98) % 2)
    diagonal[1, 2] = 0.4
    assert command_of(follower(diagonal, release="jazzy"), north_east).w > 0.1


@each_release
def test_backwards(release):
    heading = math.atan2(0.01, -0.05)
    behind = [(-0.05 * i, 0.01 * i, heading) for i in range(60)]
    path = {"release": release, "allow_backward": True}
    assert command_of(follower(behind, initial_rotation=False, **path)).v < 0.0
    assert command_of(follower(behind, **path)) == command_of(follower(behind, release=release))  # it turns first
    mirrored = [(-x, y, math.pi - yaw) for x, y, yaw in behind]
    forward = command_of(follower(mirrored, release=release, initial_rotation=False))
    backward = command_of(follower(behind, initial_rotation=False, **path))
    assert (-backward.v, -backward.w) == pytest.approx(forward, abs=1e-6)


@each_release
def test_speed_limit(release):
    def limited(*limit):
        made = follower(straight(), release=release, slowdown_radius=0.1)
        for each in limit:
            made.set_speed_limit(*each)
        return command_of(made).v

    assert limited() == 0.5
    assert limited((0.2,)) == pytest.approx(0.2)
    assert limited((40.0, True)) == pytest.approx(0.2)
    assert limited((0.01,)) == pytest.approx(0.1)  # v_linear_min
    assert limited((0.2,), (0.0,)) == 0.5


@each_release
def test_errors_are_of_the_release(release):
    kind = ControllerError if release == "humble" else InvalidPath
    for path in (np.empty((0, 3)), [(50.0, 0.0, 0.0), (51.0, 0.0, 0.0)]):
        with pytest.raises(kind, match="0 poses"):
            command_of(follower(path, release=release))


def outcome(made, pose):
    try:
        return "forward" if command_of(made, pose).w == pytest.approx(0.0, abs=1e-6) else "aside"
    except ControllerError as error:
        return str(error)


@pytest.mark.parametrize(
    ("release", "expected"), [("humble", "forward"), ("jazzy", REASONS["jazzy"][COLLISION])], ids=RELEASES
)
def test_a_moved_plan_is_the_same_plan(release, expected):
    here = follower(straight(), release=release, max_robot_pose_search_dist=1.0)
    there = follower(straight(), release=release, max_robot_pose_search_dist=1.0)
    command_of(here, Pose(0.9, 0.0))
    command_of(there, Pose(0.9, 0.0))
    there.move_plan(shifted(straight(), 0.0, 0.2))
    assert command_of(there, Pose(1.7, 0.25, 0.1)) == pytest.approx(command_of(here, Pose(1.7, 0.05, 0.1)))
    # What was behind is still gone: in Jazzy the rest is too far away to be a target.
    assert outcome(there, Pose(0.0, 0.2)) == outcome(here, ORIGIN) == expected


def test_parameters_of_the_other_release_are_refused():
    assert (GracefulParams().k_phi, GracefulParams(release="jazzy").k_phi) == (3.0, 2.0)
    assert getattr(GracefulParams(**{"lambda": 1.5}), "lambda") == 1.5
    with pytest.raises(ConfigError, match="min_lookahead: Nav2 Humble has no such parameter"):
        GracefulParams(min_lookahead=0.3)
    with pytest.raises(ConfigError, match="motion_target_dist: Nav2 Jazzy has no such parameter"):
        GracefulParams(release="jazzy", motion_target_dist=0.3)


# --- For any input ---------------------------------------------------------------------------------------------------

every_release = {
    "v_linear_min": st.sampled_from([0.0, 0.1]),
    "v_angular_max": st.sampled_from([0.3, 1.0]),
    "slowdown_radius": st.sampled_from([0.3, 1.5]),
    "initial_rotation": flags,
    "allow_backward": flags,
    "lambda": st.sampled_from([1.0, 2.0]),
}
options = {**every_release, "max_robot_pose_search_dist": st.sampled_from([None, -1.0, 0.5])}
humbles = st.fixed_dictionaries({**options, "final_rotation": flags, "motion_target_dist": st.sampled_from([0.3, 0.6])})
jazzys = st.fixed_dictionaries(
    {
        **options,
        "release": st.just("jazzy"),
        "prefer_final_rotation": flags,
        "min_lookahead": st.sampled_from([0.0, 0.25]),
        "max_lookahead": st.sampled_from([0.5, 1.0]),
    }
)


@st.composite
def paths(draw):
    """Paths with headings of their own, or with none, as NavFn's."""
    path = draw(wandering_paths())
    path[1:-1, 2] *= draw(st.sampled_from([0.0, 1.0]))
    return path


@settings(max_examples=300, deadline=None)
@given(paths(), costmaps(), st.one_of(humbles, jazzys), st.sampled_from([DISC, BOX]), angles)
def test_kernels_do_what_the_plain_twin_does(path, costmap, params, footprint, yaw):
    made = follower(path, footprint, **params)
    twin = PlainGraceful(made.params, make_setup(footprint), path)
    humble = made.params.release == "humble"
    kinds = {"empty": ControllerError if humble else InvalidPath, "collision": ControllerError}
    reasons = {"empty": EMPTY_PLAN, "collision": COLLISION}
    pose = Pose(0.0, 0.0, yaw)
    costmap = Costmap(np.where(costmap.costs == 253, 0, costmap.costs), *_place(costmap))
    for _ in range(3):
        expected = twin(pose, costmap)
        if expected in reasons:
            with pytest.raises(kinds[expected], match=re.escape(REASONS[made.params.release][reasons[expected]])):
                command_of(made, pose, costmap)
        else:
            assert command_of(made, pose, costmap) == pytest.approx(expected, abs=1e-5)
        pose = Pose(pose.x + 0.3, pose.y + 0.1, yaw)


def _place(costmap):
    return costmap.resolution, costmap.origin_x, costmap.origin_y, costmap.track_unknown_space


@settings(max_examples=60, deadline=None)
@given(paths(), angles, st.floats(-5, 5), st.floats(-5, 5), st.sampled_from(RELEASES))
def test_commands_keep_the_limits(path, turn, x, y, release):
    made = follower(path, release=release)
    try:
        v, w = command_of(made, Pose(x, y, turn), free_map(size=800))
    except (ControllerError, InvalidPath):
        return
    assert 0.0 <= v <= 0.5
    assert abs(w) <= max(1.0, 0.5 * math.pi)
