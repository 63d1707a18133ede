"""MPPI as Lyrical has it: examples by hand, the plain twin, and what the trajectory validator and resets mean."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from controllers.base import STOP, ControllerError, LocalPlan, Twist
from controllers.mppi.evaluation import evaluate
from controllers.mppi.kernels.delay import delay
from controllers.mppi.kernels.lengths import furthest_within_length
from controllers.mppi.kernels.rollout import BLOCK
from controllers.mppi.kernels.sequence import limit_from_start, start_sequence
from controllers.mppi.kernels.update import FILTER, LINEAR_FILTER
from controllers.mppi.lyrical import LyricalOptimizer
from controllers.mppi.noise import Layout, LyricalNoise, make_source
from controllers.mppi.params import MppiParams
from controllers.mppi.records import CALL, make_tuning
from gym_mapbench.costmap import Costmap
from gym_mapbench.errors import ConfigError
from gym_mapbench.world.scenario import Pose
from tests.controllers.plain_mppi_lyrical import PlainLyrical
from tests.controllers.test_mppi import (
    RECTANGLE,
    STEPS,
    curved_path,
    follower,
    free_map,
    make_call,
    make_setup,
    straight_plan,
)
from tests.controllers.test_mppi import drive as drive_follower
from tests.controllers.test_mppi_jazzy import EXAMPLE

LAST = Twist(0.3, 0.05)
STRAIGHT = np.column_stack([0.05 * np.arange(41), np.zeros((41, 2))])


def lyrical(**options):
    return MppiParams(release="lyrical", **options)


def sequence(values, turns=None):
    turns = np.zeros(len(values)) if turns is None else turns
    return np.array(values, dtype=np.float32), np.array(turns, dtype=np.float32)


def records(params, speeds=(0.0, 0.0), period=0.05):
    call = np.zeros(1, dtype=CALL)
    call["v"], call["w"] = speeds
    tuning = make_tuning(params, make_setup(period=period))
    tuning["lowest_speed"], tuning["highest_speed"] = params.vx_min, params.vx_max
    tuning["fastest_turn"] = params.wz_max
    return tuning, call


# --- examples by hand ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("radius", "cost"), [(-1.0, 107), (0.3, 163), (0.5, 253)])
def test_outlines_are_checked_from_the_cost_that_the_layers_own_inscribed_radius_gives(radius, cost):
    # 252 exp(-3 (0.444072 - 0.16)) = 107.4; with 0.3 m in the layer 163.5; the whole robot lies within 0.5 m.
    setup = dataclasses.replace(make_setup(RECTANGLE), custom_inscribed_radius=radius)
    assert make_tuning(lyrical(), setup)["circumscribed_cost"] == cost


@pytest.mark.parametrize(
    ("last", "measured", "expected"),
    [
        ((0.0, 0.0), (0.3, 0.0), (0.15, 0.0)),
        ((0.0, 0.0), (0.00909, -0.64538), (0.0, -0.47038)),
        ((0.4016, -1.09172), (0.3516, -0.99172), (0.4016, -1.09172)),
        ((0.5, 1.0), (0.2, 0.9), (0.35, 1.0)),
    ],
)
def test_trajectories_start_from_the_last_command_within_reach_of_the_measured_speed(last, measured, expected):
    call = make_call(lyrical(batch_size=5))
    ours = evaluate(*call[:3], Twist(*measured), *call[4:], None, Twist(*last))
    assert ours.start == pytest.approx(expected, abs=1e-6)
    open_loop = evaluate(lyrical(batch_size=5, open_loop=True), *call[1:3], Twist(*measured), *call[4:], None, LAST)
    assert open_loop.start == LAST


def test_the_sequence_starts_at_these_speeds():
    v, w = sequence([0.5, 0.5], [1.0, 1.0])
    start_sequence(*records(lyrical(), (0.2, -0.1)), v, w)
    assert (v.tolist(), w.tolist()) == (sequence([0.2, 0.5])[0].tolist(), sequence([-0.1, 1.0])[0].tolist())
    v, w = sequence([0.5, 0.5], [1.0, 1.0])
    start_sequence(*records(lyrical(), (0.2, -0.1), period=0.02), v, w)  # sent at once, so it has to be within reach
    assert (v[0], w[0]) == pytest.approx((0.26, -0.03))


def test_the_sequence_is_limited_from_the_speeds_of_the_start():
    v, w = sequence([0.4, 0.5, 0.5, 0.5, -0.9, -0.9], [0.0, 0.9, 0.9, -9.0, -9.0, -9.0])
    limit_from_start(*records(lyrical(), (0.1, 0.5)), v, w)
    assert v == pytest.approx([0.1, 0.25, 0.4, 0.5, 0.35, 0.2])
    assert w == pytest.approx([0.5, 0.675, 0.85, 0.675, 0.5, 0.325])
    v, w = sequence([0.5, 0.5, 0.5])
    limit_from_start(*records(lyrical(), (0.0, 0.0), period=0.02), v, w)  # the first step takes a control period
    assert v == pytest.approx([0.06, 0.21, 0.36])


def test_from_zero_forwards_is_away_from_zero():
    params = lyrical(ax_max=2.0, ax_min=-1.0)
    for wanted, reached in ((0.5, 0.1), (-0.5, -0.05)):
        v, w = sequence([0.0, wanted])
        limit_from_start(*records(params), v, w)
        assert v[1] == pytest.approx(reached)


def test_speed_limits_come_before_those_of_the_acceleration():
    v, w = sequence([0.6, 0.6, 0.6])
    limit_from_start(*records(lyrical(), (0.9, 0.0)), v, w)
    tuning, call = records(lyrical(), (0.9, 0.0))
    tuning["highest_speed"] = 0.2
    slow, turn = sequence([0.6, 0.6, 0.6])
    limit_from_start(tuning, call, slow, turn)
    assert v == pytest.approx([0.75, 0.6, 0.5])
    assert slow == pytest.approx([0.75, 0.6, 0.45])


def test_ackermann_turns_no_tighter_than_its_radius():
    v, w = sequence([0.2, 0.2], [5.0, 5.0])
    params = lyrical(motion_model="Ackermann", AckermannConstraints={"min_turning_r": 0.5}, az_max=100.0)
    limit_from_start(*records(params, (0.2, 0.0)), v, w)
    assert w == pytest.approx([0.0, 0.4])


def test_delay():
    velocities = np.arange(1.0, 7.0, dtype=np.float32).reshape(1, 6, 1)  # velocities of the points 1 to 5, and one more
    sent = np.array([0.1, 0.2, 0.3], dtype=np.float32)
    delay(velocities, sent)
    assert velocities[0, :, 0] == pytest.approx([0.2, 0.3, 1.0, 2.0, 3.0, 6.0])
    delay(velocities, np.array([9.0], dtype=np.float32))
    assert velocities[0, :, 0] == pytest.approx([0.2, 0.3, 1.0, 2.0, 3.0, 6.0])
    delay(velocities, np.full(9, 0.5, dtype=np.float32))
    assert velocities[0, :, 0] == pytest.approx([0.5] * 5 + [6.0])


def test_noise_is_that_of_minstd_rand0_time_after_time():
    source = LyricalNoise(Layout(2000, STEPS), (0.2, 0.4))
    noise = source.sample()
    v, w = (values.transpose(1, 0, 2).reshape(STEPS, -1) for values in noise[:2])
    assert v[0, :3] == pytest.approx([-0.0518186, 0.3203184, -0.2997923], abs=1e-7)
    assert v[:3, 0] == pytest.approx([-0.0518186, -0.0182616, -0.2000931], abs=1e-7)
    assert w[0, :3] == pytest.approx([0.0183819, -0.1515822, -0.0078287], abs=1e-7)
    assert w[:3, 0] == pytest.approx([0.0183819, 0.3226504, 0.0413829], abs=1e-7)
    assert source.sample().v[0, 0, 0] == pytest.approx(-0.0525755, abs=1e-7)


@given(st.integers(0, 2**32 - 1), st.integers(1, 300))
def test_uniform_numbers_are_those_of_the_recurrence(seed, count):
    source = LyricalNoise(Layout(1, 1), (1.0, 1.0), seed)
    ours, x = np.concatenate([source._uniforms(count), source._uniforms(7)]), seed % (2**31 - 1) or 1
    for number in ours:
        x = x * 16807 % (2**31 - 1)
        assert number == min(np.float32(x - 1) / np.float32(2147483646), 1 - 2**-24)


def test_a_path_bent_round_a_wall_is_as_long_as_it_is():
    # 1.5 m along the path, but 0.1 m from its end: far from the goal, as Lyrical measures it.
    there, back = np.linspace(0.0, 0.75, 31), np.linspace(0.75, 0.0, 31)
    path = np.column_stack([np.concatenate([there, back]), np.repeat([0.0, 0.1], 31), np.zeros(62)])
    for release, follows in (("lyrical", True), ("jazzy", False)):
        params = MppiParams(release=release, batch_size=20, critics=["PathFollowCritic", "GoalCritic"])
        ours = evaluate(*make_call(params, pose=Pose(0.0, 0.0), path=path, costmap=free_map()))
        assert (ours.costs[0] > 0).any() == follows
        assert (ours.costs[1] > 0).any() != follows


def test_goal_critics_score_at_their_threshold():
    path = np.array([[0.0, 0.0, 0.0], [0.75, 0.0, 0.0]])
    for threshold, scores in ((0.75, True), (0.7499, False)):
        options = {"threshold_to_consider": threshold}
        critics = dict.fromkeys(("GoalCritic", "GoalAngleCritic"), options)
        params = lyrical(batch_size=5, critics=list(critics), **critics)
        ours = evaluate(*make_call(params, pose=Pose(0.0, 0.0), path=path, costmap=free_map()))
        assert (ours.costs > 0).all() == scores


# --- the twin --------------------------------------------------------------------------------------------------------


def compare(call, last=LAST, rel=2e-5):
    """Evaluate a call and its twin; every critic and every step has to agree."""
    ours, plain = evaluate(*call, None, last), PlainLyrical(*call, last=last).run()
    assert ours.start == pytest.approx(plain.start)
    assert (ours.failed, ours.furthest) == (plain.failed, plain.furthest)
    for name, costs in zip(ours.critics, ours.costs, strict=True):
        np.testing.assert_allclose(costs, plain.costs[name], rtol=rel, atol=2e-6, err_msg=name)
    np.testing.assert_allclose(ours.total, plain.total, rtol=rel, atol=1e-5)
    np.testing.assert_allclose([ours.softmax_v, ours.softmax_w], plain.softmax, atol=2e-5)
    np.testing.assert_allclose([ours.filtered_v, ours.filtered_w], plain.filtered, atol=2e-5)
    np.testing.assert_allclose([ours.limited_v, ours.limited_w], plain.limited, atol=2e-5)
    return ours


@pytest.mark.parametrize("seed", range(3))
def test_the_example_is_its_twin(seed):
    ours = compare(make_call(lyrical(batch_size=150, **EXAMPLE), seed))
    assert ours.furthest > 15
    assert (ours.costs[4] > 0).any()


@pytest.mark.parametrize(
    "options",
    [
        {"ax_max": 1.0, "ax_min": -2.0, "az_max": 0.7, "PathAlignCritic": {"use_path_orientations": True}},
        {"motion_model": "Ackermann", "critics": ["ConstraintCritic", "PreferForwardCritic"]},
        {"critics": ["CostCritic", "ObstaclesCritic"], "CostCritic": {"near_collision_cost": 150}},
        {"critics": ["CostCritic"], "CostCritic": {"trajectory_point_step": 5}, "time_steps": 36},
        {"critics": ["CostCritic"], "time_steps": 57},
        {"critics": ["TwirlingCritic", "VelocityDeadbandCritic"],
         "VelocityDeadbandCritic": {"deadband_velocities": (0.1, 0.0, 0.2)}},
        {"critics": ["PathFollowCritic"], "time_steps": 18},
        {"clamp_raw_controls": True, "ax_max": 1.0},
        {"sgf_order": 1, "open_loop": True},
        {"vx_max": 0.3, "vx_min": -0.1, "vy_max": 3.0, "critics": ["ConstraintCritic"]},
    ],
)  # fmt: skip
def test_other_options_are_their_twins(options):
    compare(make_call(lyrical(batch_size=60, **options), seed=7))


@pytest.mark.parametrize("points", [14, 40])
def test_near_the_end_of_the_path(points):
    compare(make_call(lyrical(batch_size=50, critics=["GoalCritic", "GoalAngleCritic", "TwirlingCritic"]), 1,
                      path=curved_path(points)))  # fmt: skip


def test_footprints_are_their_twins():
    params = lyrical(batch_size=40, time_steps=57, critics=["CostCritic"], CostCritic={"consider_footprint": True})
    call = make_call(params, 3, Pose(1.2, 0.1, 0.4), footprint=RECTANGLE)
    call[5].costs[call[5].costs == 254] = 0
    call[5].costs[60, 70] = 254
    compare(call)


def test_a_delayed_rollout_is_its_twin():
    params = lyrical(batch_size=30, model_delay_vx=0.15, model_delay_wz=0.1, critics=["ConstraintCritic", "CostCritic"])
    call = make_call(params, 5)
    _, setup, pose, velocity, path, costmap, controls, noise = call
    optimizer = LyricalOptimizer(params, setup, Fixed([Layout(30, STEPS).pack(*noise)]))
    optimizer.v[:], optimizer.w[:] = controls
    optimizer._queues[0][:], optimizer._queues[1][:] = (0.4, 0.1, 0.2), (0.3, -0.5)
    optimizer.optimize(pose, velocity, path, (0.0, 0.0), costmap)
    plain = PlainLyrical(*call).delay(optimizer._queues).run()
    ours = Layout(30, STEPS).flat(optimizer.critic_costs)
    for costs, name in zip(ours, optimizer.critics, strict=True):
        np.testing.assert_allclose(costs, plain.costs[name], rtol=2e-5, atol=2e-6, err_msg=name)
    np.testing.assert_allclose([optimizer.v, optimizer.w], plain.softmax, atol=2e-5)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 60), st.integers(1, 700))
def test_furthest_within_length_is_that_of_a_full_search(seed, points, samples):
    rng, steps = np.random.default_rng(seed), 9
    path = np.cumsum(rng.normal(0, 0.05, (2, points)), axis=1).astype(np.float32)
    layout = Layout(samples, steps)
    ends = rng.normal(0, 0.4, (2, layout.blocks, layout.samples)).astype(np.float32)
    speeds = rng.normal(0, 0.4, (samples, steps)).astype(np.float32)
    packed = layout.pack(speeds, speeds).v
    lengths = np.abs(speeds[:, :-1]).sum(axis=1, dtype=np.float64) * 0.1
    arc = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path).astype(np.float64)))])
    if np.abs(arc[:, None] - lengths).min() < 1e-5:  # a length in between float32 and float64
        return
    furthest = 0
    for k, (x, y) in enumerate(layout.flat(ends).T):
        reach = next((i for i in range(points) if arc[i] >= lengths[k]), points - 1)
        away = (path[0, : reach + 1] - x) ** 2 + (path[1, : reach + 1] - y) ** 2
        furthest = max(furthest, int(away.argmin()))
    assert furthest_within_length(*path, *ends, packed, np.float32(0.1), samples) == furthest


# --- validator, resets and commands ----------------------------------------------------------------------------------


class Fixed:
    """A source of given sets of noise; the last is repeated."""

    def __init__(self, sets):
        self.sets, self.taken = list(sets), 0

    def sample(self):
        self.taken += 1
        return self.sets[min(self.taken, len(self.sets)) - 1]


def constant(params, v, w=0.0):
    shape = params.batch_size, params.time_steps
    return Layout(*shape).pack(np.full(shape, v, np.float32), np.full(shape, w, np.float32))


def walled(distance):
    """A free map with a wall across the way, and beyond the map's other end nothing."""
    costmap = free_map()
    costmap.costs[:, int((distance + 5.0) / 0.05)] = 253
    return costmap


