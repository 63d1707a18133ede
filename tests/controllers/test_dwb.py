"""DWB: the worked examples (T5), the critics' memory, refusals, and equality with a slow plain twin."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from controllers.base import ControllerError, FollowerSetup, InvalidPath, Twist
from controllers.dwb.controller import DwbFollower
from controllers.dwb.kernels.plan import distance_fields, gap_parts
from controllers.dwb.params import ROS_ONLY_KEYS, DwbParams
from gym_mapbench.costmap import Costmap
from gym_mapbench.errors import ConfigError
from gym_mapbench.ros_params import nest_dotted
from gym_mapbench.world.footprint import Footprint
from gym_mapbench.world.scenario import Pose
from tests.controllers.plain_dwb import Twin, cells_on_map, flood
from tests.controllers.plain_follower import local_plan

STANDARD = "dwb_plugins::StandardTrajectoryGenerator"
LIMITED = "dwb_plugins::LimitedAccelGenerator"
# Nav2's example, nav2_params.yaml.
WINDOWED = "humble", "jazzy"
"""Releases whose DWB cuts the plan itself."""
EXAMPLE = {
    "max_vel_x": 0.26,
    "max_vel_theta": 1.0,
    "max_speed_xy": 0.26,
    "acc_lim_x": 2.5,
    "acc_lim_theta": 3.2,
    "decel_lim_x": -2.5,
    "decel_lim_theta": -3.2,
    "linear_granularity": 0.05,
    "critics": ("RotateToGoal", "Oscillation", "BaseObstacle", "GoalAlign", "PathAlign", "PathDist", "GoalDist"),
    "BaseObstacle": {"scale": 0.02},
    "PathAlign": {"scale": 32.0, "forward_point_distance": 0.1},
    "GoalAlign": {"scale": 24.0, "forward_point_distance": 0.1},
    "PathDist": {"scale": 32.0},
    "GoalDist": {"scale": 24.0},
    "RotateToGoal": {"scale": 32.0},
}
FREE = Costmap(np.zeros((60, 60), np.uint8), 0.05, -1.5, -1.5)
HERE = Pose(0.02, 0.02, 0.0)
REST = Twist(0.0, 0.0)


def make_setup(control_period=0.05):
    return FollowerSetup(Footprint.from_radius(0.1), control_period, 0.25, 0.25, 0.55, 3.0, np.random.default_rng(0))


def make(plan=None, **changes):
    follower = DwbFollower(DwbParams(**{**EXAMPLE, **changes}))
    follower.reset(make_setup())
    follower.set_plan(straight_plan() if plan is None else plan)
    return follower


def straight_plan(x0=0.02):
    x = np.append(np.arange(0.0, 1.2001, 0.025), 3.0) + x0
    return np.stack([x, np.full_like(x, 0.02), np.zeros_like(x)], axis=1)


def find(evaluation, v, w):
    return int(np.abs(evaluation.twists - [v, w]).max(axis=1).argmin())


def raw(evaluation, name, candidate):
    return float(evaluation.raw_scores[candidate, evaluation.critics.index(name)])


# T5.1 and T5.2: sampling


def test_standard_generator_samples_the_whole_window():
    twists = make().evaluate(HERE, Twist(0.1, 0.0), FREE, 0.0).twists
    assert len(twists) == 419
    np.testing.assert_allclose(np.unique(twists[:, 0].round(9)), np.linspace(0, 0.26, 20), atol=1e-7)
    omega = np.unique(twists[:, 1].round(9))
    np.testing.assert_allclose(omega, np.sort(np.append(np.linspace(-1, 1, 20), 0.0)), atol=1e-7)


def test_limited_generator_samples_one_period():
    follower = make(trajectory_generator_name=LIMITED)
    twists = follower.evaluate(HERE, Twist(0.1, 0.2), FREE, 0.0).twists
    np.testing.assert_allclose(np.unique(twists[:, 0].round(9)), np.linspace(0, 0.225, 20), atol=1e-7)
    np.testing.assert_allclose(np.unique(twists[:, 1].round(9)), np.linspace(0.04, 0.36, 20), atol=1e-7)


def test_limited_generator_prefers_sim_period():
    follower = make(trajectory_generator_name=LIMITED, sim_period=0.01)
    twists = follower.evaluate(HERE, Twist(0.1, 0.0), FREE, 0.0).twists
    assert twists[:, 0].min() == pytest.approx(0.075)
    assert twists[:, 0].max() == pytest.approx(0.125)


def test_the_zero_command_is_never_a_candidate():
    assert not (make().evaluate(HERE, REST, FREE, 0.0).twists == 0.0).all(axis=1).any()


def test_speed_bounds_drop_candidates():
    evaluation = make(min_speed_xy=0.1, min_speed_theta=0.3).evaluate(HERE, REST, FREE, 0.0)
    slow = np.abs(evaluation.twists) < [0.099, 0.299]
    assert not slow.all(axis=1).any()
    assert len(make(max_speed_xy=0.13).evaluate(HERE, REST, FREE, 0.0).twists) == 10 * 21 - 1


# T5.3: rollout


@pytest.mark.parametrize(
    ("twist", "steps", "end"),
    [
        ((0.26, 0.0), 9, (0.442, 0.0, 0.0)),
        ((0.26, 1.0), 68, (0.29019, 0.25393, 1.556)),
        ((0.0, 0.5), 34, (0.0, 0.0, 0.823)),
    ],
)
def test_rollout_from_rest(twist, steps, end):
    follower = make(vtheta_samples=5, plan=straight_plan() - [0.02, 0.02, 0.0])
    candidate = find(follower.evaluate(Pose(0.0, 0.0, 0.0), REST, FREE, 0.0), *twist)
    poses = follower.trajectory(candidate)
    assert len(poses) == steps + 1
    np.testing.assert_allclose(poses[-1], end, atol=6e-6)


def test_rollout_turns_after_it_has_moved():
    follower = make(plan=straight_plan() - [0.02, 0.02, 0.0])
    candidate = find(follower.evaluate(Pose(0.0, 0.0, 0.0), REST, FREE, 0.0), 0.26, 1.0)
    np.testing.assert_allclose(follower.trajectory(candidate)[1], (0.0015625, 0.0, 0.002), atol=1e-12)


def test_discretize_by_time():
    follower = make(discretize_by_time=True, time_granularity=0.5)
    evaluation = follower.evaluate(HERE, REST, FREE, 0.0)
    assert all(len(follower.trajectory(i)) == 5 for i in range(0, len(evaluation.twists), 50))


# T5.4: scores


@pytest.mark.parametrize(
    ("twist", "scores", "total"),
    [
        ((0.26, 0.0), (15, 0, 0, 15), 18.0),
        ((0.26, 0.157895), (17, 2, 1, 16), 22.2),
        ((0.0, 1.0), None, 32.8),
        ((0.26, 1.0), None, 39.6),
    ],
)
def test_scores_on_a_free_map(twist, scores, total):
    evaluation = make().evaluate(HERE, REST, FREE, 0.0)
    candidate = find(evaluation, *twist)
    assert evaluation.totals[candidate] == pytest.approx(total, abs=1e-5)
    assert evaluation.totals.dtype == np.float32
    if scores is not None:
        names = ("GoalAlign", "PathAlign", "PathDist", "GoalDist")
        assert tuple(raw(evaluation, name, candidate) for name in names) == scores


def test_score_off_the_sample_grid():
    evaluation = make(vx_samples=3).evaluate(HERE, REST, FREE, 0.0)
    assert evaluation.totals[find(evaluation, 0.13, 0.0)] == pytest.approx(24.0, abs=1e-5)


def test_straight_ahead_is_best():
    follower = make()
    assert follower.compute_velocity_commands(HERE, REST, FREE, 0.0) == pytest.approx((0.26, 0.0))
    evaluation = follower.evaluate(HERE, REST, FREE, 0.0)
    assert evaluation.best == find(evaluation, 0.26, 0.0)
    np.testing.assert_allclose(evaluation.scales, [32, 1, 0.02, 0.6, 0.8, 0.8, 0.6], rtol=1e-6)


def test_jazzy_seeks_the_robot_as_far_as_it_looks_ahead():
    passed = np.column_stack([np.linspace(-0.5, 1.0, 151), np.full(151, 0.02), np.zeros(151)])
    begins = {}
    for release, ahead in (("humble", 0.9), ("jazzy", 0.9), ("jazzy", -1.0)):
        follower = make(release=release, prune_distance=0.195, forward_prune_distance=ahead)
        follower.set_plan(passed)
        follower.evaluate(HERE, REST, FREE, 0.0)
        begins[release, ahead] = follower._plan[0, 0]
    # The robot is at 0.02, the first pose within 0.195 m of it 0.33 m along the plan.
    assert begins["jazzy", 0.9] == begins["jazzy", -1.0] == pytest.approx(-0.17)
    assert begins["humble", 0.9] == pytest.approx(-0.3)
    follower = make(release="jazzy", prune_distance=0.2, forward_prune_distance=0.2)
    follower.set_plan(passed)
    with pytest.raises(InvalidPath, match="0 poses"):
        follower.evaluate(HERE, REST, FREE, 0.0)
    with pytest.raises(ConfigError, match="forward_prune_distance"):
        DwbParams(**EXAMPLE, forward_prune_distance=-1.0)


def test_jazzy_is_stricter_about_the_limits_of_speed():
    fast = {"max_vel_x": math.sqrt(0.26**2 + 5e-6), "max_speed_xy": 0.26}  # its square is less than 1e-5 beyond
    highest = [make(release=one, **fast).evaluate(HERE, REST, FREE, 0.0).twists[:, 0].max() for one in WINDOWED]
    assert highest[0] == pytest.approx(fast["max_vel_x"], abs=1e-12)
    assert highest[1] < 0.26


# T5.5: critics


def near_goal(goal_yaw=0.0, **changes):
    return make(plan=np.array([[0.0, 0.02, 0.0], [0.03, 0.02, goal_yaw]]), **changes)


def test_rotate_to_goal_only_turns_at_the_goal():
    follower = near_goal()
    evaluation = follower.evaluate(HERE, REST, FREE, 0.0)
    moving = evaluation.twists[:, 0] != 0.0
    assert (evaluation.illegal_by[moving] == 0).all()
    assert (evaluation.illegal_by[~moving] == -1).all()
    turning = np.flatnonzero(~moving)
    ends = np.array([follower.trajectory(i)[-1, 2] for i in turning])
    np.testing.assert_allclose([raw(evaluation, "RotateToGoal", i) for i in turning], np.abs(ends), atol=1e-12)


def test_rotate_to_goal_weighs_the_heading_error():
    follower = near_goal(critics=("RotateToGoal",))
    evaluation = follower.evaluate(HERE, REST, FREE, 0.0)
    i = find(evaluation, 0.0, 0.263158)
    end = follower.trajectory(i)[-1, 2]
    goal = near_goal(goal_yaw=end + 0.4, critics=("RotateToGoal",))
    assert goal.evaluate(HERE, REST, FREE, 0.0).totals[i] == pytest.approx(12.8, abs=1e-5)


def test_rotate_to_goal_slows_down_first():
    follower = near_goal(max_vel_x=0.5, max_speed_xy=0.5, critics=("RotateToGoal",))
    evaluation = follower.evaluate(HERE, Twist(0.3, 0.0), FREE, 0.0)
    v = evaluation.twists[:, 0]
    assert ((evaluation.illegal_by == 0) == (v * v >= 0.3 * 0.3)).all()
    ends = np.array([follower.trajectory(i)[-1, 2] for i in range(len(v))])
    legal = evaluation.illegal_by < 0
    np.testing.assert_allclose(evaluation.raw_scores[legal, 0], (5 * v * v + np.abs(ends))[legal], atol=1e-12)


def test_rotate_to_goal_looks_ahead_in_time():
    follower = near_goal(critics=("RotateToGoal",), RotateToGoal={"lookahead_time": 0.85})
    evaluation = follower.evaluate(HERE, REST, FREE, 0.0)
    i = find(evaluation, 0.0, 1.0)
    assert raw(evaluation, "RotateToGoal", i) == pytest.approx(abs(follower.trajectory(i)[34, 2]))


def test_rotate_to_goal_remembers_until_the_next_plan():
    follower = near_goal()
    far = Pose(0.6, 0.02, 0.0)
    follower.evaluate(HERE, REST, FREE, 0.0)
    assert (follower.evaluate(far, REST, FREE, 0.0).illegal_by == 0).any()
    follower.set_plan(np.array([[0.0, 0.02, 0.0], [0.03, 0.02, 0.0]]))
    assert not (follower.evaluate(far, REST, FREE, 0.0).illegal_by == 0).any()


def test_prefer_forward_and_twirling():
    follower = make(critics=("PreferForward", "Twirling"), min_vel_x=-0.2, vx_samples=24, vtheta_samples=21)
    evaluation = follower.evaluate(HERE, Twist(0.1, 0.0), FREE, 0.0)
    for v, w, score in ((0.06, 0.1, 1.0), (0.2, 0.3, 3.0), (-0.2, 0.5, 1.0), (0.0, 0.1, 1.0)):
        i = find(evaluation, v, w)
        assert raw(evaluation, "PreferForward", i) == pytest.approx(score)
        assert raw(evaluation, "Twirling", i) == pytest.approx(w)


def test_path_align_is_silent_at_the_goal():
    evaluation = near_goal().evaluate(HERE, REST, FREE, 0.0)
    i = evaluation.critics.index("PathAlign")
    assert evaluation.scales[i] == 0.0
    assert (evaluation.raw_scores[evaluation.illegal_by < 0, i] == 0.0).all()


# Oscillation


def turn_only(**changes):
    """A robot that can only turn, and is told to by the heading at the goal it stands on."""
    return make(critics=("RotateToGoal", "Oscillation"), Oscillation=changes)


def swap_plan(follower, plan):
    """Give a plan of which the critics hear nothing."""
    memory = follower._memory.copy()
    follower.set_plan(plan)
    follower._memory[:] = memory


def steer(follower, goal_yaw, pose=HERE, now=0.0):
    """Ask for a command towards a heading; the critics remember what they know."""
    swap_plan(follower, np.array([[pose.x, pose.y, goal_yaw]]))
    return follower.compute_velocity_commands(pose, REST, FREE, now)


def test_oscillation_forbids_the_way_back():
    follower = turn_only()
    assert steer(follower, 1.0).w > 0
    assert steer(follower, -1.0).w < 0
    assert steer(follower, 1.0).w <= 0


def test_oscillation_is_forgotten_with_a_new_plan():
    follower = turn_only()
    steer(follower, 1.0), steer(follower, -1.0)
    follower.set_plan(np.array([[HERE.x, HERE.y, 1.0]]))
    assert steer(follower, 1.0).w > 0


@pytest.mark.parametrize(
    ("pose", "now", "lifted"),
    [
        (Pose(0.08, 0.02, 0.0), 0.1, True),
        (Pose(0.06, 0.02, 0.0), 0.1, False),
        (Pose(0.02, 0.02, 0.21), 0.1, True),
        (Pose(0.02, 0.02, 0.0), 2.1, True),
        (Pose(0.02, 0.02, 0.0), 1.9, False),
    ],
)
def test_oscillation_is_lifted_by_distance_angle_or_time(pose, now, lifted):
    follower = turn_only(oscillation_reset_time=2.0)
    steer(follower, 1.0), steer(follower, -1.0)
    steer(follower, -1.0, pose, now)
    assert (steer(follower, 1.5, pose, now).w > 0) == lifted


def test_oscillation_watches_turns_only_when_slow():
    follower = make(critics=("Oscillation", "PathAlign"), vx_samples=2, min_vel_x=0.2)
    swinging = [np.array([[0.0, 0.02, 0.0], [0.0, y, 0.0]]) for y in (0.5, -0.5, 0.5)]
    for plan in swinging:
        swap_plan(follower, plan)
        assert follower.compute_velocity_commands(HERE, Twist(0.2, 0.0), FREE, 0.0).w * plan[1, 1] > 0


# Lyrical


def test_rotate_to_goal_waits_while_more_than_a_metre_of_the_local_plan_is_left():
    loop = np.array([[0.0, 0.02, 0.0], [0.4, 0.02, 0.0], [0.4, 0.07, 0.0], [0.03, 0.02, 0.0]])
    for path, waits in ((loop, False), (loop * [1.4, 1.0, 1.0] - [0.012, 0.0, 0.0], True)):
        follower = make(path, release="lyrical", critics=("RotateToGoal",))
        follower.take_local_plan(local_plan(path))
        moving = follower.evaluate(HERE, REST, FREE, 0.0).twists[:, 0] != 0.0
        assert ((follower.last_evaluation().illegal_by == 0) == (False if waits else moving)).all()


@pytest.mark.parametrize(("release", "lifted"), [("jazzy", True), ("lyrical", False)])
def test_the_turn_since_a_flip_is_wrapped_in_lyrical(release, lifted):
    follower = make(critics=("RotateToGoal", "Oscillation"), release=release)
    before, after = Pose(0.02, 0.02, 3.1), Pose(0.02, 0.02, -3.1)  # 0.083 rad, less than the 0.2 rad that lift it
    for yaw in (-2.2, 2.1):
        swap_plan(follower, np.array([[0.02, 0.02, yaw]]))
        follower.compute_velocity_commands(before, REST, FREE, 0.0)
    steer(follower, 2.2, after)
    assert (steer(follower, -2.2, after).w > 0) == lifted


# Failures and limits


def blocked():
    costs = np.zeros((60, 60), np.uint8)
    costs[28:33, 28:33] = 253
    return Costmap(costs, 0.05, -1.5, -1.5)


def test_no_legal_sample_names_the_shares():
    with pytest.raises(ControllerError, match=r"no valid trajectories out of 419: BaseObstacle 100.0%"):
        make().compute_velocity_commands(HERE, REST, blocked(), 0.0)


def test_no_candidate_at_all():
    with pytest.raises(ControllerError, match="leave no candidate"):
        make(max_vel_x=0.0, max_vel_theta=0.0).compute_velocity_commands(HERE, REST, FREE, 0.0)


def test_unknown_cells_are_obstacles_to_base_obstacle():
    costs = np.full((60, 60), 255, np.uint8)
    evaluation = make().evaluate(HERE, REST, Costmap(costs, 0.05, -1.5, -1.5), 0.0)
    assert (evaluation.illegal_by == evaluation.critics.index("BaseObstacle")).all()


def test_plan_off_the_map_makes_path_dist_reject_and_path_align_unreachable():
    far = straight_plan(x0=50.02)
    evaluation = make(
        far, critics=("PathAlign", "PathDist"), prune_plan=False, prune_distance=1e9, shorten_transformed_plan=False
    ).evaluate(Pose(50.02, 0.02, 0.0), REST, Costmap(np.zeros((4, 4), np.uint8), 30.0, -60.0, -60.0), 0.0)
    assert (evaluation.illegal_by == -1).any()
    unknown = Costmap(np.full((60, 60), 255, np.uint8), 0.05, -1.5, -1.5)
    both = make(critics=("PathAlign", "PathDist")).evaluate(HERE, REST, unknown, 0.0)
    assert (both.illegal_by == 1).all()
    align = make(critics=("PathAlign",)).evaluate(HERE, REST, unknown, 0.0)
    assert (align.raw_scores == 3601).all()


@pytest.mark.parametrize("plan", [np.empty((0, 3)), straight_plan(x0=100.0)])
def test_no_plan_near_the_robot(plan):
    with pytest.raises(ControllerError, match="plan"):
        make(plan).compute_velocity_commands(HERE, REST, FREE, 0.0)


def test_what_lies_behind_is_forgotten():
    follower = make(prune_distance=0.5)
    follower.evaluate(Pose(0.8, 0.02, 0.0), REST, FREE, 0.0)
    # What began more than 0.5 m behind is gone: coming back, the plan is some cells away.
    evaluation = follower.evaluate(Pose(0.02, 0.02, 0.0), REST, FREE, 0.0)
    assert raw(evaluation, "PathDist", find(evaluation, 0.0, 1.0)) >= 6


def test_speed_limit_in_per_cent_and_in_metres_per_second():
    follower = make()
    for speed, percentage, top in ((50.0, True, 0.13), (0.1, False, 0.1), (9.0, False, 0.1), (0.0, False, 0.26)):
        follower.set_speed_limit(speed, percentage)
        twists = follower.evaluate(HERE, REST, FREE, 0.0).twists
        assert twists[:, 0].max() == pytest.approx(top)
        assert twists[:, 1].max() == pytest.approx(top / 0.26)
    with pytest.raises(ConfigError, match="speed limit"):
        follower.set_speed_limit(-1.0, percentage=False)


def test_reset_forgets_plan_and_speed_limit():
    follower = make()
    follower.set_speed_limit(50.0, percentage=True)
    follower.reset(make_setup())
    with pytest.raises(ControllerError):
        follower.evaluate(HERE, REST, FREE, 0.0)
    follower.set_plan(straight_plan())
    assert follower.evaluate(HERE, REST, FREE, 0.0).twists[:, 0].max() == pytest.approx(0.26)


def test_limit_vel_cmd_in_traj_tells_the_first_step():
    follower = make(limit_vel_cmd_in_traj=True)
    assert follower.compute_velocity_commands(HERE, REST, FREE, 0.0).v == pytest.approx(0.26)
    slow = make(limit_vel_cmd_in_traj=True, acc_lim_x=0.5)
    assert slow.compute_velocity_commands(HERE, REST, FREE, 0.0).v == pytest.approx(0.5 * 1.7 / 9)


# Parameters


@pytest.mark.parametrize(
    ("params", "message"),
    [
        ({}, "expected at least one of"),
        ({"critics": ["PathAling"]}, "did you mean 'PathAlign'"),
        ({"critics": ["PathDist"], "PathDist.scal": 1.0}, "PathDist: unknown key 'scal'; did you mean 'scale'"),
        ({"critics": ["PathDist"], "PathDst": {"scale": 1.0}}, "did you mean 'PathDist'"),
        ({"critics": ["PathDist"], "PathDist.aggregation_type": "mean"}, "'last', 'sum' or 'product'"),
        ({"critics": ["PathDist"], "max_vel_y": 0.1}, "max_vel_y"),
        ({"critics": ["PathDist"], "decel_lim_x": 2.5}, "decel_lim_x: expected less than or equal to 0"),
        ({"critics": ["PathDist"], "min_vel_x": 0.3}, "expected at most max_vel_x"),
        ({"critics": ["PathDist"], "plugin": "dwb_core::DWBLocalPlanner"}, "plugin"),
        ({"critics": ["PathDist"], "PathDist": 3, "PathDist.scale": 2.0}, "group of parameters"),
    ],
)
def test_bad_parameters_are_refused(params, message):
    with pytest.raises(ConfigError, match=message):
        DwbParams(**params)


def test_dotted_and_nested_parameters_are_one():
    dotted = DwbParams(**{"critics": ["PathDist"], "PathDist.scale": 3.0, "PathDist.aggregation_type": "sum"})
    assert dotted == DwbParams(critics=("PathDist",), PathDist={"scale": 3.0, "aggregation_type": "sum"})
    assert nest_dotted({"a": {"b": 1}, "a.c.d": 2}) == {"a": {"b": 1, "c": {"d": 2}}}
    assert dotted.replace(sim_time=1.0).PathDist.scale == 3.0
    assert not ROS_ONLY_KEYS & set(DwbParams.model_fields)


def test_code_defaults():
    params = DwbParams(critics=DwbParams.critic_names())
    assert (params.sim_time, params.linear_granularity, params.vx_samples, params.max_vel_x) == (1.7, 0.5, 20, 0.0)
    assert params.PathAlign.forward_point_distance == 0.325
    assert all(params.critic(name).scale == 1.0 for name in DwbParams.critic_names())


# The slow plain twin


@st.composite
def scenes(draw):
    """A small random costmap, a wandering plan, a robot on it, and parameters that use everything."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    rows, cols = draw(st.integers(8, 26)), draw(st.integers(8, 26))
    values = rng.choice(
        [0, 10, 100, 252, 253, 254, 255], size=(rows, cols), p=[0.8, 0.06, 0.05, 0.04, 0.02, 0.02, 0.01]
    )
    resolution = draw(st.sampled_from([0.02, 0.05, 0.1]))
    costmap = Costmap(values.astype(np.uint8), resolution, *rng.uniform(-1, 1, 2).tolist())
    size = np.array([cols, rows]) * resolution
    corner = np.array([costmap.origin_x, costmap.origin_y])
    start = corner + size * rng.uniform(0.2, 0.8, 2)
    headings = np.cumsum(rng.normal(0, 0.2, 40)) + rng.uniform(-3, 3)
    steps = resolution * rng.choice([0.5, 1.0, 5.0], 40, p=[0.7, 0.25, 0.05])[:, None]
    points = start + np.cumsum(steps * np.stack([np.cos(headings), np.sin(headings)], axis=1), axis=0)
    plan = np.column_stack([points, headings])[: draw(st.integers(1, 40))]
    pose = Pose(*(start + rng.normal(0, resolution, 2)).tolist(), draw(st.floats(-4, 4)))
    velocity = Twist(draw(st.sampled_from([0.0, 0.1, 0.3, -0.05])), draw(st.floats(-1.2, 1.2)))
    return costmap, plan, pose, velocity


