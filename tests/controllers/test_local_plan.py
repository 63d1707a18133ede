"""Lyrical's path handler, goal checkers and what the tree adds, against worked examples by hand."""

from __future__ import annotations

import numpy as np
import pytest

from controllers.base import InvalidPath, LocalPlan, Twist
from controllers.checkers import GoalChecker
from controllers.navigator.behavior_tree import Condition, Fallback, RoundRobin, Status
from controllers.navigator.checkers import make_goal_checker
from controllers.navigator.path_handler import FeasiblePathHandler
from controllers.navigator.path_keeper import PathKeeper, PathValidity
from controllers.path_handler import PathHandler
from controllers.rpp.dynamic_window import window_command
from gym_mapbench.costmap import Costmap
from gym_mapbench.world.footprint import Footprint
from gym_mapbench.world.scenario import Pose

REST = Twist(0.0, 0.0)


def free_map():
    return Costmap(np.zeros((200, 200), np.uint8), 0.05, -5.0, -5.0)


def straight(length, step=0.05):
    x = np.arange(0.0, length + step / 2, step)
    return np.column_stack([x, np.zeros_like(x), np.zeros_like(x)])


def handler(path, **options):
    made = FeasiblePathHandler(PathHandler(**options))
    made.set_plan(path)
    return made


def at_end(length=0.5, yaw=0.0):
    path = straight(length)
    return LocalPlan(path, length, Pose(length, 0.0, yaw))


def test_the_local_plan_begins_at_the_nearest_pose_and_is_two_metres_long():
    local = handler(straight(4.5)).local_plan(Pose(1.02, 0.1), free_map())
    assert (local.path[0, 0], local.path[-1, 0], local.goal.x) == pytest.approx((1.0, 2.95 + 0.05, 4.5), abs=0.051)
    assert local.length == pytest.approx(local.path[-1, 0] - local.path[0, 0])
    assert local.length <= 2.0


def test_a_segment_remains_and_passed_poses_are_forgotten():
    made = handler(straight(1.0))
    assert made.local_plan(Pose(1.2, 0.0), free_map()).path[:, 0] == pytest.approx([0.95, 1.0])
    assert made.local_plan(Pose(0.0, 0.0), free_map()).path[:, 0] == pytest.approx([0.95, 1.0])


def test_a_plan_of_one_pose_can_be_refused():
    assert len(handler(straight(0.0)).local_plan(Pose(0.0, 0.0), free_map()).path) == 1
    with pytest.raises(InvalidPath, match="length of one"):
        handler(straight(0.0), reject_unit_path=True).local_plan(Pose(0.0, 0.0), free_map())
    with pytest.raises(InvalidPath, match="zero length"):
        handler(np.empty((0, 3))).local_plan(Pose(0.0, 0.0), free_map())


def test_an_enforced_cusp_ends_the_plan_until_the_robot_is_there():
    path = np.vstack([straight(1.0), straight(1.0)[::-1][1:]])
    made = handler(path, enforce_path_inversion=True)
    assert made.local_plan(Pose(0.0, 0.0), free_map()).path[-1, 0] == pytest.approx(1.0)
    made.local_plan(Pose(0.9, 0.0), free_map())
    assert made.local_plan(Pose(0.9, 0.0), free_map()).path[-1, 0] == pytest.approx(0.0)


def test_an_enforced_turn_on_the_spot_ends_the_plan():
    turn = np.column_stack([np.full(4, 0.5), np.zeros(4), [0.4, 0.8, 1.2, 1.57]])
    path = np.vstack([straight(0.5), turn])
    made = handler(path, enforce_path_rotation=True)
    assert made.local_plan(Pose(0.0, 0.0), free_map()).path[-1, 2] == pytest.approx(0.4)


