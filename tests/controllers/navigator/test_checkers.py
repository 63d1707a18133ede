from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from controllers.base import Twist
from controllers.checkers import GoalChecker, ProgressChecker
from controllers.navigator.checkers import SimpleGoalChecker, make_goal_checker, make_progress_checker
from gym_mapbench.world.scenario import Pose

STILL = Twist(0.0, 0.0)
GOAL = Pose(0.0, 0.0, 0.0)


def test_t3_position_is_latched_until_a_new_path():
    checker = SimpleGoalChecker(GoalChecker())
    assert not checker.is_goal_reached(Pose(0.24, 0.0, 0.5), GOAL, STILL)
    assert checker.is_goal_reached(Pose(0.27, 0.0, 0.2), GOAL, STILL)


def test_t3_a_new_path_between_unlatches():
    checker = SimpleGoalChecker(GoalChecker())
    assert not checker.is_goal_reached(Pose(0.24, 0.0, 0.5), GOAL, STILL)
    checker.reset()
    assert not checker.is_goal_reached(Pose(0.27, 0.0, 0.2), GOAL, STILL)


def test_stateless_checker_latches_nothing():
    checker = SimpleGoalChecker(GoalChecker(stateful=False))
    assert not checker.is_goal_reached(Pose(0.24, 0.0, 0.5), GOAL, STILL)
    assert not checker.is_goal_reached(Pose(0.27, 0.0, 0.2), GOAL, STILL)
    assert checker.is_goal_reached(Pose(0.0, 0.24, 0.2), GOAL, STILL)


def test_both_tolerances_include_their_border():
    checker = SimpleGoalChecker(GoalChecker())
    assert checker.is_goal_reached(Pose(0.25, 0.0, 0.25), GOAL, STILL)


@pytest.mark.parametrize(("yaw", "plain", "symmetric"), [(0.2, True, True), (3.0, False, True), (1.5, False, False)])
def test_symmetric_yaw(yaw, plain, symmetric):
    pose = Pose(0.0, 0.0, yaw)
    assert SimpleGoalChecker(GoalChecker()).is_goal_reached(pose, GOAL, STILL) is plain
    opposite = SimpleGoalChecker(GoalChecker(symmetric_yaw_tolerance=True))
    assert opposite.is_goal_reached(pose, GOAL, STILL) is symmetric


@given(yaw=st.floats(-10, 10), goal_yaw=st.floats(-10, 10))
def test_yaw_error_is_wrapped(yaw, goal_yaw):
    error = math.acos(max(-1.0, min(1.0, math.cos(goal_yaw - yaw))))
    reached = SimpleGoalChecker(GoalChecker()).is_goal_reached(Pose(0, 0, yaw), Pose(0, 0, goal_yaw), STILL)
    if abs(error - 0.25) > 1e-6:
        assert reached is (error < 0.25)


@pytest.mark.parametrize(("v", "w", "reached"), [(0.25, -0.25, True), (0.26, 0.0, False), (0.0, -0.26, False)])
def test_stopped_goal_checker(v, w, reached):
    checker = make_goal_checker(GoalChecker(plugin="stopped"))
    assert checker.is_goal_reached(GOAL, GOAL, Twist(v, w)) is reached


def test_position_alone():
    checker = make_goal_checker(GoalChecker(plugin="position"))
    assert checker.is_goal_reached(Pose(0.24, 0, 3.0), Pose(0, 0, 0), Twist(0.5, 1.0))
    assert checker.is_goal_reached(Pose(0.9, 0, 3.0), Pose(0, 0, 0), Twist(0, 0))
    checker.reset()
    assert not checker.is_goal_reached(Pose(0.26, 0, 0), Pose(0, 0, 0), Twist(0, 0))


def test_t3_progress():
    checker = make_progress_checker(ProgressChecker())
    assert checker.check(Pose(0.0, 0.0, 0.0), 1.0)
    assert checker.check(Pose(0.5, 0.0, 0.0), 11.0)
    assert not checker.check(Pose(0.5, 0.0, 0.0), 11.05)


def test_t3_baseline_moves_at_more_than_the_radius():
    checker = make_progress_checker(ProgressChecker())
    assert checker.check(Pose(0.0, 0.0, 0.0), 0.0)
    assert checker.check(Pose(0.51, 0.0, 0.0), 9.0)
    assert checker.check(Pose(0.1, 0.0, 0.0), 19.0)
    assert not checker.check(Pose(0.1, 0.0, 0.0), 19.05)


def test_progress_begins_anew_after_reset():
    checker = make_progress_checker(ProgressChecker())
    checker.check(Pose(0.0, 0.0, 0.0), 0.0)
    checker.reset()
    assert checker.check(Pose(0.0, 0.0, 0.0), 50.0)


def test_allowance_counts_control_periods_exactly():
    checker = make_progress_checker(ProgressChecker(movement_time_allowance=0.3))
    passed = [checker.check(Pose(0.0, 0.0, 0.0), step * 0.05) for step in range(8)]
    assert passed == [True] * 7 + [False]


def test_turning_is_progress_only_to_the_pose_checker():
    turned = Pose(0.0, 0.0, 0.51)
    for plugin, expected in (("simple", False), ("pose", True)):
        checker = make_progress_checker(ProgressChecker(plugin=plugin))
        checker.check(Pose(0.0, 0.0, 0.0), 0.0)
        assert checker.check(turned, 11.0) is expected


def test_no_checker_never_complains():
    checker = make_progress_checker(ProgressChecker(plugin="none"))
    checker.reset()
    assert checker.check(GOAL, 0.0)
    assert checker.check(GOAL, 1e6)