def drive(optimizer, costmap, velocity=STOP):
    return optimizer.compute(Pose(0.0, 0.0), velocity, STRAIGHT, (2.0, 0.0), costmap)


def moving(noises, **options):
    """An optimizer that drives at the mean of its noise, whatever lies ahead."""
    params = lyrical(batch_size=4, critics=["PathFollowCritic"], gamma=0.0, vx_max=5.0, ax_max=99.0, **options)
    source = Fixed([constant(params, v) for v in noises])
    return LyricalOptimizer(params, make_setup(), source), source


def test_a_trajectory_into_a_wall_is_refused_within_the_time_looked_ahead():
    # 39 steps of 0.05 s at 0.5 m/s lead to 0.975 m; the first step is that of the start, from rest.
    for distance, refused in ((0.9, True), (1.05, False)):
        optimizer, source = moving([0.5])
        if refused:
            with pytest.raises(ControllerError, match="Optimizer fail to compute path"):
                drive(optimizer, walled(distance))
            assert (optimizer.sent, optimizer.v.any()) == (STOP, False)
        else:
            assert drive(optimizer, walled(distance)).v == pytest.approx(0.5, abs=0.1)
        assert source.taken == (3 if refused else 1)
    further, _ = moving([0.5], TrajectoryValidator={"collision_lookahead_time": 9.0})
    with pytest.raises(ControllerError):
        drive(further, walled(1.3))


