"""Lyrical's Graceful Controller: worked examples of what no recording covers, and a plain twin."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from controllers.base import ControllerError, InvalidPath
from controllers.graceful.controller import REASONS
from controllers.graceful.kernels.following import COLLISION
from controllers.graceful.lyrical import LyricalGracefulFollower
from controllers.graceful.params import GracefulParams
from gym_mapbench.costmap import Costmap
from gym_mapbench.world.footprint import Footprint
from gym_mapbench.world.scenario import Pose
from tests.controllers.plain_follower import local_plan
from tests.controllers.plain_graceful_lyrical import PlainLyricalGraceful
from tests.controllers.test_graceful import BOX, command_of, every_release, paths
from tests.controllers.test_rpp import DISC, ORIGIN, angles, blocked_at, costmaps, flags, free_map, make_setup, straight
from tests.controllers.test_rpp_lyrical import setup_with

BLOCKED = re.escape(REASONS["lyrical"][COLLISION])


def follower(path, footprint=DISC, arrived=False, **params):
    made = LyricalGracefulFollower(GracefulParams(release="lyrical", **params))
    made.reset(setup_with(arrived, footprint))
    made.set_plan(np.asarray(path, dtype=float))
    made.take_local_plan(local_plan(path))
    return made


def to_goal(x, y, heading):
    """A path of three poses to a goal within the lookahead, with headings of its own."""
    return [(0.0, 0.0, 0.3), (x / 2, y / 2, -0.3), (x / 2 + 0.01, y / 2, 0.3), (x, y, heading)]


# --- The heading at the goal -----------------------------------------------------------------------------------------


def test_a_cheap_way_straight_to_the_goal_is_taken():
    # Whatever the goal's heading is: the bearing counts, and the robot turns at the goal.
    made = follower(to_goal(0.8, 0.0, 1.2))
    assert command_of(made).w == pytest.approx(0.0, abs=1e-6)
    own = follower(to_goal(0.8, 0.0, 1.2), prefer_final_rotation=False)
    assert abs(command_of(own).w) > 0.1
    assert math.isnan(made._safe_heading)


def test_an_expensive_way_to_the_goal_makes_it_search_other_headings():
    # Cost 251 is 252 less the margin of 1: free, but no longer cheap. A way round it costs nothing.
    path, dear = to_goal(0.8, 0.0, 0.0), free_map()
    dear.costs[100, 106:110] = 251
    found = follower(path)
    command = command_of(found, Pose(0.0, 0.025, 0.0), dear)
    assert command.v > 0.0
    twin = PlainLyricalGraceful(found.params, make_setup(), path)
    assert twin(Pose(0.0, 0.025, 0.0), False, dear) == pytest.approx(command, abs=1e-6)
    # Headings are searched only from the margin on: one step less, and the straight way is cheap enough.
    dear.costs[100, 106:110] = 250
    straight_on = command_of(follower(path), Pose(0.0, 0.025, 0.0), dear)
    dear.costs[100, 106:110] = 251
    assert command_of(follower(path, obstacle_cost_margin=0), Pose(0.0, 0.025, 0.0), dear) == straight_on


def test_the_search_takes_the_fewest_steps_below_the_highest_valid_cost():
    # All is at 251, below the highest valid cost: every heading is free, and straight on is the fastest of them.
    made = follower(to_goal(0.8, 0.0, 1.2))
    costmap = free_map()
    costmap.costs[:] = 251
    assert command_of(made, costmap=costmap).w == pytest.approx(0.0, abs=1e-6)
    assert made._safe_heading == 0.0


def test_without_a_safe_heading_the_way_straight_to_the_goal_is_kept():
    # At 252 nothing is below the highest valid cost.
    path, costmap = to_goal(0.7, 0.2, 1.2), free_map()
    straight_on = command_of(follower(path), costmap=costmap)
    costmap.costs[:] = 252
    made = follower(path)
    assert command_of(made, costmap=costmap) == straight_on
    assert math.isnan(made._safe_heading)
    own = follower(path, prefer_final_rotation=False)
    assert command_of(own, costmap=costmap) != pytest.approx(straight_on, abs=0.01)


def test_the_last_safe_heading_is_kept_while_it_is_safe():
    # Straight on takes the fewest steps of all, but the search ends at a heading found before.
    costmap, path = free_map(), to_goal(0.8, 0.0, 0.0)
    costmap.costs[:] = 251
    made = follower(path, slowdown_radius=0.2)
    made._safe_heading = 0.8
    assert abs(command_of(made, costmap=costmap).w) > 0.1
    assert made._safe_heading == 0.8
    made.set_plan(np.array(path))
    assert command_of(made, costmap=costmap).w == pytest.approx(0.0, abs=1e-6)
    assert made._safe_heading == 0.0


def test_a_short_way_that_is_not_safe_rules_out_longer_ones():
    # The headings around the bearing lead over 252, the others round it: they are safe, but take more steps.
    costmap = free_map()
    costmap.costs[100, 106:110] = 252
    made = follower(to_goal(0.8, 0.0, 0.0), final_rotation_search_step=1.0)
    pose = Pose(0.0, 0.025, 0.0)
    straight_on = command_of(follower(to_goal(0.8, 0.0, 0.0)), pose, free_map())
    assert command_of(made, pose, costmap) == straight_on
    made._safe_heading = 1.0  # now the headings that are tried begin with a safe one
    assert abs(command_of(made, pose, costmap).w) > 0.1


def test_the_cost_of_a_way_is_that_at_the_centre():
    # Cells beside the way touch the outline: it is free, and cheap, as the robot's centre does not pass there.
    path, beside = to_goal(0.8, 0.0, 0.0), free_map()
    beside.costs[102] = 253
    made = follower(path, BOX)
    assert command_of(made, Pose(0.0, 0.025, 0.0), beside) == command_of(made, Pose(0.0, 0.025, 0.0), free_map())
    assert math.isnan(made._safe_heading)


def test_a_blocked_way_straight_on_leaves_the_targets_own_heading():
    # The bearing's way runs into the wall; the target's own heading bends round it.
    wall = free_map()
    wall.costs[102, 112:114] = 254
    path = to_goal(0.9, 0.15, 0.6)
    pose = Pose(0.0, 0.025, 0.0)
    made = follower(path, initial_rotation=False)
    twin = PlainLyricalGraceful(made.params, make_setup(), path)
    expected = twin(pose, False, wall)
    assert expected != "collision"
    assert command_of(made, pose, wall) == pytest.approx(expected, abs=1e-6)
    assert expected != pytest.approx(command_of(follower(path, initial_rotation=False), pose, free_map()), abs=1e-3)


def test_with_an_outline_the_centre_may_cost_one_more():
    costmap = free_map()
    costmap.costs[:] = 252
    for footprint, finds in ((DISC, False), (BOX, True)):
        made = follower(to_goal(0.8, 0.0, 1.2), footprint)
        command_of(made, costmap=costmap)
        assert math.isnan(made._safe_heading) != finds


def test_far_from_the_goal_nothing_is_searched():
    costmap = free_map()
    costmap.costs[:] = 251
    made = follower(straight(2.0))
    assert command_of(made, costmap=costmap).v > 0.0
    assert math.isnan(made._safe_heading)


# --- Targets and speeds ----------------------------------------------------------------------------------------------


def test_the_first_target_lies_at_the_lookahead_distance():
    # 1 m along the path the segment leads north: the target is (0.6, 0.4) with heading pi / 2.
    path = [(0.0, 0.0, 0.3), (0.3, 0.0, -0.3), (0.6, 0.0, 0.3), (0.6, 2.0, 0.0)]
    made = follower(path, initial_rotation=False)
    twin = PlainLyricalGraceful(made.params, make_setup(), path)
    assert twin.looked_at(path) == pytest.approx((0.6, 0.4, math.pi / 2))
    assert command_of(made) == pytest.approx(twin(ORIGIN, False, free_map()), abs=1e-6)


def test_a_target_may_be_nearer_than_the_least_lookahead():
    assert command_of(follower(straight()), costmap=blocked_at(0.3)).v > 0.0
    with pytest.raises(ControllerError, match=BLOCKED):
        command_of(follower(straight(), BOX), costmap=blocked_at(0.1))
    assert command_of(follower(straight(), BOX, use_collision_detection=False), costmap=blocked_at(0.1)).v > 0.0


def test_the_robot_can_stop_at_its_target():
    # sqrt(2 * 1 m * 0.02 m/s^2) = 0.2 m/s; with 2.5 m/s^2 the slowdown radius alone counts.
    assert command_of(follower(straight(), deceleration_max=0.02)).v == pytest.approx(0.2, abs=1e-6)
    assert command_of(follower(straight())).v == pytest.approx(0.5 / 1.5, abs=1e-6)


def test_the_outline_grows_with_the_speed_of_the_command():
    # The command is 0.5 * 0.79 / 1.5 = 0.26 m/s: the box is 5 % larger, not the 25 % of the top speed.
    scaling = {"footprint_scaling_linear_vel": 0.2, "footprint_scaling_step": 0.2, "max_lookahead": 0.79}
    path, wall = straight(), blocked_at(1.10)
    assert command_of(follower(path, BOX, **scaling), costmap=wall) == command_of(follower(path, BOX, **scaling))


def test_a_lower_top_speed_simulates_a_shorter_way_in_steps_of_the_same_time():
    # Of 60 steps towards 1 m, each leads 1/30 of what is left at 0.5 m/s, to 0.87 m, and 1/75 at 0.2 m/s, to 0.55 m.
    slower = {"footprint_scaling_linear_vel": 0.2, "footprint_scaling_step": 0.3, "footprint_scaling_factor": 0.0}
    assert command_of(follower(straight(), BOX, **slower), costmap=blocked_at(1.0)).v == pytest.approx(0.2 / 1.5)


def test_the_top_speed_falls_until_the_outline_fits():
    # The way ends 0.745 m ahead. At 0.5 m/s the box is 25 % larger, its front at 1.12 m; at 0.3 m/s it is at 1.07 m.
    scaling = {"footprint_scaling_linear_vel": 0.2, "footprint_scaling_step": 0.2, "max_lookahead": 0.79}
    wall = blocked_at(1.10)
    assert command_of(follower(straight(), BOX, slowdown_radius=0.1, **scaling)).v == pytest.approx(0.5)
    assert command_of(follower(straight(), BOX, slowdown_radius=0.1, **scaling), costmap=wall).v == pytest.approx(0.3)
    # As in Nav2 an outline of three corners does not grow: its front stays at 1.045 m.
    triangle = Footprint.from_corners(BOX.corners[:3])
    grows = follower(straight(), triangle, slowdown_radius=0.1, **scaling)
    assert command_of(grows, costmap=wall).v == pytest.approx(0.5)


def test_the_turn_at_the_goal_is_made_when_the_goal_checker_says_so_and_the_outline_is_free():
    path = to_goal(0.2, 0.0, -1.0)
    assert command_of(follower(path, arrived=True)) == pytest.approx((0.0, -0.5))
    assert command_of(follower(path)).v > 0.0
    beside = free_map()
    beside.costs[95, 103] = 254  # under the box's front once it has turned to the right
    assert command_of(follower(path, BOX, arrived=True)).v == 0.0
    assert command_of(follower(path, BOX, arrived=True), costmap=beside).v > 0.0
    unchecked = follower(path, BOX, arrived=True, use_collision_detection=False)
    assert command_of(unchecked, costmap=beside) == pytest.approx((0.0, -0.5))


def test_without_a_local_plan_there_is_no_command():
    made = LyricalGracefulFollower(GracefulParams(release="lyrical"))
    made.reset(make_setup())
    with pytest.raises(InvalidPath, match="0 poses"):
        command_of(made)


# --- For any input ---------------------------------------------------------------------------------------------------

options = st.fixed_dictionaries(
    {
        **every_release,
        "prefer_final_rotation": flags,
        "max_lookahead": st.sampled_from([0.5, 1.0, 3.0]),
        "deceleration_max": st.sampled_from([0.05, 2.5]),
        "use_collision_detection": flags,
        "footprint_scaling_linear_vel": st.sampled_from([0.2, 0.5]),
        "footprint_scaling_factor": st.sampled_from([0.0, 0.25]),
        "footprint_scaling_step": st.sampled_from([0.125, 1.0]),
        "obstacle_cost_margin": st.sampled_from([0, 1, 60]),
        "final_rotation_search_step": st.sampled_from([0.3, 0.7]),
    }
)


@settings(max_examples=120, deadline=None)
@given(paths(), costmaps(), options, st.sampled_from([DISC, BOX]), flags, angles)
def test_kernels_do_what_the_plain_twin_does(path, costmap, params, footprint, arrived, yaw):
    path = path[:25]
    assume(abs(math.sin(path[-1, 2] - yaw)) > 1e-6)  # else rounding decides whether the turn at the goal is a left one
    made = follower(path, footprint, arrived, **params)
    twin = PlainLyricalGraceful(made.params, make_setup(footprint), path)
    costs = np.where(costmap.costs == 253, 0, costmap.costs)
    costmap = Costmap(costs, costmap.resolution, costmap.origin_x, costmap.origin_y, costmap.track_unknown_space)
    pose = Pose(0.0, 0.0, yaw)
    for _ in range(2):
        expected = twin(pose, arrived, costmap)
        if expected == "collision":
            with pytest.raises(ControllerError, match=BLOCKED):
                command_of(made, pose, costmap)
        else:
            assert command_of(made, pose, costmap) == pytest.approx(expected, abs=1e-5)
        assert made._safe_heading == pytest.approx(math.nan if twin.safe is None else twin.safe, nan_ok=True)
        pose = Pose(pose.x + 0.3, pose.y + 0.1, yaw)