def test_a_stretch_of_one_pose_can_be_refused_as_well():
    # The robot turns on the spot at the first pose: the path up to the turn is that pose alone.
    path = np.vstack([[0.0, 0.0, -1.57], straight(1.0)])
    made = handler(path, enforce_path_rotation=True)
    assert len(made.local_plan(Pose(0.0, 0.3), free_map()).path) == 1
    with pytest.raises(InvalidPath, match="length of one"):
        handler(path, enforce_path_rotation=True, reject_unit_path=True).local_plan(Pose(0.0, 0.3), free_map())


@pytest.mark.parametrize("plugin", ["simple", "stopped", "position", "axis", "adaptive"])
def test_the_goal_is_not_reached_while_much_of_the_plan_is_left(plugin):
    checker = make_goal_checker(GoalChecker(plugin=plugin))
    near, far = at_end(), at_end()._replace(length=1.01)
    assert not checker.is_goal_reached(Pose(0.5, 0.0), near.goal, REST, far)
    assert checker.is_goal_reached(Pose(0.5, 0.0), near.goal, REST, near)


def test_a_reached_position_is_left_beyond_the_buffer():
    local = at_end()
    for buffer, expected in ((0.0, True), (0.1, False)):
        checker = make_goal_checker(GoalChecker(xy_goal_tolerance_buffer=buffer))
        assert checker.is_position_reached(Pose(0.3, 0.0), local)
        assert checker.is_position_reached(Pose(0.1, 0.0), local) is expected


@pytest.mark.parametrize(("x", "y", "overshoots", "expected"), [
    (0.4, 0.2, False, True),
    (0.4, 0.3, False, False),
    (0.2, 0.0, False, False),
    (0.9, 0.0, False, False),
    (0.9, 0.0, True, True),
])  # fmt: skip
def test_tolerances_along_and_across_the_path(x, y, overshoots, expected):
    checker = make_goal_checker(GoalChecker(plugin="axis", is_overshoot_valid=overshoots))
    assert checker.is_position_reached(Pose(x, y, 2.0), at_end()) is expected


def test_the_direction_is_that_to_the_goal_from_the_pose_before_the_last():
    # The local plan is cut 0.3 m before the goal. From (0, 0.3) the goal lies at -45 degrees, 0.21 m along and across.
    local = LocalPlan(np.array([[0.0, 0.3, 0.0], [0.0, 0.0, 0.0]]), 0.3, Pose(0.3, 0.0))
    checker = make_goal_checker(GoalChecker(plugin="axis", along_path_tolerance=0.19, cross_track_tolerance=0.23))
    assert not checker.is_position_reached(Pose(0.0, 0.0), local)  # straight on it would be 0.3 m
    wider = make_goal_checker(GoalChecker(plugin="axis", along_path_tolerance=0.23, cross_track_tolerance=0.23))
    assert wider.is_position_reached(Pose(0.0, 0.0), local)


def test_the_coarse_tolerance_counts_where_the_robot_comes_no_nearer():
    checker = make_goal_checker(GoalChecker(plugin="adaptive", required_stagnation_cycles=3))
    local, moving = at_end(), Twist(0.3, 0.0)
    reached = [checker.is_goal_reached(Pose(0.3, 0.0), local.goal, moving, local) for _ in range(4)]
    assert reached == [False, False, False, True]
    checker.reset()
    assert not checker.is_goal_reached(Pose(0.3, 0.05), local.goal, moving, local)
    assert checker.is_goal_reached(Pose(0.65, 0.05), local.goal, moving, local)  # past the goal


def adaptive(**options):
    return make_goal_checker(GoalChecker(plugin="adaptive", **options))


def test_a_robot_that_stands_in_the_coarse_tolerance_is_counted_from_the_second_call_on():
    checker, local = adaptive(required_stagnation_cycles=3), at_end()
    nearer = [Pose(0.3 + 0.01 * n, 0.0) for n in range(4)]
    assert [checker.is_goal_reached(pose, local.goal, REST, local) for pose in nearer] == [False, False, False, True]