def test_a_retry_takes_new_noise_and_starts_from_the_same_speeds():
    optimizer, _ = moving([0.5, 0.1])
    optimizer.sent = Twist(0.3, 0.0)
    assert drive(optimizer, walled(0.5), Twist(0.3, 0.0)).v < 0.3
    assert optimizer.start == Twist(0.3, 0.0)
    stubborn, source = moving([0.5, 0.5, 0.1], retry_attempt_limit=2)
    drive(stubborn, walled(0.5))
    assert source.taken == 3


def test_regenerated_noise_is_there_when_a_call_is_retried():
    optimizer, source = moving([0.5, 0.1, 0.2], regenerate_noises=True)
    drive(optimizer, walled(0.5))
    assert source.taken == 3  # one at the start, one in each try
    optimizer.reset()
    assert source.taken == 4


def test_points_off_the_map_are_free_and_footprints_off_the_map_are_not():
    narrow = Costmap(np.zeros((20, 20), dtype=np.uint8), 0.05, -0.5, -0.5)
    optimizer, _ = moving([0.5])
    drive(optimizer, narrow)
    checked, _ = moving([0.5], TrajectoryValidator={"consider_footprint": True})
    with pytest.raises(ControllerError):
        drive(checked, narrow)


def test_the_footprint_is_checked_if_wanted():
    costmap = free_map()
    costmap.costs[104:106, 100:130] = 254  # beside the way
    for considers, refused in ((False, False), (True, True)):
        optimizer, _ = moving([0.5], TrajectoryValidator={"consider_footprint": considers})
        assert (collision(optimizer, costmap) is not None) == refused


