"""MPPI: what is left of the worked examples T7, a plain twin of everything, and what must hold for any input."""

from __future__ import annotations

import math
import re

import numba
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from controllers.base import ControllerAbort, FollowerSetup, Twist
from controllers.mppi.controller import MppiFollower
from controllers.mppi.evaluation import evaluate
from controllers.mppi.kernels import elementary
from controllers.mppi.kernels.align import build_slots, closest_by_length
from controllers.mppi.kernels.elementary import ONE
from controllers.mppi.kernels.path import furthest_reached
from controllers.mppi.kernels.points import ROWS_SIZE, step_and_locate
from controllers.mppi.kernels.rollout import BLOCK
from controllers.mppi.kernels.update import filter_controls
from controllers.mppi.noise import Layout, Nav2Noise, NoiseBank, NumpyNoise
from controllers.mppi.params import RENAMED_KEYS, ROS_ONLY_KEYS, MppiParams
from controllers.mppi.path_handler import PathHandler
from controllers.mppi.release_tables import JAZZY_DEFAULTS, LYRICAL_DEFAULTS
from gym_mapbench.costmap import Costmap
from gym_mapbench.errors import ConfigError
from gym_mapbench.kernels.jit import kernel
from gym_mapbench.ros_params import parameter_names
from gym_mapbench.world.footprint import Footprint
from gym_mapbench.world.scenario import Pose
from tests.controllers.plain_mppi import PlainMppi, closest, smooth, smooth_copy

STEPS = 56
RECTANGLE = Footprint.from_corners(np.array([[0.35, 0.25], [-0.15, 0.25], [-0.15, -0.25], [0.35, -0.25]]))


def make_setup(footprint=None, seed=0, period=0.05):
    footprint = footprint or Footprint.from_radius(0.22)
    return FollowerSetup(footprint, period, 0.25, 0.25, 0.55, 3.0, np.random.default_rng(seed))


def cluttered(seed, size=120, resolution=0.05, unknown=False):
    """Costs that vary from cell to cell, all values among them, and a map border that trajectories can cross."""
    rng = np.random.default_rng(seed)
    costs = rng.integers(0, 200, (size, size)).astype(np.uint8)
    costs[rng.random((size, size)) < 0.4] = 0
    costs[rng.random((size, size)) < 0.01] = 253
    costs[rng.random((size, size)) < 0.004] = 254
    costs[rng.random((size, size)) < 0.004] = 255
    return Costmap(costs, resolution, -1.37, -2.71, unknown)


def free_map():
    return Costmap(np.zeros((200, 200), dtype=np.uint8), 0.05, -5.0, -5.0)


def curved_path(points=80, spacing=0.025):
    turn = np.cumsum(np.full(points, 0.012))
    x, y = 0.4 + np.cumsum(spacing * np.cos(turn)), 0.3 + np.cumsum(spacing * np.sin(turn))
    return np.column_stack([x, y, np.linspace(0.0, 0.8, points)])


def make_call(params, seed=0, pose=None, path=None, costmap=None, footprint=None):
    """Everything ``evaluate`` takes, drawn from one seed."""
    rng = np.random.default_rng(seed)
    shape = (params.batch_size, params.time_steps)
    noise = (rng.normal(0, params.vx_std, shape), rng.normal(0, params.wz_std, shape))
    controls = (rng.uniform(-0.1, 0.5, shape[1]), rng.uniform(-0.8, 0.8, shape[1]))
    noise, controls = (tuple(a.astype(np.float32) for a in pair) for pair in (noise, controls))
    pose = pose or Pose(0.4123, 0.3071, 0.31)
    path = curved_path() if path is None else path
    velocity = Twist(0.21, -0.13)
    return params, make_setup(footprint), pose, velocity, path, costmap or cluttered(seed), controls, noise


def compare(call, rel=2e-5):
    """Evaluate a call and its twin; every critic, the total and the control sequence have to agree."""
    ours, plain = evaluate(*call), PlainMppi(*call).run()
    assert ours.critics == tuple(plain.costs)
    assert (ours.failed, ours.furthest) == (plain.failed, plain.furthest)
    for name, costs in zip(ours.critics, ours.costs, strict=True):
        np.testing.assert_allclose(costs, plain.costs[name], rtol=rel, atol=2e-6, err_msg=name)
    np.testing.assert_allclose(ours.total, plain.total, rtol=rel, atol=1e-5)
    np.testing.assert_allclose(ours.softmax_v, plain.v, atol=2e-5)
    np.testing.assert_allclose(ours.softmax_w, plain.w, atol=2e-5)
    plainly = smooth_copy if call[0].release == "jazzy" else smooth
    np.testing.assert_allclose(ours.filtered_v, plainly(ours.softmax_v, np.zeros(4)), atol=1e-6)
    return ours