@st.composite
def windows(draw):
    """How Humble and Jazzy cut the plan."""
    return {
        "release": draw(st.sampled_from(WINDOWED)),
        "prune_plan": draw(st.booleans()),
        "prune_distance": draw(st.sampled_from([0.3, 2.0])),
        "forward_prune_distance": draw(st.sampled_from([0.3, 2.0])),
        "shorten_transformed_plan": draw(st.booleans()),
    }


@st.composite
def parameters(draw, plan_window):
    grid = st.fixed_dictionaries(
        {
            "scale": st.sampled_from([0.0, 1.0, 24.0]),
            "aggregation_type": st.sampled_from(["last", "last", "sum", "product"]),
        }
    )
    align = st.builds(lambda d, f: {**d, "forward_point_distance": f}, grid, st.sampled_from([0.0, 0.1, 0.325]))
    obstacle = st.fixed_dictionaries({"scale": st.sampled_from([0.02, 1.0]), "sum_scores": st.booleans()})
    critics = draw(st.lists(st.sampled_from(DwbParams.critic_names()), min_size=1, max_size=7, unique=True))
    return DwbParams(
        **{
            **EXAMPLE,
            **draw(plan_window),
            "min_speed_theta": draw(st.sampled_from([0.0, 0.5])),
            "critics": critics,
            "min_vel_x": draw(st.sampled_from([0.0, -0.1])),
            "vx_samples": draw(st.integers(1, 5)),
            "vtheta_samples": draw(st.integers(1, 6)),
            "sim_time": draw(st.sampled_from([0.6, 1.7])),
            "linear_granularity": draw(st.sampled_from([0.05, 0.01])),
            "angular_granularity": draw(st.sampled_from([0.025, 0.2])),
            "discretize_by_time": draw(st.booleans()),
            "time_granularity": 0.15,
            "include_last_point": draw(st.booleans()),
            "limit_vel_cmd_in_traj": draw(st.booleans()),
            "short_circuit_trajectory_evaluation": draw(st.booleans()),
            "trajectory_generator_name": draw(st.sampled_from([STANDARD, STANDARD, LIMITED])),
            "BaseObstacle": draw(obstacle),
            "ObstacleFootprint": draw(obstacle),
            "PathAlign": draw(align),
            "GoalAlign": draw(align),
            "PathDist": draw(grid),
            "GoalDist": draw(grid),
        }
    )  # fmt: skip


