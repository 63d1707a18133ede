from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from controllers.base import STOP, Twist
from controllers.behaviors import BehaviorServer as BehaviorServerParams
from controllers.behaviors import DriveLimits
from controllers.nav2_params.navigation import VelocitySmoother as VelocitySmootherParams
from controllers.navigator.actions import ActionServer
from controllers.navigator.behavior_server import BehaviorServer
from controllers.navigator.behaviors import BackUp, Behavior, DriveOnHeading, Spin, Wait
from controllers.navigator.kernels import smooth
from controllers.navigator.latency import LATENCIES
from controllers.navigator.velocity_smoother import OdomSmoother, VelocitySmoother, limits_of
from gym_mapbench.costmap import LETHAL_OBSTACLE, NO_INFORMATION, Costmap
from gym_mapbench.world.footprint import Footprint
from gym_mapbench.world.scenario import Pose, wrap_angle

PARAMS = BehaviorServerParams()
PERIOD = 0.05


def free_costmap() -> Costmap:
    return Costmap(np.zeros((100, 100), dtype=np.uint8), 0.05, -2.5, -2.5)


class Run:
    """Drives a perfect robot with one behaviour, one control period at a time."""

    map_in_local = Pose(0.0, 0.0)
    odometry = STOP

    def __init__(self, behavior: Behavior, pose: Pose, costmap: Costmap, params: BehaviorServerParams = PARAMS) -> None:
        self.commands: list[Twist] = []
        self.command, self.local_pose, self.time = STOP, pose, 0.0
        server = BehaviorServer(params, Footprint.from_radius(0.22), self, lambda: costmap, self.publish)
        self.server = ActionServer(server, LATENCIES["ideal"])
        self.handle = self.server.send(behavior, 0.0)

    def publish(self, command: Twist) -> None:
        self.command = command
        self.commands.append(command)

    @property
    def result(self) -> str:
        return self.handle.outcome.result

    def until_done(self, obey: float = 1.0) -> Run:
        """Drive on; the robot turns and drives at ``obey`` times the command."""
        for step in range(1000):
            self.time = step * PERIOD
            self.server.advance(self.time)
            if self.handle.outcome is not None:
                return self
            v, w = (obey * value for value in self.command)
            x, y, yaw = self.local_pose
            self.local_pose = Pose(
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
    assert run.result == "succeeded"
    assert wrap_angle(run.local_pose.yaw - yaw) == pytest.approx(target, abs=0.05)
    assert run.command == STOP


def test_there_is_a_command_in_every_second_control_period():
    run = Run(Spin(1.57, PARAMS), Pose(0.0, 0.0, 0.0), free_costmap()).until_done()
    assert len(run.commands) == round(run.time / (2 * PERIOD)) + 1


def test_spin_times_out():
    run = Run(Spin(1.57, PARAMS), Pose(0.0, 0.0, 0.0), free_costmap()).until_done(obey=0.0)
    assert run.result == "aborted"
    assert run.time == pytest.approx(10.1)


def test_spin_checks_nothing_before_it_has_turned():
    costmap = free_costmap()
    costmap.costs[:] = LETHAL_OBSTACLE
    run = Run(Spin(1.57, PARAMS), Pose(0.0, 0.0, 0.0), costmap).until_done()
    assert run.result == "aborted"
    assert run.time == pytest.approx(0.1)
    assert run.commands == [(0.0, 1.0), STOP]


def test_t4_back_up_takes_six_seconds():
    run = Run(BackUp(0.30, 0.05, PARAMS), Pose(0.0, 0.0, 1.0), free_costmap()).until_done()
    assert run.result == "succeeded"
    assert run.time == pytest.approx(6.0, abs=0.11)
    assert (run.local_pose.x, run.local_pose.y) == pytest.approx(
        (-0.3 * math.cos(1.0), -0.3 * math.sin(1.0)), abs=0.006
    )
    assert set(run.commands) == {(float(np.float32(-0.05)), 0.0), STOP}


def test_t4_slow_back_up_times_out_after_a_quarter_metre():
    run = Run(BackUp(0.30, 0.025, PARAMS), Pose(0.0, 0.0, 0.0), free_costmap()).until_done()
    assert run.result == "aborted"
    assert run.local_pose.x == pytest.approx(-0.25, abs=0.006)


@pytest.mark.parametrize(("cost", "fails"), [(LETHAL_OBSTACLE, True), (NO_INFORMATION, True), (253, False)])
def test_back_up_looks_ahead(cost, fails):
    costmap = free_costmap()
    costmap.costs[:, :44] = cost  # x < -0.3 m; the robot's back reaches there after about 0.07 m
    run = Run(BackUp(0.30, 0.05, PARAMS), Pose(0.0, 0.0, 0.0), costmap).until_done()
    assert (run.result == "aborted") is fails
    if fails:
        assert run.commands == [STOP]


def test_back_up_looks_no_farther_than_its_distance():
    costmap = free_costmap()
    costmap.costs[:, :38] = LETHAL_OBSTACLE  # x < -0.6 m, beyond 0.3 m + 0.23 m
    assert Run(BackUp(0.30, 0.05, PARAMS), Pose(0.0, 0.0, 0.0), costmap).until_done().result == "succeeded"


def test_off_the_map_is_a_collision():
    run = Run(BackUp(0.30, 0.05, PARAMS), Pose(-2.25, 0.0, 0.0), free_costmap()).until_done()
    assert run.result == "aborted"


def test_without_a_published_costmap_only_waiting_succeeds():
    assert Run(BackUp(0.30, 0.05, PARAMS), Pose(0.0, 0.0), None).until_done().result == "aborted"
    assert Run(Wait(0.5), Pose(0.0, 0.0), None).until_done().result == "succeeded"


def test_wait_stands_still_for_its_time():
    run = Run(Wait(5.0), Pose(0.0, 0.0, 0.0), free_costmap()).until_done()
    assert (run.result, run.time) == ("succeeded", pytest.approx(5.0))
    assert run.commands == []


def test_an_allowance_of_zero_is_no_limit():
    assert Run(BackUp(0.30, 0.025, PARAMS, 0.0), Pose(0.0, 0.0), free_costmap()).until_done().result == "succeeded"


def test_humbles_back_up_can_have_limits():
    limits = DriveLimits(acceleration_limit=0.2, deceleration_limit=-0.1, minimum_speed=0.05)
    params = PARAMS.replace(backup=limits)
    run = Run(BackUp(0.4, 0.2, params), Pose(0.0, 0.0), free_costmap(), params).until_done()
    speeds = [-command.v for command in run.commands]
    assert speeds[:3] == pytest.approx([0.05, 0.07, 0.09])
    assert max(speeds) == pytest.approx(0.2)
    assert speeds[-2:] == pytest.approx([0.05, 0.0])


def test_driving_on_a_heading_refuses_a_speed_against_its_distance():
    run = Run(DriveOnHeading(0.3, -0.1, PARAMS), Pose(0.0, 0.0), free_costmap()).until_done()
    assert (run.result, run.commands) == ("aborted", [])


class TestVelocitySmoother:
    EXAMPLE = VelocitySmootherParams(
        max_velocity=(0.26, 0.0, 1.0),
        min_velocity=(-0.26, 0.0, -1.0),
        max_accel=(2.5, 0.0, 3.2),
        max_decel=(-2.5, 0.0, -3.2),
    )

    def smooth(self, commands, **changes):
        smoother = VelocitySmoother(self.EXAMPLE.replace(**changes))
        return [self.step(smoother, command, step) for step, command in enumerate(commands)]

    @staticmethod
    def step(smoother, command, step):
        if command is not None:
            smoother.take(Twist(*command), step * PERIOD)
        return smoother.advance(step * PERIOD)

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
        smoother = VelocitySmoother(self.EXAMPLE.replace(feedback="CLOSED_LOOP"))
        commands = []
        for step, v in enumerate((0.0, 0.03, 0.06, 0.09)):
            smoother.measure(Twist(v, 0.0), step * PERIOD)
            commands.append(self.step(smoother, (0.26, 0.0), step).v)
        assert commands == pytest.approx([0.125, 0.14, 0.155, 0.185])

    @pytest.mark.parametrize(("odometry_period", "messages"), [(0.05, 3), (0.01, 11)])
    def test_the_mean_counts_odometry_by_its_age(self, odometry_period, messages):
        mean = OdomSmoother(0.1)
        for number in range(40):
            mean.take(Twist(float(number), 0.0), number * odometry_period)
        assert mean.mean.v == pytest.approx(39 - (messages - 1) / 2)

    def test_nothing_is_published_before_the_first_command(self):
        assert self.smooth([None] * 3) == [None] * 3

    def test_zeros_go_on_for_the_timeout_after_a_command_to_stop(self):
        twists = self.smooth([(0.0, 0.0)] + [None] * 30)
        assert [twist == (0.0, 0.0) for twist in twists] == [True] * 21 + [False] * 10

    def test_a_command_that_is_not_renewed_is_ramped_down(self):
        twists = self.smooth([(0.26, 0.0)] + [None] * 30)
        assert [t.v for t in twists[20:24] if t] == pytest.approx([0.26, 0.135, 0.01, 0.0])
        assert twists[24:] == [None] * 7

    def test_the_timer_has_a_rate_of_its_own(self):
        smoother = VelocitySmoother(self.EXAMPLE.replace(smoothing_frequency=50.0), first_time=0.02)
        smoother.take(Twist(0.26, 0.0), 0.0)
        assert smoother.advance(0.01) is None
        assert smoother.advance(0.05).v == pytest.approx(2 * 2.5 / 50.0)


def plain_smooth(current, wanted, params):
    """One step of the smoother, component by component."""
    steps = []
    for axis, before, given_speed in zip((0, 2), current, wanted, strict=True):
        asked = min(max(given_speed, params.min_velocity[axis]), params.max_velocity[axis])
        brakes = abs(asked) < abs(before) or before * asked < 0.0
        limit = (-params.max_decel if brakes else params.max_accel)[axis] / params.smoothing_frequency
        steps.append((before, asked - before, limit))
    shares = [limit / abs(change) for _, change, limit in steps if abs(change) > limit > 0.0]
    ratio = min([1.0, *shares]) if params.scale_velocities else 1.0
    return tuple(before + min(max(ratio * change, -limit), limit) for before, change, limit in steps)


SPEED, LIMIT = st.floats(-2.0, 2.0), st.floats(0.0, 4.0)


@given(st.tuples(SPEED, SPEED), st.tuples(SPEED, SPEED), st.lists(LIMIT, min_size=8, max_size=8), st.booleans())
def test_the_kernel_smooths_as_its_plain_twin(current, wanted, limits, scales):
    values = np.array(limits)
    highest, lowest, speeding_up, slowing_down = (np.array([v, 0.0, w]) for v, w in values.reshape(4, 2))
    params = SimpleNamespace(
        min_velocity=-lowest, max_velocity=highest, max_accel=speeding_up, max_decel=-slowing_down,
        smoothing_frequency=20.0, scale_velocities=scales,
    )  # fmt: skip
    assert smooth(*current, *wanted, limits_of(params), scales) == plain_smooth(current, wanted, params)