def collision(optimizer, costmap):
    try:
        drive(optimizer, costmap)
    except ControllerError as error:
        return error
    return None


@pytest.mark.parametrize(
    ("options", "sets"),
    [({}, 3), ({"retry_attempt_limit": 3}, 5), ({"regenerate_noises": True, "iteration_count": 2}, 5)],
)
def test_a_batch_that_collides_is_no_valid_control(options, sets):
    params = lyrical(batch_size=20, critics=["CostCritic", "PathFollowCritic"], **options)
    source = Fixed([constant(params, 0.1)])
    optimizer = LyricalOptimizer(params, make_setup(), source)
    walls = Costmap(np.full((200, 200), 254, dtype=np.uint8), 0.05, -5.0, -5.0)
    with pytest.raises(ControllerError, match="Optimizer fail to compute path"):
        drive(optimizer, walls)
    assert (optimizer.failed, optimizer.sent, optimizer.chosen) == (True, STOP, None)
    assert source.taken == sets  # Nav2 retries, in vain
    assert (optimizer.total[0, :20] > 500.0).all()  # the costs of the first try, for a reader


def test_commands_fill_the_queues_of_the_delay():
    optimizer, _ = moving([0.5], model_delay_vx=0.1)
    sent = [drive(optimizer, free_map()).v for _ in range(3)]
    assert optimizer._queues[0] == pytest.approx(sent[1:])
    assert len(optimizer._queues[1]) == 0
    optimizer.reset()
    assert not optimizer._queues[0].any()