def test_of_a_plan_of_one_pose_only_the_moved_end_is_left():
    """Nav2 moves the last pose before it fills gaps; with one pose there is no gap from where it was."""
    costs = np.zeros((10, 12), np.uint8)
    plan = np.array([[0.3, 0.25, 0.0]])
    fields, _, _ = distance_fields(plan, 0.1, 0.0, costs, 0.0, 0.0, 0.05, (0.0, 0.6, 0.0, 0.5))
    assert fields[2].reshape(10, 12)[5].tolist() == [abs(col - 8) for col in range(12)]
    fields, _, _ = distance_fields(plan, 0.5, 0.0, costs, 0.0, 0.0, 0.05, (0.0, 0.6, 0.0, 0.5))
    assert (fields[2] == costs.size + 1).all()


@settings(max_examples=100)
@given(scenes(), parameters(windows()))
def test_equals_the_plain_twin(scene, params):
    costmap, plan, pose, velocity = scene
    follower = DwbFollower(params)
    follower.reset(make_setup())
    follower.set_plan(plan)
    try:
        evaluation = follower.evaluate(pose, velocity, costmap, 0.0)
    except (ControllerError, InvalidPath):
        return
    assert_judged(evaluation, make_twin(params).evaluate(plan, pose, velocity, costmap))
    follower.set_plan(plan)
    assert_command(follower, evaluation, pose, velocity, costmap)