# --- T7: what the examples beside this file leave out ----------------------------------------------------------------


def test_t7_1_rollout():
    plain = PlainMppi(*straight_call(MppiParams(batch_size=1), 0.5, 1.0, Twist(0.2, 0.1)))
    assert (plain.x[0, 0], plain.y[0, 0], plain.yaw[0, 0]) == pytest.approx((0.01, 0.0, 0.005))
    assert (plain.x[0, 1], plain.y[0, 1], plain.yaw[0, 1]) == pytest.approx((0.035, 0.000125, 0.055), abs=1e-6)
    assert (plain.x[0, 2], plain.y[0, 2], plain.yaw[0, 2]) == pytest.approx((0.059962, 0.001499, 0.105), abs=1e-6)
    assert (plain.x[0, -1], plain.y[0, -1], plain.yaw[0, -1]) == pytest.approx((0.22006, 0.95824, 2.755), abs=1e-5)


def straight_call(params, v, w, velocity, costmap=None, path=None, footprint=None):
    zero = np.zeros((params.batch_size, STEPS), dtype=np.float32)
    controls = np.full(STEPS, v, dtype=np.float32), np.full(STEPS, w, dtype=np.float32)
    path = np.column_stack([0.025 * np.arange(61), np.zeros(61), np.zeros(61)]) if path is None else path
    costmap = costmap or free_map()
    return params, make_setup(footprint), Pose(0.0, 0.0, 0.0), velocity, path, costmap, controls, (zero, zero)


def test_t7_2_softmax():
    # Three trajectories that differ in nothing but one cost: speeds backwards of 0, 0.3 and 1 m/s for 4 s.
    params = MppiParams(batch_size=3, time_steps=2, critics=["PreferForwardCritic"], gamma=0.0, vx_max=5.0, vx_min=-5.0)
    call = make_call(params)
    noise = np.array([[0.2, 0], [0.3, 0], [0.5, 0]], dtype=np.float32), np.zeros((3, 2), dtype=np.float32)
    ours = evaluate(*call[:6], (np.zeros(2, dtype=np.float32),) * 2, noise)
    weights = np.exp(-(ours.total - ours.total.min()) / 0.3)
    assert ours.softmax_v[0] == pytest.approx(weights @ noise[0][:, 0] / weights.sum(), rel=1e-6)


def test_t7_3_filter():
    impulse, history = np.zeros(STEPS, dtype=np.float32), np.zeros(4, dtype=np.float32)
    impulse[20] = 1.0
    filter_controls(impulse, history)
    expected = [-0.09091, 0.03935, 0.16268, 0.27293, 0.35733, 0.13589, 0.09385, 0.04173]
    assert impulse[16:24] == pytest.approx(expected, abs=1e-5)
    short = np.arange(20, dtype=np.float32)
    filter_controls(short, history)
    assert short.tolist() == list(range(20))


def costs_along_x(values):
    """A map on which a robot driving along x at 1 m/s meets these costs, one a step; rows are alike."""
    costs = np.zeros((40, 200), dtype=np.uint8)
    costs[:, 1 : 1 + len(values)] = values
    return Costmap(costs, 0.05, 0.0, -1.0)


@pytest.mark.parametrize(
    ("critic", "options", "values", "expected"),
    [
        ("ObstaclesCritic", {"cost_scaling_factor": 3.0}, [0] * 40 + [81] * 8 + [128] * 8, 0.105693),
        ("ObstaclesCritic", {"cost_scaling_factor": 3.0}, [201] * 6, 2.796617),
        ("CostCritic", {}, [0] * 40 + [81] * 8 + [128] * 8, 0.447857),
        ("CostCritic", {}, [0, 254], 267.857),
        ("CostCritic", {"consider_footprint": True}, [253] * 10, 0.803571),
    ],
)
def test_t7_5_costs(critic, options, values, expected):
    params = MppiParams(batch_size=1, critics=[critic], vx_max=2.0, **{critic: options})
    path = np.column_stack([np.linspace(0, 4, 200), np.zeros((200, 2))])
    call = straight_call(params, 1.0, 0.0, Twist(1.0, 0.0), costs_along_x(values), path, Footprint.from_radius(0.05))
    call = (*call[:2], Pose(0.025, 0.0, 0.0), *call[3:])
    assert evaluate(*call).costs[0, 0] == pytest.approx(expected, rel=1e-5)