def test_the_history_holds_filtered_commands_before_the_limits():
    optimizer, _ = moving([0.5], az_max=1.0)
    optimizer._params = optimizer._params.replace(ax_max=0.1)
    optimizer._tuning["ax_max"] = 0.1
    command = drive(optimizer, free_map())
    assert command.v == pytest.approx(0.005)
    assert optimizer._history_v[-1] > 0.1


def test_weights_of_the_filters_add_up_to_one():
    assert FILTER.sum() == pytest.approx(1.0)
    assert LINEAR_FILTER.sum() == pytest.approx(1.0)
    assert len(LINEAR_FILTER) == len(FILTER)


def test_two_iterations_filter_and_limit_in_between():
    params = lyrical(batch_size=40, critics=["PreferForwardCritic"], gamma=0.0, iteration_count=2)
    call = make_call(params, 2)
    once = evaluate(call[0].replace(iteration_count=1), *call[1:], None, LAST)
    twice = evaluate(*call, None, LAST)
    again = evaluate(
        call[0].replace(iteration_count=1), *call[1:6], (once.limited_v, once.limited_w), call[7], None, LAST
    )
    np.testing.assert_allclose(twice.total, once.costs[0] + again.costs[0], rtol=1e-5)


# --- parameters ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"prune_distance": 1.7}, "prune_distance: Nav2 Lyrical has no such parameter: Lyrical's path handler cuts"),
        ({"reset_period": 1.0}, "reset_period: Nav2 Lyrical has no such parameter"),
        ({"sgf_order": 3}, "sgf_order"),
        ({"TrajectoryValidator": {"collision_lookahead": 1.0}}, "collision_lookahead_time"),
        ({"clamp_raw_controls": None}, "clamp_raw_controls: expected a value"),
    ],
)
def test_what_lyrical_does_not_have_is_refused(options, message):
    with pytest.raises(ConfigError, match=message):
        lyrical(**options)