@settings(max_examples=100)
@given(scenes(), parameters(st.just({"release": "lyrical"})), st.integers(1, 40))
def test_lyrical_equals_the_plain_twin(scene, params, shown):
    costmap, plan, pose, velocity = scene
    follower, local = DwbFollower(params), local_plan(plan[:shown])
    follower.reset(make_setup())
    follower.set_plan(plan)
    follower.take_local_plan(local)
    evaluation = follower.evaluate(pose, velocity, costmap, 0.0)
    assert_judged(evaluation, make_twin(params).evaluate(local.path, pose, velocity, costmap, Pose(*plan[-1].tolist())))
    follower.set_plan(plan)
    follower.take_local_plan(local)
    assert_command(follower, evaluation, pose, velocity, costmap)


def make_twin(params):
    return Twin(params, make_setup().footprint.corners, 0.05)


def assert_judged(evaluation, expected):
    rows, best = expected
    assert len(rows) == len(evaluation.twists)
    for i, (twist, scores, total, illegal_by) in enumerate(rows):
        assert tuple(evaluation.twists[i]) == twist
        assert evaluation.illegal_by[i] == illegal_by
        np.testing.assert_allclose(evaluation.raw_scores[i], scores, rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(evaluation.totals[i], total, rtol=1e-6)
    assert evaluation.best == best


def assert_command(follower, evaluation, pose, velocity, costmap):
    """The command is that of the chosen candidate, though not all were asked for it."""
    if evaluation.best < 0:
        with pytest.raises(ControllerError):
            follower.compute_velocity_commands(pose, velocity, costmap, 0.0)
    else:
        command = follower.compute_velocity_commands(pose, velocity, costmap, 0.0)
        assert command == tuple(evaluation.velocities[evaluation.best])


@settings(max_examples=60)
@given(
    st.integers(0, 2**32 - 1),
    st.integers(3, 20),
    st.integers(3, 20),
    st.lists(st.floats(-0.2, 1.2), min_size=4, max_size=4),
)
def test_fields_are_manhattan_distances(seed, rows, cols, corners):
    rng = np.random.default_rng(seed)
    costmap = Costmap(rng.choice([0, 255], size=(rows, cols), p=[0.9, 0.1]).astype(np.uint8), 0.1, 0.0, 0.0)
    plan = np.cumsum(rng.uniform(-0.2, 0.3, (12, 3)), axis=0)
    box = (min(corners[:2]) * cols, max(corners[:2]) * cols, min(corners[2:]) * rows, max(corners[2:]) * rows)
    box = tuple(0.1 * edge for edge in box)
    fields, skipped, reached = distance_fields(plan, 0.0, 0.0, costmap.costs, 0.0, 0.0, 0.1, box)
    seeds = cells_on_map(plan, costmap)
    assert reached == bool(seeds)
    for layer, sources in ((0, seeds), (1, seeds[-1:])):
        expected = flood(sources, (rows, cols)).ravel()
        for x in np.linspace(box[0], box[1], 5):
            for y in np.linspace(box[2], box[3], 5):
                cell = costmap.world_to_map(x, y)
                if cell is not None:
                    flat = cell[0] * cols + cell[1]
                    assert fields[layer, flat - skipped] == expected[flat]


def test_gaps_of_the_plan_below_three_cells_stay():
    assert [gap_parts(d * 0.05, 0.0, 0.05) for d in (1.0, 2.01, 2.99, 4.01, 5.01, 8.01)] == [1, 1, 1, 1, 2, 5]


def test_a_way_through_a_wall_is_rejected_though_its_end_is_free():
    costs = np.zeros((60, 60), np.uint8)
    costs[:, 34] = 254
    wall = Costmap(costs, 0.05, -1.5, -1.5)
    evaluation = make(critics=("BaseObstacle", "GoalDist")).evaluate(HERE, REST, wall, 0.0)
    through = find(evaluation, 0.26, 0.0)
    assert evaluation.illegal_by[through] == 0
    assert math.isclose(evaluation.totals[evaluation.best], evaluation.totals[evaluation.illegal_by < 0].min())
