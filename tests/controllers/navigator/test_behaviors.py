from __future__ import annotations

import math

import numpy as np
import pytest

from controllers.base import Twist
from controllers.nav2_params.navigation import BehaviorServer as BehaviorServerParams
from controllers.nav2_params.navigation import VelocitySmoother as VelocitySmootherParams
from controllers.navigator.behavior_tree import Status
from controllers.navigator.behaviors import BackUp, Behavior, BehaviorServer, Spin, Wait
from controllers.navigator.velocity_smoother import VelocitySmoother
from gym_mapbench.costmap import LETHAL_OBSTACLE, NO_INFORMATION, Costmap
from gym_mapbench.world.footprint import Footprint
from gym_mapbench.world.scenario import Pose, wrap_angle

PARAMS = BehaviorServerParams()
PERIOD = 0.05


def free_costmap() -> Costmap:
    return Costmap(np.zeros((100, 100), dtype=np.uint8), 0.05, -2.5, -2.5)


class Run:
    """Drives a perfect robot with one behaviour, one control period at a time."""

    def __init__(self, behavior: Behavior, pose: Pose, costmap: Costmap) -> None:
        self.server = BehaviorServer(PARAMS, Footprint.from_radius(0.22))
        self.server.run(behavior, pose, 0.0)
        self.pose, self.costmap = pose, costmap
        self.commands: list[Twist] = []
        self.status = Status.RUNNING

    def until_done(self, obey: float = 1.0) -> Run:
        """Drive on; the robot turns and drives at ``obey`` times the command."""
        for step in range(1000):
            self.status = self.server.step(self.pose, self.costmap, step * PERIOD)
            if self.status is not Status.RUNNING:
                self.time = step * PERIOD
                return self
            self.commands.append(self.server.command)
            v, w = (obey * value for value in self.server.command)
            x, y, yaw = self.pose
            self.pose = Pose(
                x + v * math.cos(yaw) * PERIOD, y + v * math.sin(yaw) * PERIOD, wrap_angle(yaw + w * PERIOD)
            )
        raise AssertionError("the behaviour does not end")


@pytest.mark.parametrize(("remaining", "rate"), [(1.57, 1.0), (0.1, 0.8), (0.05, 0.566), (0.025, 0.4), (0.02, 0.4)])
def test_t4_turn_rate_of_a_spin(remaining, rate):
    assert Spin(1.57, PARAMS).turn_rate(remaining) == pytest.approx(rate, abs=5e-4)


@pytest.mark.parametrize("yaw", [0.0, 2.5, -2.5])
@pytest.mark.parametrize("target", [1.57, -1.57])
def test_spin_turns_by_its_target(yaw, target):
    run = Run(Spin(target, PARAMS), Pose(0.0, 0.0, yaw), free_costmap()).until_done()
    assert run.status is Status.SUCCESS
    assert wrap_angle(run.pose.yaw - yaw) == pytest.approx(target, abs=0.05)
    assert run.server.command == (0.0, 0.0)


def test_commands_are_held_for_two_control_periods():
    run = Run(Spin(1.57, PARAMS), Pose(0.0, 0.0, 0.0), free_costmap()).until_done()
    assert run.commands[0:-1:2] == run.commands[1::2]


def test_spin_times_out():
    run = Run(Spin(1.57, PARAMS), Pose(0.0, 0.0, 0.0), free_costmap()).until_done(obey=0.0)
    assert run.status is Status.FAILURE
    assert run.time == pytest.approx(10.1)


def test_spin_checks_nothing_before_it_has_turned():
    costmap = free_costmap()
    costmap.costs[:] = LETHAL_OBSTACLE
    run = Run(Spin(1.57, PARAMS), Pose(0.0, 0.0, 0.0), costmap).until_done()
    assert run.status is Status.FAILURE
    assert run.time == pytest.approx(0.1)
    assert run.commands == [(0.0, 1.0), (0.0, 1.0)]


def test_t4_back_up_takes_six_seconds():
    run = Run(BackUp(0.30, 0.05, PARAMS), Pose(0.0, 0.0, 1.0), free_costmap()).until_done()
    assert run.status is Status.SUCCESS
    assert run.time == pytest.approx(6.0, abs=0.11)
    assert (run.pose.x, run.pose.y) == pytest.approx((-0.3 * math.cos(1.0), -0.3 * math.sin(1.0)), abs=0.006)
    assert set(run.commands) == {(-0.05, 0.0)}


