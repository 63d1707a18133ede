"""MPPI as Jazzy has it: worked examples of the reference (section 12), the plain twin, and what a reset means."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from controllers.base import ControllerError, InvalidPath, Twist
from controllers.mppi.evaluation import evaluate
from controllers.mppi.kernels.accelerations import limit_samples, limit_sequence
from controllers.mppi.kernels.rollout import BLOCK
from controllers.mppi.kernels.update import FILTER, filter_copy
from controllers.mppi.noise import Layout, Nav2Noise
from controllers.mppi.params import MppiParams
from controllers.mppi.path_handler import PathHandler
from controllers.mppi.records import CALL, make_tuning
from gym_mapbench.costmap import Costmap
from gym_mapbench.errors import ConfigError
from gym_mapbench.world.footprint import Footprint
from gym_mapbench.world.scenario import Pose
from tests.controllers.plain_mppi import PlainMppi
from tests.controllers.test_mppi import (
    RECTANGLE,
    STEPS,
    cluttered,
    compare,
    costs_along_x,
    curved_path,
    drive,
    follower,
    free_map,
    make_call,
    make_setup,
    straight_call,
    straight_plan,
)

LONG_PATH = np.column_stack([0.025 * np.arange(61), np.zeros((61, 2))])


def jazzy(**options):
    return MppiParams(release="jazzy", **options)


# --- worked examples -------------------------------------------------------------------------------------------------


def test_4_rollout():
    plain = PlainMppi(*straight_call(jazzy(batch_size=1), 0.5, 1.0, Twist(0.2, 0.1)))
    assert plain.vx[0, :4] == pytest.approx([0.2, 0.35, 0.5, 0.5])
    assert plain.wz[0, :8] == pytest.approx([0.1, 0.275, 0.45, 0.625, 0.8, 0.975, 1.0, 1.0])
    where = np.stack([plain.x[0], plain.y[0], plain.yaw[0]], axis=1)[[0, 1, 2, 55]]
    expected = [(0.01, 0, 0.005), (0.0275, 0.000087, 0.01875), (0.052495, 0.000556, 0.04125)]
    assert where == pytest.approx(np.array([*expected, (0.301408, 0.939172, 2.66125)]), abs=2e-6)


def test_4_the_kernel_limits_samples_as_the_twin_does():
    call = make_call(jazzy(batch_size=BLOCK, vx_std=1.0, wz_std=3.0), seed=4)
    plain, tuning, record = PlainMppi(*call), make_tuning(call[0], call[1]), np.zeros(1, dtype=CALL)
    record["v"], record["w"] = call[3]
    noise = Layout(BLOCK, STEPS).pack(*call[7])
    limited = np.empty((2, 1, STEPS, BLOCK), dtype=np.float32)
    longest, fastest = limit_samples(tuning[0], record[0], noise.v, noise.w, *call[6], *limited)
    np.testing.assert_array_equal(limited[0, 0].T, plain.cv)
    np.testing.assert_array_equal(limited[1, 0].T, plain.cw)
    assert longest == pytest.approx(np.abs(plain.cv[:, :-1]).sum(axis=1).max(), rel=1e-5)
    assert fastest == np.abs(plain.cw[:, :-1]).max()


def test_5_the_sequence_is_limited():
    v = np.array([0.1, 0.5, 0.5, 0.2, -0.1, -0.4], dtype=np.float32)
    limit_sequence(make_tuning(jazzy(), make_setup())[0], v, np.zeros(6, dtype=np.float32))
    assert v == pytest.approx([0.1, 0.25, 0.4, 0.25, 0.1, -0.05])


def test_6_filter():
    history, constant, impulse = np.zeros(4, np.float32), np.full(STEPS, 0.4, np.float32), np.zeros(STEPS, np.float32)
    impulse[20] = 1.0
    for values in (constant, impulse):
        filter_copy(values, history, FILTER)
    assert constant[:6] == pytest.approx([0.25108, 0.34459, 0.41212, 0.43636, 0.4, 0.4], abs=1e-5)
    expected = [-0.09091, 0.06061, 0.16883, 0.23377, 0.25541, 0.23377]
    assert impulse[16:22] == pytest.approx(expected, abs=1e-5)


@pytest.mark.parametrize(
    ("options", "values", "expected"),
    [
        ({}, [0] * 20 + [81] * 4 + [128] * 4, 0.447857),
        ({}, [0, 254], 535.714),
        ({"consider_footprint": True}, [253] * 5, 0.803571),
    ],
)
def test_7_costs_of_every_second_point(options, values, expected):
    # Between the points looked at lies what would be worse: nobody looks there.
    params = jazzy(batch_size=1, critics=["CostCritic"], vx_max=2.0, CostCritic=options)
    path = np.column_stack([np.linspace(0, 4, 200), np.zeros((200, 2))])
    costmap = costs_along_x([cost for value in values for cost in (value, 128)])
    costmap.costs[:, 2::2] = 252
    costmap.costs[:, 1 : 1 + 2 * len(values) : 2] = values
    call = straight_call(params, 1.0, 0.0, Twist(1.0, 0.0), costmap, path, Footprint.from_radius(0.05))
    call = (*call[:2], Pose(0.025, 0.0, 0.0), *call[3:])
    assert evaluate(*call, (9.0, 9.0)).costs[0, 0] == pytest.approx(expected, rel=1e-5)


def test_7_path_angle_and_align():
    path = np.array([[0.1, 0.3, 0.0], [0.5, 1.5, 0.0]])
    angle = jazzy(batch_size=1, critics=["PathAngleCritic"], PathAngleCritic={"cost_weight": 2.0})
    call = straight_call(angle, 0.0, 0.0, Twist(0.0, 0.0), path=path)
    assert evaluate(*call).costs[0, 0] == pytest.approx(2.498092, abs=1e-5)
    align = jazzy(batch_size=1, critics=["PathAlignCritic"], PathAlignCritic={"cost_weight": 14.0})
    for y, expected in ((0.1, 1.432455), (0.0, 0.285385)):
        call = straight_call(align, 0.4, 0.0, Twist(0.4, 0.0), path=LONG_PATH)
        ours = evaluate(*call[:2], Pose(0.0, y, 0.0), *call[3:])
        assert (ours.furthest, ours.costs[0, 0]) == (45, pytest.approx(expected, abs=2e-5))


def test_8_noise():
    source = Nav2Noise(Layout(2000, STEPS), (0.2, 0.4))
    first, second, third = source.sample(), source.sample(), source.sample()
    assert first.v[0, :3, 0] == pytest.approx([-0.0586438, 0.0506322, -0.0114171], abs=1e-7)
    assert second.v[0, :3, 0] == pytest.approx([-0.4112263, -0.3134524, 0.3442384], abs=1e-7)
    assert third.v[0, 0, 0] == pytest.approx(-0.1521833, abs=1e-7)
    assert [one.w[0, 0, 0] for one in (first, second, third)] == pytest.approx(
        [-0.4452216, -0.2849006, -0.0896046], abs=1e-7
    )


# --- the twin --------------------------------------------------------------------------------------------------------

EXAMPLE = {
    "CostCritic": {"near_goal_distance": 1.0},
    "PathAlignCritic": {"cost_weight": 14.0, "max_path_occupancy_ratio": 0.5},
    "PathFollowCritic": {"offset_from_furthest": 5},
    "PathAngleCritic": {"max_angle_to_furthest": 1.0, "cost_weight": 2.0},
}


@pytest.mark.parametrize("seed", range(3))
def test_the_example_is_its_twin(seed):
    ours = compare((*make_call(jazzy(batch_size=150, **EXAMPLE), seed), (6.0, 1.0)))
    assert ours.furthest > 15
    assert (ours.costs[4] > 0).any()


@pytest.mark.parametrize(
    "options",
    [
        {"ax_max": 1.0, "ax_min": -2.0, "az_max": 0.7, "PathAlignCritic": {"use_path_orientations": True}},
        {"motion_model": "Ackermann", "critics": ["ConstraintCritic", "PreferForwardCritic"]},
        {"critics": ["CostCritic", "ObstaclesCritic"], "CostCritic": {"near_collision_cost": 150}},
        {"critics": ["CostCritic"], "CostCritic": {"trajectory_point_step": 5}, "time_steps": 33},
        {"critics": ["TwirlingCritic", "VelocityDeadbandCritic"], "iteration_count": 1,
         "VelocityDeadbandCritic": {"deadband_velocities": (0.1, 0.0, 0.2)}},
        {"critics": ["PathFollowCritic"], "time_steps": 18},
    ],
)  # fmt: skip
def test_other_options_are_their_twins(options):
    compare((*make_call(jazzy(batch_size=60, **options), seed=7), (6.0, 1.0)))


@pytest.mark.parametrize("yaw", [0.4, 2.9, -1.7])
@pytest.mark.parametrize("mode", [0, 1, 2])
def test_modes_of_path_angle_are_their_twins(yaw, mode):
    path = curved_path()
    path[:, 2] += math.pi * (mode == 2)
    options = {"batch_size": 50, "critics": ["PathAngleCritic"], "PathAngleCritic": {"mode": mode}}
    for vx_min in (-0.35, 0.0):
        call = make_call(jazzy(**options, vx_min=vx_min), 1, Pose(0.4123, 0.3071, yaw), path)
        compare((*call, (6.0, 1.0)))


def test_near_the_goal_means_near_the_navigation_goal():
    call = make_call(jazzy(batch_size=50), 1, path=curved_path(14))
    beside, far = compare((*call, (0.5, 0.4))), compare((*call, (6.0, 1.0)))
    goal, follow = beside.critics.index("GoalCritic"), beside.critics.index("PathFollowCritic")
    assert (beside.costs[goal] > 0).all()
    assert (beside.costs[follow] == 0).all()
    assert (far.costs[goal] == 0).all()
    assert (far.costs[follow] > 0).all()


@pytest.mark.parametrize("inflation_radius", [0.55, 0.2])
def test_footprints_are_their_twins(inflation_radius):
    # With the smaller radius no cost tells where a corner may touch, so every footprint is looked at.
    params = jazzy(batch_size=40, critics=["CostCritic", "ObstaclesCritic"], CostCritic={"consider_footprint": True})
    costmap = cluttered(3)
    costmap.costs[costmap.costs == 254] = 0
    costmap.costs[60, 70] = 254
    call = make_call(params, 3, Pose(1.2, 0.1, 0.4), costmap=costmap, footprint=RECTANGLE)
    setup = call[1].__class__(**{**vars(call[1]), "inflation_radius": inflation_radius})
    compare((params, setup, *call[2:], (6.0, 1.0)))


@settings(max_examples=25)
@given(
    st.integers(0, 10_000),
    st.floats(-60, 60),
    st.floats(-60, 60),
    st.sampled_from([0.01, 0.05, 0.13]),
    st.sampled_from([(0.0, 0.0), (-1.45, 3.1), (-61.3, -62.7)]),
)
def test_cells_are_found_as_float32_finds_them(seed, x, y, resolution, origin):
    rng = np.random.default_rng(seed)
    size = int((abs(x - origin[0]) + 2) / resolution), int((abs(y - origin[1]) + 2) / resolution)
    costmap = Costmap(rng.integers(0, 255, size[::-1]).astype(np.uint8), resolution, *origin)
    params = jazzy(batch_size=7, time_steps=24, critics=["CostCritic"])
    call = (*make_call(params, seed, Pose(x, y, 0.3), None, costmap), (99.0, 99.0))
    ours, plain = evaluate(*call), PlainMppi(*call).run()
    np.testing.assert_allclose(ours.costs[0], plain.costs["CostCritic"], rtol=1e-6)


# --- the follower ----------------------------------------------------------------------------------------------------

WALLS = Costmap(np.full((200, 200), 254, dtype=np.uint8), 0.05, -5.0, -5.0)


def test_a_batch_that_collides_is_no_valid_control():
    made = follower(release="jazzy", critics=["CostCritic", "PathFollowCritic"])
    with pytest.raises(ControllerError, match="Optimizer fail to compute path"):
        drive(made, 1, WALLS)


def test_a_pause_changes_nothing_and_the_end_of_an_action_does():
    def commands(gap=None, ends=False):
        made = follower(release="jazzy", noise="nav2")
        drive(made, 3)
        if ends:
            made.end_action()
        return drive(made, 1, start=gap or 0.15)

    assert commands() == commands(gap=60.0)
    assert commands() != commands(ends=True)


def test_every_call_takes_the_next_draw():
    made, fixed = (follower(release="jazzy", noise="nav2", regenerate_noises=anew) for anew in (True, False))
    source = Nav2Noise(Layout(300, STEPS), (0.2, 0.4))
    draws = [source.sample() for _ in range(4)]
    for draw in draws[:3]:
        np.testing.assert_array_equal(made._optimizer._noise.v, draw.v)
        np.testing.assert_array_equal(fixed._optimizer._noise.v, draws[1].v)
        drive(made, 1)
        drive(fixed, 1)


def test_open_loop_goes_on_from_the_last_command():
    made = follower(release="jazzy", open_loop=True)
    first, second = drive(made, 2)
    assert made._optimizer._call["v"][0] == first.v
    assert drive(follower(release="jazzy"), 2)[1] != second


def test_a_speed_limit_survives_a_reset():
    made = follower(release="jazzy")
    made.set_speed_limit(0.25)
    made.end_action()
    assert made._optimizer._tuning["highest_speed"][0] == 0.25


def test_the_last_of_equally_near_poses_counts():
    there_and_back = np.concatenate([straight_plan(1.0), straight_plan(1.0)[-2::-1]])
    for release, begins in (("humble", 10), ("jazzy", 30)):
        paths = PathHandler(MppiParams(release=release, prune_distance=3.0, max_robot_pose_search_dist=9.0))
        paths.set_plan(there_and_back)
        window = paths.local_path(Pose(0.5, 0.0), free_map())
        assert len(window) == len(there_and_back) - begins
        assert paths.goal(window) == (0.0, 0.0)
    with pytest.raises(InvalidPath):
        paths.local_path(Pose(0.5, 0), Costmap(WALLS.costs, 0.05, 3.0, 3.0))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"reset_period": 1.0}, "reset_period: Nav2 Jazzy has no such parameter"),
        ({"PathAngleCritic.forward_preference": True}, "mode: 0 is forward preference"),
        ({"ObstaclesCritic": {"inflation_radius": 0.7}}, "Jazzy asks the inflation layer"),
        ({"sgf_order": 2}, "the Savitzky-Golay filter is quadratic"),
        ({"PathAngleCritic.mode": 3}, "mode"),
        ({"CostCritic.trajectory_point_step": None}, "trajectory_point_step: expected a value"),
    ],
)
def test_what_jazzy_does_not_have_is_refused(options, message):
    with pytest.raises(ConfigError, match=message):
        jazzy(**options)
    with pytest.raises(ConfigError, match="az_max: Nav2 Humble has no such parameter"):
        MppiParams(az_max=3.0)


def test_defaults_are_those_of_the_release():
    params = jazzy()
    assert (params.PathAngleCritic.cost_weight, params.PathAngleCritic.max_angle_to_furthest) == (2.2, 0.785398)
    assert (params.ObstaclesCritic.collision_cost, params.CostCritic.trajectory_point_step) == (1e5, 2)
    assert MppiParams(**params.model_dump(mode="json", exclude_none=True)) == params == params.replace(gamma=0.015)