@pytest.mark.parametrize("release", ["humble", "jazzy"])
@pytest.mark.parametrize(
    "options", [{"sgf_order": 1}, {"TrajectoryValidator": {"consider_footprint": True}}, {"model_delay_vx": 0.1}]
)
def test_what_only_lyrical_has_is_refused(release, options):
    name = release.capitalize()
    with pytest.raises(ConfigError, match=f"Nav2 {name} has no such parameter"):
        MppiParams(release=release, **options)


def test_defaults_are_those_of_the_release():
    params = lyrical()
    assert (params.TrajectoryValidator.collision_lookahead_time, params.sgf_order, params.noise_seed) == (2.0, 2, 1)
    assert params.prune_distance is None
    assert "TrajectoryValidator" not in MppiParams().model_dump()
    assert MppiParams(**params.model_dump(mode="json", exclude_none=True)) == params == params.replace(gamma=0.015)


def test_a_block_holds_one_trajectory_after_the_other():
    source = make_source(lyrical(batch_size=BLOCK + 1, time_steps=3, noise="nav2"), np.random.default_rng(0))
    assert isinstance(source, LyricalNoise)
    assert np.abs(source.sample().v[1, :, 1:]).max() == 0.0


# --- the follower ----------------------------------------------------------------------------------------------------


def on_straight_path(**options):
    made = follower(release="lyrical", **options)
    made.take_local_plan(LocalPlan(straight_plan(2.0), 2.0, Pose(2.0, 0.0)))
    return made


def test_the_follower_keeps_its_sequence_through_a_pause_and_forgets_it_when_an_action_ends():
    def commands(gap=0.05, ends=False):
        made = on_straight_path(noise="nav2")
        drive_follower(made, 3)
        if ends:
            made.end_action()
        return drive_follower(made, 1, start=0.1 + gap)

    assert commands() == commands(gap=60.0)
    assert commands() != commands(ends=True)


def test_commands_change_by_no_more_than_the_limits_allow():
    made = on_straight_path(vx_std=1.0, wz_std=2.0, az_max=0.5, ax_max=0.4, ax_min=-0.4)
    speeds = STOP
    for _ in range(20):
        command = made.compute_velocity_commands(Pose(0.4, 0.3, 0.1), speeds, free_map(), 0.0)
        assert abs(command.v - speeds.v) <= 0.4 * 0.05 + 1e-6
        assert abs(command.w - speeds.w) <= 0.5 * 0.05 + 1e-6
        speeds = command