def test_t4_slow_back_up_times_out_after_a_quarter_metre():
    run = Run(BackUp(0.30, 0.025, PARAMS), Pose(0.0, 0.0, 0.0), free_costmap()).until_done()
    assert run.status is Status.FAILURE
    assert run.pose.x == pytest.approx(-0.25, abs=0.006)


@pytest.mark.parametrize(("cost", "fails"), [(LETHAL_OBSTACLE, True), (NO_INFORMATION, True), (253, False)])
def test_back_up_looks_ahead(cost, fails):
    costmap = free_costmap()
    costmap.costs[:, :44] = cost  # x < -0.3 m; the robot's back reaches there after about 0.07 m
    run = Run(BackUp(0.30, 0.05, PARAMS), Pose(0.0, 0.0, 0.0), costmap).until_done()
    assert (run.status is Status.FAILURE) is fails
    if fails:
        assert run.commands == []


def test_back_up_looks_no_farther_than_its_distance():
    costmap = free_costmap()
    costmap.costs[:, :38] = LETHAL_OBSTACLE  # x < -0.6 m, beyond 0.3 m + 0.23 m
    assert Run(BackUp(0.30, 0.05, PARAMS), Pose(0.0, 0.0, 0.0), costmap).until_done().status is Status.SUCCESS


def test_off_the_map_is_a_collision():
    run = Run(BackUp(0.30, 0.05, PARAMS), Pose(-2.25, 0.0, 0.0), free_costmap()).until_done()
    assert run.status is Status.FAILURE


def test_wait_stands_still_for_its_time():
    run = Run(Wait(5.0), Pose(0.0, 0.0, 0.0), free_costmap()).until_done()
    assert (run.status, run.time) == (Status.SUCCESS, pytest.approx(5.0))
    assert set(run.commands) == {(0.0, 0.0)}


class TestVelocitySmoother:
    EXAMPLE = VelocitySmootherParams(
        max_velocity=(0.26, 0.0, 1.0),
        min_velocity=(-0.26, 0.0, -1.0),
        max_accel=(2.5, 0.0, 3.2),
        max_decel=(-2.5, 0.0, -3.2),
    )

    def smooth(self, commands, **changes):
        smoother = VelocitySmoother(self.EXAMPLE.replace(**changes), PERIOD)
        return [smoother.smooth(Twist(*command), Twist(0.0, 0.0)) for command in commands]

    def test_t3_speeds_up_in_steps(self):
        speeds = [twist.v for twist in self.smooth([(0.26, 0.0)] * 3)]
        assert speeds == pytest.approx([0.125, 0.25, 0.26])

    def test_velocity_is_clamped(self):
        assert self.smooth([(0.5, -2.0)] * 20)[-1] == pytest.approx((0.26, -1.0))

    def test_braking_has_its_own_limit_through_zero(self):
        twists = self.smooth([(0.26, 0.0)] * 3 + [(-0.26, 0.0)] * 3, max_decel=(-1.0, 0.0, -3.2))
        assert [t.v for t in twists[3:]] == pytest.approx([0.21, 0.16, 0.11])

    def test_scaled_velocities_keep_their_ratio(self):
        (first,) = self.smooth([(0.25, 1.0)], scale_velocities=True)
        assert first == pytest.approx((0.04, 0.16))

    def test_deadband_hides_but_does_not_forget(self):
        twists = self.smooth([(0.26, 0.0)] * 2, deadband_velocity=(0.2, 0.0, 0.0))
        assert [t.v for t in twists] == pytest.approx([0.0, 0.25])

    def test_closed_loop_starts_from_the_mean_odometry(self):
        smoother = VelocitySmoother(self.EXAMPLE.replace(feedback="CLOSED_LOOP"), PERIOD)
        commands = [smoother.smooth(Twist(0.26, 0.0), Twist(v, 0.0)).v for v in (0.0, 0.03, 0.06, 0.09)]
        assert commands == pytest.approx([0.125, 0.14, 0.155, 0.185])