def test_t7_5_constraint_without_vy():
    params = MppiParams(batch_size=1, critics=["ConstraintCritic"], vy_max=0.0)
    assert evaluate(*straight_call(params, 0.8, 0.0, Twist(0.8, 0.0))).costs[0, 0] == pytest.approx(3.36, rel=1e-5)


# --- the twin --------------------------------------------------------------------------------------------------------

README = {
    "CostCritic": {"near_goal_distance": 1.0},
    "PathAlignCritic": {"cost_weight": 14.0, "max_path_occupancy_ratio": 0.5, "trajectory_point_step": 3},
    "PathFollowCritic": {"offset_from_furthest": 5},
    "PathAngleCritic": {"max_angle_to_furthest": 1.0},
}


@pytest.mark.parametrize("seed", range(3))
def test_the_example_is_its_twin(seed):
    ours = compare(make_call(MppiParams(batch_size=150, **README), seed))
    assert ours.furthest > 20
    assert (ours.costs[4] > 0).any()


@pytest.mark.parametrize(
    "options",
    [
        {"PathAlignCritic": {**README["PathAlignCritic"], "humble_search": False}},
        {"PathAlignCritic": {**README["PathAlignCritic"], "use_path_orientations": True}},
        {"critics": ["TwirlingCritic", "VelocityDeadbandCritic"],
         "VelocityDeadbandCritic": {"deadband_velocities": (0.1, 0.0, 0.2)}},
        {"motion_model": "Ackermann", "critics": ["ConstraintCritic"]},
        {"critics": ["CostCritic", "ObstaclesCritic"]},
        {"critics": ["PreferForwardCritic"], "PreferForwardCritic": {"cost_power": 3, "cost_weight": 2.0}},
        {"PathFollowCritic": {"enabled": False}, "time_steps": 31, "critics": ["CostCritic", "PathFollowCritic"]},
    ],
)  # fmt: skip
def test_other_options_are_their_twins(options):
    compare(make_call(MppiParams(batch_size=60, **options), seed=7))


@pytest.mark.parametrize("critic", ["CostCritic", "ObstaclesCritic"])
@pytest.mark.parametrize("footprint", [RECTANGLE, Footprint.from_radius(0.22)])
def test_footprints_are_their_twins(critic, footprint):
    params = MppiParams(batch_size=40, critics=[critic], **{critic: {"consider_footprint": True}})
    costmap = cluttered(3)
    costmap.costs[costmap.costs == 254] = 0
    costmap.costs[60, 70] = 254
    costmap.costs[55:66, 65:76] = np.maximum(costmap.costs[55:66, 65:76], 210)
    compare(make_call(params, 3, Pose(1.2, 0.1, 0.4), costmap=costmap, footprint=footprint))


@pytest.mark.parametrize(("critic", "collides"), [("ObstaclesCritic", False), ("CostCritic", True)])
def test_off_a_map_that_tracks_unknown_space_only_the_cost_critic_checks_the_outline(critic, collides):
    # The map is free, but at 1 m/s the robot leaves it: its last points are of unknown cost, 255.
    free = Costmap(np.zeros((40, 40), np.uint8), 0.05, 0.0, -1.0, True)
    params = MppiParams(batch_size=1, critics=[critic], vx_max=2.0, **{critic: {"consider_footprint": True}})
    dot = Footprint.from_corners(np.array([[0.01, 0.01], [-0.01, 0.01], [-0.01, -0.01], [0.01, -0.01]]))
    call = straight_call(params, 1.0, 0.0, Twist(1.0, 0.0), free, np.array([[0.0, 0, 0], [4.0, 0, 0]]), dot)
    call = (*call[:2], Pose(0.325, 0.025, 0.0), *call[3:])
    assert evaluate(*call).failed == collides
    compare(call)