def test_the_calls_of_a_controller_count_as_well():
    checker, local, moving = adaptive(required_stagnation_cycles=3), at_end(), Twist(0.3, 0.0)
    assert not checker.is_goal_reached(Pose(0.3, 0.0), local.goal, moving, local)
    assert not checker.is_position_reached(Pose(0.3, 0.0), local)
    assert not checker.is_goal_reached(Pose(0.3, 0.0), local.goal, moving, local)
    assert checker.is_position_reached(Pose(0.3, 0.0), local)


def test_level_with_the_goal_counts_as_past_it():
    checker, local, moving = adaptive(), at_end(), Twist(0.3, 0.0)
    assert not checker.is_goal_reached(Pose(0.3, 0.0), local.goal, moving, local)
    assert checker.is_goal_reached(Pose(0.5, 0.2), local.goal, moving, local)


def test_a_fine_tolerance_above_the_coarse_one_counts():
    local = at_end()
    assert adaptive(fine_xy_goal_tolerance=0.3).is_goal_reached(Pose(0.22, 0.0), local.goal, REST, local)


def window(**options):
    limits = {
        "control_period": 0.05, "desired_linear_vel": 0.5, "min_linear_vel": -0.5, "max_angular_vel": 2.5,
        "min_angular_vel": -2.5, "max_linear_accel": 2.5, "max_linear_decel": -2.5, "max_angular_accel": 3.2,
        "max_angular_decel": -3.2,
    }  # fmt: skip
    values = limits | options
    return np.array([tuple(values.values())], dtype=[(name, np.float64) for name in values])[0]


@pytest.mark.parametrize(("speed", "curvature", "last", "expected"), [
    (0.5, 0.0, (0.0, 0.0), (0.125, 0.0)),  # one period's acceleration, straight on
    (0.5, 0.0, (0.5, 0.5), (0.5, 0.34)),  # the turn ends as fast as it may
    (0.5, 1.0, (0.3, 0.3), (0.425, 0.425)),  # the line leaves the window at its highest speed
    (0.5, 2.0, (0.3, 0.3), (0.23, 0.46)),  # the line leaves it at its highest turn rate
    (0.1, 0.0, (0.5, 0.0), (0.375, 0.0)),  # regulated, but no braking beyond the limit
])  # fmt: skip
def test_commands_of_the_dynamic_window(speed, curvature, last, expected):
    assert window_command(speed, curvature, *last, window()) == pytest.approx(expected)


class Robot:
    pose = Pose(0.0, 0.0)


def test_a_path_is_kept_near_the_goal_while_it_is_free():
    costmap = free_map()

    class Server:
        pass

    Server.costmap = costmap
    keeper = PathKeeper(4.0, Robot(), PathValidity(Robot(), Server(), Footprint.from_radius(0.2, 0.0)))
    assert not keeper.keeps(())
    assert not keeper.keeps(straight(4.1))
    path = straight(3.9)
    assert keeper.keeps(path)
    costmap.costs[100, 140] = 253  # at x = 2.0 m
    assert not keeper.keeps(path)
    costmap.costs[100, 140] = 255
    assert keeper.keeps(path)


def test_without_wrapping_the_last_recovery_ends_the_round():
    succeeds, fails = Condition(lambda: True), Condition(lambda: False)
    ends = RoundRobin(succeeds, succeeds, wrap_around=False)
    assert [ends.execute_tick() for _ in range(3)] == [Status.SUCCESS, Status.FAILURE, Status.SUCCESS]
    assert RoundRobin(fails, succeeds, wrap_around=False).execute_tick() is Status.FAILURE
    assert RoundRobin(fails, succeeds).execute_tick() is Status.SUCCESS


def test_a_fallback_takes_the_first_that_succeeds():
    asked = []
    first = Condition(lambda: asked.append(1) or False)
    assert Fallback(first, Condition(lambda: True)).execute_tick() is Status.SUCCESS
    assert Fallback(first, first).execute_tick() is Status.FAILURE
    assert len(asked) == 3
