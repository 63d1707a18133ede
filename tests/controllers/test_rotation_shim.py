"""The Rotation Shim: worked examples, what it leaves to the other controller, and a plain twin."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from controllers.base import ControllerError, LocalPlan, Twist
from controllers.nav2_params.plugins import CONTROLLERS, PRIMARIES, SHIMS
from controllers.registry import FOLLOWERS
from controllers.rotation_shim.controller import RotationShimFollower
from controllers.rotation_shim.lyrical import make_shim
from controllers.rotation_shim.params import RotationShimParams
from gym_mapbench.errors import ConfigError
from gym_mapbench.world.footprint import Footprint
from gym_mapbench.world.scenario import Pose
from tests.controllers.plain_rotation_shim import PlainRotationShim
from tests.controllers.test_rpp import DISC, ORIGIN, costmaps, flags, free_map, make_setup, shifted, straight
from tests.controllers.test_rpp_lyrical import Says

BAR = Footprint.from_corners(np.array([[0.6, 0.1], [-0.2, 0.1], [-0.2, -0.1], [0.6, -0.1]]))
RELEASES = ("humble", "jazzy")
each_release = pytest.mark.parametrize("release", RELEASES)
FOLLOWED = Twist(0.3, 0.7)


class Primary:
    """Follows any path with one command, and remembers what it was told."""

    def __init__(self, params):
        self.told = []

    def reset(self, setup):
        self.told = ["reset"]

    def set_plan(self, path):
        self.told.append(("set_plan", len(path)))

    def move_plan(self, path):
        self.told.append(("move_plan", len(path)))

    def end_action(self):
        self.told.append("end_action")

    def compute_velocity_commands(self, pose, velocity, costmap, now):
        if velocity.v < 0:
            raise ControllerError("cannot")
        return FOLLOWED


def shim(path=None, footprint=DISC, **params):
    made = RotationShimFollower(Primary, RotationShimParams(**params))
    made.reset(make_setup(footprint))
    if path is not None:
        made.set_plan(np.asarray(path, dtype=float))
    return made


def command_of(made, yaw=0.0, w=0.0, costmap=None, x=0.0):
    return made.compute_velocity_commands(Pose(x, 0.0, yaw), Twist(0.0, w), costmap or free_map(), 0.0)


# --- Worked examples -------------------------------------------------------------------------------------------------


@each_release
def test_it_turns_towards_a_path_that_begins_aside(release):
    made = shim(straight(), release=release)
    # 3.2 rad/s^2 over one period of 0.05 s, towards the path, up to 1.8 rad/s.
    assert command_of(made, yaw=1.0) == pytest.approx((0.0, -0.16))
    assert command_of(made, yaw=-1.0, w=0.5) == pytest.approx((0.0, 0.66))
    assert command_of(made, yaw=3.0, w=1.75) == pytest.approx((0.0, 1.59))
    assert command_of(made, yaw=-3.0, w=1.75) == pytest.approx((0.0, 1.8))


def test_the_recorded_example_of_jazzy():
    # Bearing 2.331701, measured -0.523298: -0.363298.
    assert command_of(shim(straight(), release="jazzy"), yaw=-2.331701, w=-0.523298).w == pytest.approx(-0.363298)


def test_a_turn_ends_at_the_disengage_threshold_and_stays_ended():
    for release, ends in (("humble", 0.785), ("jazzy", 0.3925)):
        made = shim(straight(), release=release)
        assert command_of(made, yaw=0.79).v == 0.0
        assert command_of(made, yaw=ends + 0.001).v == 0.0
        assert command_of(made, yaw=ends - 0.001) == FOLLOWED
        assert command_of(made, yaw=2.0) == FOLLOWED  # until the next path
        made.set_plan(straight())
        assert command_of(made, yaw=0.78) == FOLLOWED
        made.set_plan(straight())
        assert command_of(made, yaw=2.0).v == 0.0


def test_jazzy_does_not_overshoot():
    small = {"angular_dist_threshold": 0.01, "angular_disengage_threshold": 0.01}
    assert command_of(shim(straight(), **small), yaw=-0.02, w=1.0).w == pytest.approx(1.16)
    jazzy = command_of(shim(straight(), release="jazzy", **small), yaw=-0.02, w=1.0)
    assert jazzy.w == pytest.approx(math.sqrt(2 * 3.2 * 0.02))


def test_which_point_of_the_path_counts():
    corner = [(0.1 * i, 0.0, 0.3) for i in range(4)] + [(0.3, 0.1 * i, 0.3) for i in range(1, 40)]
    # The first pose 0.5 m from the path's first is (0.3, 0.4).
    made = shim(corner, angular_dist_threshold=0.0, closed_loop=False)
    assert made._angle_to_path(ORIGIN) == pytest.approx(math.atan2(0.4, 0.3))
    assert made._angle_to_path(Pose(0.1, 0.0, 0.5)) == pytest.approx(math.atan2(0.4, 0.2) - 0.5)
    assert shim(corner, release="jazzy", use_path_orientations=True)._angle_to_path(ORIGIN) == pytest.approx(0.3)
    # A path shorter than that: Humble hands over, Jazzy takes the goal.
    short = shifted(straight(0.3), 0.0)
    assert command_of(shim(short), yaw=2.0) == FOLLOWED
    assert command_of(shim(short, release="jazzy"), yaw=2.0).v == 0.0
    assert command_of(shim(short[:1], release="jazzy"), yaw=2.0) == FOLLOWED


# --- What the examples leave open ------------------------------------------------------------------------------------


def test_open_loop_counts_from_the_last_command():
    for closed_loop, rates in ((True, (-0.16, -0.16)), (False, (-0.16, -0.32))):
        made = shim(straight(), closed_loop=closed_loop)
        assert tuple(command_of(made, yaw=2.0).w for _ in rates) == pytest.approx(rates)
    made = shim(straight(), release="jazzy", closed_loop=False)
    command_of(made, yaw=2.0)
    made.end_action()
    assert command_of(made, yaw=2.0).w == pytest.approx(-0.16)
    assert made.primary.told[-1] == "end_action"
    made.set_plan(straight())
    command_of(made)
    made.set_plan(straight())
    assert command_of(made, yaw=2.0).w == pytest.approx(FOLLOWED.w - 0.16)


@each_release
def test_a_turn_that_would_touch_something_is_not_made(release):
    costmap = free_map()
    costmap.costs[108:112, 100:112] = 254  # to the left of a long robot that looks ahead
    path = shifted(straight(), 0.0) @ np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1]])
    assert command_of(shim(path, BAR, release=release), w=0.8, costmap=costmap) == FOLLOWED
    assert command_of(shim(path, release=release), w=0.8, costmap=costmap).v == 0.0  # a disc fits
    assert command_of(shim(path, BAR, release=release, simulate_ahead_time=0.1), w=0.8, costmap=costmap).v == 0.0


def test_unknown_and_dear_cells():
    dear = free_map()
    dear.costs[:] = 200
    assert command_of(shim(straight(), release="jazzy"), yaw=2.0, costmap=dear).v == 0.0
    assert command_of(shim(straight(), release="jazzy", max_cost_threshold=200.0), yaw=2.0, costmap=dear) == FOLLOWED
    for tracked in (True, False):
        unknown = free_map(track_unknown=tracked)
        unknown.costs[:] = 255
        assert command_of(shim(straight()), yaw=2.0, costmap=unknown) == FOLLOWED


def test_the_turn_at_the_goal():
    goal = [(0.0, 0.0, 0.0), (0.9, 0.0, 0.0), (1.0, 0.0, -2.0)]
    for release in RELEASES:
        made = shim(goal, release=release, rotate_to_goal_heading=True)
        assert command_of(made, x=0.4) == FOLLOWED
        assert command_of(made, x=0.8) == pytest.approx((0.0, -0.16))
        assert command_of(made, x=0.5).v == 0.0  # reached once is enough
        made.set_plan(np.array(goal))
        assert command_of(made, x=0.5) == FOLLOWED
    assert command_of(shim(goal), x=0.8) == FOLLOWED


def test_once_is_enough_for_one_goal():
    made = shim(straight(), release="jazzy", rotate_to_heading_once=True)
    assert command_of(made, yaw=2.0).v == 0.0
    made.set_plan(straight())  # still turning: looked at again
    assert command_of(made, yaw=2.0).v == 0.0
    assert command_of(made) == FOLLOWED
    made.set_plan(straight())
    assert command_of(made, yaw=2.0) == FOLLOWED
    made.move_plan(shifted(straight(), 0.1))  # the map's frame moved: the goal did not
    made.set_plan(straight())
    assert command_of(made, yaw=2.0) == FOLLOWED
    made.set_plan(straight(3.0))
    assert command_of(made, yaw=2.0).v == 0.0


def test_the_other_controller_hears_of_everything():
    made = shim(straight())
    made.move_plan(shifted(straight(), 0.0, 3.0))
    assert made.primary.told == ["reset", ("set_plan", 160), ("move_plan", 160)]
    assert command_of(made).v == 0.0  # the path has moved to the left
    made = shim(straight())
    with pytest.raises(ControllerError, match="cannot"):
        made.compute_velocity_commands(ORIGIN, Twist(-1.0, 0.0), free_map(), 0.0)


def test_a_shim_around_each_controller_shares_its_parameters():
    assert set(FOLLOWERS) == {*PRIMARIES, *SHIMS}
    for name, primary in SHIMS.items():
        values = {"critics": ["PathDist"]} if primary == "dwb" else {}
        for release in RELEASES:
            made = FOLLOWERS[name](CONTROLLERS[name].params(release=release, angular_dist_threshold=0.1, **values))
            alone = CONTROLLERS[primary].params(release=release, **values)
            shared = set(type(alone).model_fields)
            assert made.params.angular_dist_threshold == 0.1
            assert made.params.model_dump(include=shared) == alone.model_dump()
            assert type(made.primary) is type(PRIMARIES[primary].make(alone))
            assert made.primary.params is made.params


def test_parameters_that_humble_lacks():
    with pytest.raises(ConfigError, match="rotate_to_heading_once: Nav2 Humble has no such parameter"):
        RotationShimParams(rotate_to_heading_once=True)
    assert RotationShimParams(release="jazzy").angular_disengage_threshold == 0.3925


# --- For any input ---------------------------------------------------------------------------------------------------


def test_nothing_is_left_of_another_run():
    made = shim(straight(), release="jazzy", rotate_to_heading_once=True, closed_loop=False)
    command_of(made, yaw=2.0)
    command_of(made)
    made.reset(make_setup())
    made.set_plan(straight())
    assert command_of(made, yaw=2.0) == pytest.approx((0.0, -0.16))
    assert command_of(made, yaw=2.0).w == pytest.approx(-0.32)


far = {
    "angular_dist_threshold": st.sampled_from([0.0, 0.3, 2.0]),
    "angular_disengage_threshold": st.sampled_from([0.0, 0.4, 3.0]),
    "forward_sampling_distance": st.sampled_from([0.0, 0.5, 9.0]),
    "max_angular_accel": st.sampled_from([0.1, 3.2, 100.0]),
    "simulate_ahead_time": st.sampled_from([0.0, 0.1, 1.0]),
    "rotate_to_goal_heading": flags,
    "closed_loop": flags,
}
since_jazzy = {
    "max_cost_threshold": st.sampled_from([0.0, 200.0, 255.0]),
    "rotate_to_heading_once": flags,
    "use_path_orientations": flags,
}
humbles = st.fixed_dictionaries({**far, "release": st.just("humble")})
newer = st.fixed_dictionaries({**far, **since_jazzy, "release": st.sampled_from(["jazzy", "lyrical"])})


@settings(max_examples=150, deadline=None)
@given(st.one_of(humbles, newer), costmaps(), st.sampled_from([DISC, BAR]), st.integers(0, 2**32 - 1))
def test_calls_and_plans_in_any_order_are_those_of_the_plain_twin(params, costmap, footprint, seed):
    rng, says = np.random.default_rng(seed), Says(False)
    setup = dataclasses.replace(make_setup(footprint), goal_checker=says)
    made = make_shim(Primary, RotationShimParams(**params))
    made.reset(setup)
    twin, local, plan = PlainRotationShim(made.params, setup), None, rng.uniform(-0.6, 0.6, (5, 3))
    for _ in range(8):
        if twin.goal is None or rng.random() < 0.3:
            plan = plan[1:] if len(plan) > 2 else rng.uniform(-0.6, 0.6, (5, 3))  # replanned, or another goal
            made.set_plan(plan)
            twin.set_plan(plan.tolist())
        if rng.random() < 0.1:
            made.end_action()
            twin.end_action()
        if params["release"] == "lyrical":
            says.arrived, local = bool(rng.random() < 0.3), plan[rng.integers(len(plan)) :]
            made.take_local_plan(LocalPlan(local, 1.0, Pose(*plan[-1].tolist())))
        pose, w = Pose(*rng.uniform(-0.3, 0.3, 2).tolist(), float(rng.uniform(-3.1, 3.1))), float(rng.uniform(-2, 2))
        expected = twin(pose, w, costmap, says.arrived, None if local is None else local.tolist())
        command = made.compute_velocity_commands(pose, Twist(0.1, w), costmap, 0.0)
        twin.last = command.w
        assert command == (FOLLOWED if expected is None else pytest.approx((0.0, expected), abs=1e-9))