@pytest.mark.parametrize("yaw", [0.4, 2.9, -1.7])
def test_near_the_goal_and_looking_away(yaw):
    pose, path = Pose(0.4123, 0.3071, yaw), curved_path(14)
    for options in ({}, {"GoalAngleCritic": {"symmetric_yaw_tolerance": True}}):
        compare(make_call(MppiParams(batch_size=50, **options), 1, pose, path))
    away = {"PathAngleCritic": {"forward_preference": False}}
    for options in ({}, away, {**away, "vx_min": 0.0}):
        compare(make_call(MppiParams(batch_size=50, **options), 1, pose))


def test_unknown_space_is_no_obstacle_where_it_is_tracked():
    compare(make_call(MppiParams(batch_size=60, critics=["CostCritic"]), 5, costmap=cluttered(5, unknown=True)))


def test_fast_turns_are_evaluated_exactly():
    compare(make_call(MppiParams(batch_size=40, wz_std=4.0, wz_max=8.0), 2))


@settings(max_examples=25)
@given(
    st.integers(0, 10_000),
    st.floats(-4, 4),
    st.floats(-4, 4),
    st.floats(-math.pi, math.pi),
    st.sampled_from([0.01, 0.05, 0.13]),
    st.tuples(st.integers(1, 90), st.integers(1, 90)),
)
def test_cells_are_found_exactly_anywhere(seed, x, y, yaw, resolution, size):
    rng = np.random.default_rng(seed)
    costmap = Costmap(rng.integers(0, 255, size).astype(np.uint8), resolution, -1.03, 0.31)
    call = make_call(
        MppiParams(batch_size=7, time_steps=23, critics=["CostCritic"]), seed, Pose(x, y, yaw), None, costmap
    )
    ours, plain = evaluate(*call), PlainMppi(*call).run()
    np.testing.assert_allclose(ours.costs[0], plain.costs["CostCritic"], rtol=1e-6)


# --- kernels ---------------------------------------------------------------------------------------------------------


@kernel
def _apply(x, y, sin, cos, angle, exp):
    for k in range(len(x)):
        sin[k], cos[k] = elementary.sin_cos(x[k])
        angle[k] = elementary.angle_of(x[k], y[k])
        exp[k] = elementary.exp_negative(-y[k])


def test_elementary_functions():
    rng = np.random.default_rng(0)
    x, y = rng.uniform(-12, 12, 50_000).astype(np.float32), rng.uniform(0, 90, 50_000).astype(np.float32)
    y[:3], x[:3] = 0.0, (0.0, 1.0, -1.0)
    sin, cos, angle, exp = np.empty((4, len(x)), dtype=np.float32)
    _apply(x, y, sin, cos, angle, exp)
    exact = x.astype(float)
    assert max(np.abs(sin - np.sin(exact)).max(), np.abs(cos - np.cos(exact)).max()) < 6e-8
    assert np.abs(angle - np.arctan2(y.astype(float), exact)).max() < 3e-7
    assert np.abs(exp / np.exp(-y.astype(float)) - 1)[y < 86].max() < 3e-7
    assert (exp[y > 87] == 0).all()


@settings(max_examples=60)
@given(st.lists(st.floats(0, 1, width=32), min_size=1, max_size=200), st.integers(0, 2**32 - 1))
def test_slots_answer_as_the_search_does(steps, seed):
    arc = np.concatenate([[0.0], np.cumsum(steps)]).astype(np.float32)
    slots = np.empty(4096, dtype=np.int32)
    per_metre = np.float32(build_slots(arc, len(arc), slots))
    lengths = np.random.default_rng(seed).uniform(0, 1.2 * arc[-1] + 1e-3, 300)
    for length in np.concatenate([lengths, arc, (arc[1:] + arc[:-1]) / 2]).astype(np.float32):
        slot = slots[int(min(length * per_metre, np.float32(4095)))]
        found = slot if slot >= 0 else closest_by_length(arc, length, ~slot, len(arc))
        beyond = length > arc[-1]
        assert found == (len(arc) if beyond else closest(arc, length, 0, False))


@settings(max_examples=40)
@given(st.integers(0, 2**32 - 1), st.integers(1, 60), st.integers(1, 200))
def test_furthest_reached_is_that_of_a_full_search(seed, points, samples):
    rng = np.random.default_rng(seed)
    path = np.cumsum(rng.normal(0, 0.05, (2, points)), axis=1).astype(np.float32)
    ends = np.zeros((2, 2, 128), dtype=np.float32)
    ends.reshape(2, -1)[:, :samples] = rng.normal(0, 0.4, (2, samples))
    dx, dy = (path[i] - ends[i].reshape(-1, 1)[:samples] for i in range(2))
    away = dx * dx + dy * dy
    assert furthest_reached(*path, *ends, samples, False) == away.argmin(axis=1).max()
    reached = 0
    for row in away:
        reached += row[reached:].argmin()
    assert furthest_reached(*path, *ends, samples, True) == reached


@numba.njit(error_model="numpy")
def _one_step(rows, noise, cells):
    limits, scale = (ONE, -ONE, ONE, ONE), (ONE, ONE, ONE)
    last = (np.uint32(1 << 20), np.uint32(1 << 20), np.uint32(16))
    return step_and_locate(rows, noise, noise, (ONE, ONE), ONE, ONE, limits, scale, last, np.int32(5), cells)


def test_the_loop_of_the_rollout_is_vector_code():
    _one_step(np.zeros(ROWS_SIZE, np.float32), np.zeros(BLOCK, np.float32), np.zeros(BLOCK, np.uint32))
    if not _one_step.signatures:
        pytest.skip("kernels are switched off")
    text = "".join(_one_step.inspect_asm().values())
    packed, scalar = (len(re.findall(rf"\bv?mul{kind}\b", text)) for kind in ("ps", "ss"))
    if packed + scalar == 0:
        pytest.skip("not an x86 processor")
    # Every multiplication of the loop, which is there once more, for rows that overlap.
    assert packed >= 15, (packed, scalar)
    assert re.search(r"\bv?cvttps2dq\b", text)


# --- noise -----------------------------------------------------------------------------------------------------------


def test_nav2_noise_is_that_of_libstdcxx():
    # Printed by a C++ program: std::mt19937 unseeded, normal_distribution<float> for v (0.2), then w (0.4), twice.
    source = Nav2Noise(Layout(2000, STEPS), (0.2, 0.4))
    source.sample()
    noise = source.sample()
    assert noise.v[0, :4, 0] == pytest.approx([-0.41122633, -0.31345239, 0.34423840, -0.30505604], rel=1e-6)
    assert noise.w[0, :4, 0] == pytest.approx([-0.28490055, 0.23725544, 0.17620306, 0.39070228], rel=1e-6)


def test_an_odd_number_of_values_drops_the_last_of_a_pair():
    even, odd = (Nav2Noise(Layout(1, steps), (1.0, 1.0), seed=3) for steps in (4, 3))
    assert odd.sample().v[0, :, 0] == pytest.approx(even.sample().v[0, :3, 0])


@pytest.mark.parametrize("batch_size", [1, 127, 512, 513, 2000])
def test_layout_keeps_every_sample(batch_size):
    layout = Layout(batch_size, 5)
    values = np.arange(batch_size * 5, dtype=np.float32).reshape(batch_size, 5)
    packed = layout.pack(values, -values)
    assert packed.v.shape == (layout.blocks, 5, layout.samples)
    np.testing.assert_array_equal(layout.flat(packed.v.transpose(1, 0, 2)), values.T)
    assert packed.longest == pytest.approx(values[-1].sum())


def test_bank_takes_turns():
    bank = NoiseBank(NumpyNoise(Layout(10, 5), (0.2, 0.4), np.random.default_rng(0)), size=3)
    drawn = [bank.sample().v for _ in range(7)]
    assert drawn[0] is drawn[3] is drawn[6]
    assert not np.array_equal(drawn[0], drawn[1])


# --- the follower ----------------------------------------------------------------------------------------------------


def follower(setup=None, path=None, **params):
    made = MppiFollower(MppiParams(**{"batch_size": 300, **params}))
    made.reset(setup or make_setup())
    made.set_plan(curved_path() if path is None else path)
    return made


def drive(made, steps=6, costmap=None, start=0.0, gap=0.05):
    pose, costmap = Pose(0.4, 0.3, 0.1), costmap or free_map()
    return [made.compute_velocity_commands(pose, Twist(0.1, 0.0), costmap, start + gap * i) for i in range(steps)]


def test_commands_depend_on_the_seed_alone():
    assert drive(follower()) == drive(follower())
    assert drive(follower(make_setup(seed=1))) != drive(follower())
    assert drive(follower(noise="nav2")) == drive(follower(make_setup(seed=1), noise="nav2"))
    assert drive(follower(regenerate_noises=True)) == drive(follower(regenerate_noises=True))


def test_the_sequence_is_shifted_only_at_its_own_rate():
    made = follower(make_setup(period=0.02))
    first = drive(made, 1)[0]
    assert first.v == made._optimizer.v[0]
    made = follower()
    assert drive(made, 1)[0].v == made._optimizer.v[0]
    assert made._optimizer.v[-1] == made._optimizer.v[-2]


def test_a_pause_begins_anew():
    fresh, paused = follower(noise="nav2"), follower(noise="nav2")
    drive(paused, 3)
    paused._optimizer.reset()
    again = drive(paused, 1, start=0.15)[0]
    late = follower(noise="nav2")
    drive(late, 3)
    assert drive(late, 1, start=1.2)[0] == again
    assert drive(fresh, 1)[0] != again


def test_a_new_plan_keeps_the_sequence():
    made = follower()
    drive(made, 4)
    before = made._optimizer.v.copy()
    made.set_plan(curved_path())
    np.testing.assert_array_equal(made._optimizer.v, before)


def test_failure_resets_once_more_than_it_retries():
    made = follower(noise="nav2", retry_attempt_limit=2, critics=["CostCritic", "PathFollowCritic"])
    walls = Costmap(np.full((200, 200), 254, dtype=np.uint8), 0.05, -5.0, -5.0)
    with pytest.raises(ControllerAbort, match="Optimizer fail to compute path"):
        drive(made, 1, walls)
    other = follower(noise="nav2", retry_attempt_limit=2, critics=["CostCritic", "PathFollowCritic"])
    for _ in range(3):
        other._optimizer.reset()
    assert drive(made, 1) == drive(other, 1)


def test_after_a_failure_later_critics_are_silent():
    params = MppiParams(batch_size=20, critics=["ConstraintCritic", "CostCritic", "PathFollowCritic"])
    walls = Costmap(np.full((200, 200), 254, dtype=np.uint8), 0.05, -5.0, -5.0)
    ours = compare(make_call(params, costmap=walls))
    assert ours.failed
    assert (ours.costs[2] == 0).all()
    assert ours.furthest == -1


def test_a_failure_lasts_until_the_end_of_the_call():
    params = MppiParams(batch_size=20, iteration_count=2, critics=["ConstraintCritic", "CostCritic"])
    walls = Costmap(np.full((200, 200), 254, dtype=np.uint8), 0.05, -5.0, -5.0)
    twice, once = (evaluate(*make_call(params.replace(iteration_count=n), costmap=walls)) for n in (2, 1))
    assert twice.failed
    assert (once.costs[1] > 0).all()
    assert (twice.costs == 0).all()  # Nav2 asks no critic any more


@pytest.mark.parametrize(("speed", "percentage", "ratio"), [(0.25, False, 0.5), (40.0, True, 0.4), (0.0, False, 1.0)])
def test_speed_limit(speed, percentage, ratio):
    # Far more noise than the limits allow, so that the mean is clipped at both ends.
    made = follower(path=straight_plan(), vx_std=20.0, wz_std=20.0, temperature=1e-3, critics=["PathFollowCritic"])
    made.set_speed_limit(speed, percentage)
    plan = straight_plan()[:30]
    made._optimizer.optimize(Pose(0.4, 0.3, 0.1), Twist(0.0, 0.0), plan, (plan[-1, 0], plan[-1, 1]), free_map())
    v, w = made._optimizer.v, made._optimizer.w
    assert (v.min(), v.max(), w.max()) == pytest.approx((-0.35 * ratio, 0.5 * ratio, 1.9 * ratio))
    made._optimizer.reset()
    drive(made, 1)
    assert np.abs(made._optimizer.w).max() > 1.0


def test_regenerated_noise_changes_the_command():
    once, anew = drive(follower(noise="nav2"), 3), drive(follower(noise="nav2", regenerate_noises=True), 3)
    assert once != anew


def test_iterations_add_up():
    call = make_call(MppiParams(batch_size=40, iteration_count=2, critics=["PreferForwardCritic"], gamma=0.0))
    twice = evaluate(*call)
    once = evaluate(call[0].replace(iteration_count=1), *call[1:])
    assert (twice.total >= once.total - 1e-6).all()
    np.testing.assert_allclose(twice.total, once.costs[0] + twice.costs[0], rtol=1e-5)


# --- the path --------------------------------------------------------------------------------------------------------


def straight_plan(length=4.0, spacing=0.05):
    x = np.arange(0, length + 1e-9, spacing)
    return np.column_stack([x, np.zeros((len(x), 2))])


def test_local_path_is_pruned_and_what_is_passed_is_forgotten():
    paths = PathHandler(MppiParams(prune_distance=1.02))
    paths.set_plan(straight_plan())
    window = paths.local_path(Pose(1.01, 0.2), free_map())
    assert (window[0, 0], window[-1, 0]) == pytest.approx((1.0, 2.0))
    assert paths.local_path(Pose(0.2, 0.0), free_map())[0, 0] == pytest.approx(1.0)


def test_local_path_ends_at_the_costmap():
    paths = PathHandler(MppiParams(prune_distance=3.0))
    paths.set_plan(straight_plan())
    small = Costmap(np.zeros((40, 40), dtype=np.uint8), 0.05, -1.0, -1.0)
    assert paths.local_path(Pose(0, 0), small)[-1, 0] == pytest.approx(0.95)
    with pytest.raises(ControllerAbort, match="0 poses"):
        paths.local_path(Pose(1.7, 0), Costmap(small.costs, 0.05, 3.0, 3.0))


def test_nearest_pose_is_sought_only_so_far():
    paths = PathHandler(MppiParams(max_robot_pose_search_dist=0.52))
    paths.set_plan(straight_plan())
    assert paths.local_path(Pose(3, 0), free_map())[0, 0] == pytest.approx(0.5)


def test_a_cusp_is_passed_only_when_reached():
    there, back = straight_plan(1.0), straight_plan(1.0)[-2::-1]
    paths = PathHandler(MppiParams(enforce_path_inversion=True))
    paths.set_plan(np.concatenate([there, back]))
    assert paths.local_path(Pose(0.1, 0), free_map())[-1, 0] == pytest.approx(1.0)
    assert paths.local_path(Pose(0.9, 0, 1.0), free_map())[-1, 0] == pytest.approx(1.0)
    assert len(paths.local_path(Pose(0.9, 0), free_map())) < 4
    assert paths.local_path(Pose(0.9, 0), free_map())[-1, 0] == pytest.approx(0.0)


def test_empty_plan():
    made = follower(path=np.empty((0, 3)))
    with pytest.raises(ControllerAbort, match="zero length"):
        drive(made, 1)


# --- parameters ------------------------------------------------------------------------------------------------------


def test_dotted_and_nested_names_are_one():
    dotted = MppiParams(**{"CostCritic.cost_weight": 2.0, "AckermannConstraints.min_turning_r": 0.4})
    assert dotted == MppiParams(CostCritic={"cost_weight": 2.0}, AckermannConstraints={"min_turning_r": 0.4})
    assert len(MppiParams.critic_names()) == 11


@pytest.mark.parametrize(
    ("params", "message"),
    [
        ({"critics": []}, "at least one"),
        ({"critics": ["CostCritic", "CostCritic"]}, "once"),
        ({"vx_min": 0.6}, "vx_min: expected at most vx_max"),
        ({"batch_size": 1_000_000, "time_steps": 100}, "batch_size: expected at most"),
        ({"ObstaclesCritic": {"cost_weight": 1.0}}, "unknown key 'cost_weight'; did you mean 'critical_weight'?"),
        ({"noise": "dice"}, "noise"),
    ],
)
def test_contradictions_are_refused(params, message):
    with pytest.raises(ConfigError, match=re.escape(message)) as error:
        MppiParams(**params)
    assert "\n" not in str(error.value)


def test_known_keys_do_not_overlap():
    known = set(parameter_names(MppiParams))
    assert not known & (set(ROS_ONLY_KEYS) | set(RENAMED_KEYS))
    assert set(JAZZY_DEFAULTS) | set(LYRICAL_DEFAULTS) <= known
    assert set(RENAMED_KEYS.values()) <= known
