from __future__ import annotations

import pickle
from collections import Counter
from types import SimpleNamespace

import numpy as np
import pytest

from controllers.base import STOP, ControllerAbort, ControllerError, InvalidPath, Twist
from controllers.checkers import GoalChecker, ProgressChecker
from controllers.nav2_params import load_preset
from controllers.nav2_params.navigation import VelocitySmoother
from controllers.navigator import navigator as navigator_module
from controllers.navigator.controller_server import ControllerServer
from controllers.navigator.navigator import Navigator
from gym_mapbench.costmap import Costmap, build_static_costmap
from gym_mapbench.errors import ConfigError, NoPathError
from gym_mapbench.world.frames import IDENTITY
from gym_mapbench.world.scenario import Pose
from tests.controllers.plain_follower import (
    GOAL,
    OPEN,
    PERIOD,
    START,
    Drive,
    PlainFollower,
    context,
    plain_navigation,
    walled_off,
)

STANDING = {"pose": np.array(START), "odom": np.array(START), "velocity": np.zeros(2)}


def drive(follower=None, params=None, grid=OPEN, steps=4000, **options) -> tuple[Navigator, Drive]:
    navigator = Navigator(follower or PlainFollower(), params or plain_navigation(), "plain", **options)
    navigator.reset(context(grid))
    return navigator, Drive(navigator).run(steps)


def kinds(navigator: Navigator) -> list[str]:
    return [event.kind for event in navigator.events]


def raises(error: Exception):
    def answer(now: float) -> Twist:
        raise error

    return answer


def server(**changes):
    return load_preset("thesis").controller_server.replace(**changes)


class TestWayToTheGoal:
    def test_succeeds_in_the_tick_in_which_the_goal_check_passes(self):
        navigator, run = drive()
        assert navigator.status == "succeeded"
        assert run.commands[-1] == STOP
        assert np.hypot(run.pose.x - GOAL.x, run.pose.y - GOAL.y) <= 0.25
        assert navigator.follower.log[-1][1] == pytest.approx(run.time)

    def test_replans_each_second_from_the_start_on(self):
        navigator, run = drive()
        replans = [event.time for event in navigator.events]
        assert replans == pytest.approx(np.arange(0, run.time, 1.0))
        assert set(kinds(navigator)) == {"replan"}
        assert len(navigator.follower.calls("set_plan")) == len(replans)

    def test_follower_is_asked_once_a_period_after_the_replan(self):
        navigator, run = drive()
        log = navigator.follower.log
        times = [entry[1] for entry in navigator.follower.calls("compute")]
        assert times == pytest.approx([step * PERIOD for step in range(len(run.commands))])
        after_second = next(i for i, entry in enumerate(log) if entry[:2] == ("compute", 1.0))
        assert log[after_second - 1][0] == "set_plan"

    def test_first_and_newest_path(self):
        navigator, _ = drive()
        assert navigator.first_path[0, :2] == pytest.approx(START[:2], abs=0.05)
        assert tuple(navigator.first_path[-1]) == GOAL
        assert len(navigator.path) < len(navigator.first_path)

    def test_act_after_the_end_stands_still(self):
        navigator, run = drive()
        assert run.step() == STOP
        assert navigator.status == "succeeded"

    def test_reset_forgets_everything(self):
        navigator, first = drive()
        events = list(navigator.events)
        navigator.reset(context())
        assert (navigator.status, navigator.events, len(navigator.path)) == ("running", [], 0)
        second = Drive(navigator).run()
        assert second.commands == first.commands
        assert navigator.events == events

    def test_calls_are_counted_and_timed(self):
        navigator, run = drive()
        assert navigator.controller_calls == len(run.commands)
        assert navigator.controller_seconds > 0.0

    def test_a_run_continues_after_pickling(self):
        # A follower with a lambda does not pickle; this one has a function of the module.
        navigator = Navigator(PlainFollower(_nothing), plain_navigation(), "plain")
        navigator.reset(context())
        begun = Drive(navigator).run(30)
        copy = pickle.loads(pickle.dumps(begun))
        assert copy.run().commands == begun.run().commands
        assert copy.navigator.status == "succeeded"


def _nothing(now: float) -> None:
    return None


class TestControllerServer:
    def test_t3_odometry_is_thresholded(self):
        navigator = Navigator(PlainFollower(), plain_navigation(), "plain")
        navigator.reset(context())
        Drive(navigator, velocity=Twist(0.0008, 0.002)).step()
        assert navigator.follower.calls("compute")[0][3] == (0.0, 0.002)

    def test_t3_patience_ends_after_the_tolerance(self):
        navigator, run = drive(PlainFollower(raises(ControllerError("nothing legal"))))
        assert (navigator.status, navigator.failure_kind) == ("failed", "controller_failure")
        assert navigator.failure_reason == "nothing legal"
        assert run.time == pytest.approx(0.35)
        assert set(run.commands) == {STOP}
        assert kinds(navigator) == ["replan", "controller_failure"]

    def test_patience_counts_from_the_last_valid_command(self):
        def answer(now: float) -> Twist | None:
            if now >= 0.5 - 1e-9:
                raise ControllerError("blocked")
            return None

        assert drive(PlainFollower(answer))[1].time == pytest.approx(0.45 + 0.35)

    @pytest.mark.parametrize(("tolerance", "steps"), [(0.0, 1), (-1.0, 200)])
    def test_no_patience_and_endless_patience(self, tolerance, steps):
        params = plain_navigation(controller_server=server(failure_tolerance=tolerance))
        _, run = drive(PlainFollower(raises(ControllerError("blocked"))), params, steps=200)
        assert len(run.commands) == steps

    @pytest.mark.parametrize(("option", "steps"), [(False, 1), (True, 8)])
    def test_abort_ends_the_action_at_once_unless_it_is_an_exception(self, option, steps):
        abort = raises(ControllerAbort("Optimizer fail to compute path"))
        navigator, run = drive(PlainFollower(abort), abort_is_exception=option)
        assert len(run.commands) == steps
        assert navigator.failure_reason == "Optimizer fail to compute path"

    def test_standing_still_is_no_progress(self):
        navigator, run = drive(PlainFollower(lambda now: STOP))
        assert navigator.failure_reason == "Failed to make progress"
        assert run.time == pytest.approx(10.05)

    def test_progress_checker_can_be_switched_off(self):
        params = plain_navigation(controller_server=server(progress_checker=ProgressChecker(plugin="none")))
        navigator, _ = drive(PlainFollower(lambda now: STOP), params, steps=400)
        assert navigator.status == "running"

    def test_a_new_path_unlatches_the_position(self):
        # Within 0.25 m of the goal, facing away, then pushed out of the circle and turned.
        navigator = Navigator(PlainFollower(lambda now: STOP), plain_navigation(), "plain")
        for pushed_at, status in ((10, "succeeded"), (20, "running")):
            navigator.reset(context())
            run = Drive(navigator, start=Pose(GOAL.x - 0.24, GOAL.y, 0.5))
            run.run(pushed_at)
            run.pose = Pose(GOAL.x - 0.27, GOAL.y, 0.2)
            run.step()
            assert navigator.status == status

    def test_slower_controller_holds_its_command(self):
        params = plain_navigation(controller_server=server(controller_frequency=10.0))
        navigator, run = drive(params=params, steps=20)
        assert navigator.follower.setup.control_period == 0.1
        assert navigator.controller_calls == 10
        assert run.commands[0::2] == run.commands[1::2]

    def test_faster_controller_than_control_is_refused(self):
        params = plain_navigation(controller_server=server(controller_frequency=30.0))
        with pytest.raises(ConfigError, match=r"controller_frequency: expected at most .* 20 Hz, got 30"):
            Navigator(PlainFollower(), params, "plain").reset(context())

    @pytest.mark.parametrize(
        ("checker", "tolerance"),
        [
            ({"plugin": "axis", "along_path_tolerance": 0.3, "cross_track_tolerance": 0.15}, 0.15),
            ({"plugin": "axis", "along_path_tolerance": 0.1, "cross_track_tolerance": 0.15}, 0.1),
            ({"plugin": "adaptive", "coarse_xy_goal_tolerance": 0.4}, 0.4),
            ({"plugin": "stopped", "xy_goal_tolerance": 0.2, "coarse_xy_goal_tolerance": 0.4}, 0.2),
        ],
    )
    def test_follower_is_told_the_tolerance_that_its_goal_checker_has(self, checker, tolerance):
        preset = load_preset("lyrical")
        checked = preset.controller_server.replace(goal_checker=GoalChecker(**checker))
        setup = Navigator(PlainFollower(), preset.replace(controller_server=checked), "plain").follower_setup(context())
        assert setup.xy_goal_tolerance == tolerance

    def test_follower_is_told_tolerances_footprint_and_inflation(self):
        checker = GoalChecker(xy_goal_tolerance=0.1, yaw_goal_tolerance=0.2)
        navigator = Navigator(
            PlainFollower(), plain_navigation(controller_server=server(goal_checker=checker)), "plain"
        )
        navigator.reset(context())
        setup = navigator.follower.setup
        assert (setup.xy_goal_tolerance, setup.yaw_goal_tolerance) == (0.1, 0.2)
        assert (setup.inflation_radius, setup.cost_scaling_factor) == (0.55, 3.0)
        assert setup.footprint.inscribed_radius == pytest.approx(0.225498, abs=1e-6)

    def test_follower_is_told_the_inscribed_radius_of_lyricals_inflation_layer(self):
        preset = load_preset("lyrical")
        inflation = preset.local_costmap.inflation_layer.replace(custom_inscribed_radius=0.1)
        params = preset.replace(local_costmap=preset.local_costmap.replace(inflation_layer=inflation))
        setup = Navigator(PlainFollower(), params, "plain").follower_setup(context())
        assert setup.custom_inscribed_radius == 0.1


def published_by(release, follower, pose, **changes):
    """What a controller server publishes in the first cycle on a path of 1 m."""
    published = []
    robot = SimpleNamespace(local_pose=pose, odometry=STOP, map_in_local=IDENTITY)
    free = Costmap(np.zeros((60, 60), np.uint8), 0.05, -1.0, -1.5)
    costmap = SimpleNamespace(is_current=lambda now: True, next_update=1.0, costmap=free)
    executor = ControllerServer(follower, server(**changes), robot, costmap, published.append, release=release)
    executor.begin(np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]), 0.0)
    assert executor.step(0.0) is not None
    return published


@pytest.mark.parametrize(
    ("release", "at_goal", "failed"),
    [("humble", [Twist(0.1, 0.2)], [STOP]), ("jazzy", [], []), ("lyrical", [], [STOP])],
)
def test_the_robot_is_stopped_where_an_action_ends_unless_the_file_says_no(release, at_goal, failed):
    follower, there = PlainFollower(lambda now: Twist(0.1, 0.2)), Pose(1.0, 0.0)
    blocked = PlainFollower(raises(ControllerAbort("no way")))
    assert published_by(release, follower, there) == [*at_goal, STOP]
    assert published_by(release, blocked, START) == [STOP]
    assert published_by(release, follower, there, publish_zero_velocity=False) == at_goal
    assert published_by(release, blocked, START, publish_zero_velocity=False) == failed


class TestRecoveries:
    def test_t4_planner_always_fails(self):
        navigator, _ = drive(params=plain_navigation(recoveries=True), grid=walled_off())
        assert (navigator.status, navigator.failure_kind) == ("failed", "planner_failure")
        assert Counter(kinds(navigator)) == {
            "replan_failure": 14,
            "clear_global": 7 + 2,
            "clear_local": 2,
            "spin": 2,
            "wait": 1,
            "backup": 1,
            "planner_failure": 1,
        }
        assert navigator.number_recoveries == 15
        assert navigator.follower.log == []

    def test_t4_order_of_the_recoveries(self):
        navigator, _ = drive(params=plain_navigation(recoveries=True), grid=walled_off())
        attempt = ["replan_failure", "clear_global", "replan_failure"]
        clear = ["clear_local", "clear_global"]
        turns = [clear, ["spin"], ["wait"], ["backup"], clear, ["spin"], ["planner_failure"]]
        assert kinds(navigator) == [kind for turn in turns for kind in attempt + turn]

    def test_controller_always_aborts(self):
        abort = raises(ControllerAbort("no"))
        navigator, _ = drive(PlainFollower(abort), plain_navigation(recoveries=True))
        assert (navigator.status, navigator.failure_kind) == ("failed", "controller_failure")
        assert navigator.number_recoveries == 15
        assert navigator.controller_calls == 14
        assert kinds(navigator).count("replan") == 7

    def test_the_robot_frees_itself(self):
        def answer(now: float) -> Twist | None:
            if now < 3.0:
                raise ControllerAbort("stuck")
            return None

        navigator, run = drive(PlainFollower(answer), plain_navigation(recoveries=True))
        assert navigator.status == "succeeded"
        assert kinds(navigator).count("spin") == 1
        assert run.commands[27] == (0.0, 1.0)

    def test_one_contextual_retry_until_an_outer_recovery(self):
        fails = iter(step in (10, 30, 50) for step in range(10_000))

        def answer(now: float) -> Twist | None:
            if next(fails):
                raise ControllerAbort("stuck")
            return None

        navigator, _ = drive(PlainFollower(answer), plain_navigation(recoveries=True))
        recoveries = [kind for kind in kinds(navigator) if kind not in ("replan", "controller_failure")]
        assert navigator.status == "succeeded"
        assert recoveries == ["clear_local", "clear_local", "clear_global", "clear_local"]

    def test_missing_behaviour_gives_its_turn_to_the_next(self):
        params = plain_navigation(recoveries=True)
        params = params.replace(behavior_server=params.behavior_server.replace(behavior_plugins=("wait",)))
        navigator, _ = drive(params=params, grid=walled_off())
        assert Counter(kinds(navigator))["wait"] == 3
        assert not {"spin", "backup"} & set(kinds(navigator))

    @pytest.mark.parametrize(("release", "turns_after", "fastest"), [("humble", 1.0, 1.0), ("jazzy", 0.0, 0.2)])
    def test_a_spin_and_the_smoother(self, release, turns_after, fastest):
        """Humble's smoother stops the robot for a second after the controller has failed; Jazzy's smooths the spin."""
        params = plain_navigation(recoveries=True, release=release).replace(
            velocity_smoother=VelocitySmoother(max_velocity=(0.1, 0.0, 0.2), min_velocity=(-0.1, 0.0, -0.2))
        )

        def answer(now: float) -> Twist | None:
            if now < 3.0:
                raise ControllerError("stuck")
            return None

        navigator, run = drive(PlainFollower(answer), params)
        spin = next(event.time for event in navigator.events if event.kind == "spin")
        turning = [step * PERIOD for step, command in enumerate(run.commands) if command.w]
        assert turning[0] - spin == pytest.approx(turns_after, abs=0.101)
        assert max(command.w for command in run.commands) == pytest.approx(fastest)
        assert max(command.v for command in run.commands) == pytest.approx(0.1)


class TestPlanning:
    class Planner:
        """Finds a path at the given calls only."""

        def __init__(self, good: set[int]) -> None:
            self.good, self.calls = good, 0

        def plan(self, costmap, start, goal):
            self.calls += 1
            if self.calls not in self.good:
                raise NoPathError("no path")
            x = np.linspace(start.x, goal.x, 40)
            return np.stack([x, np.full(40, 1.0), np.zeros(40)], axis=1)

    def test_without_recoveries_a_failed_replan_keeps_the_old_path(self, monkeypatch):
        monkeypatch.setattr(navigator_module, "make_planner", lambda name, **params: self.Planner({1, 4}))
        navigator, _ = drive()
        assert navigator.status == "succeeded"
        events = [(event.time, event.kind) for event in navigator.events[:5]]
        assert events == [
            (0.0, "replan"),
            (1.0, "replan_failure"),
            (2.0, "replan_failure"),
            (3.0, "replan"),
            (4.0, "replan_failure"),
        ]
        assert len(navigator.follower.calls("set_plan")) == 2

    def test_without_recoveries_no_first_path_is_the_end(self, monkeypatch):
        monkeypatch.setattr(navigator_module, "make_planner", lambda name, **params: self.Planner(set()))
        navigator, run = drive()
        assert (navigator.status, navigator.failure_kind) == ("failed", "planner_failure")
        assert len(run.commands) == 1

    def test_with_recoveries_a_failed_replan_stops_the_robot(self, monkeypatch):
        monkeypatch.setattr(navigator_module, "make_planner", lambda name, **params: self.Planner({1, *range(6, 99)}))
        navigator, run = drive(params=plain_navigation(recoveries=True))
        assert navigator.status == "succeeded"
        # The first attempt fails at 1.0 s, the second one when the cleared costmap is updated; then clear, then spin.
        assert run.commands[39] != STOP
        assert run.commands[40] == STOP
        first = [(event.time, event.kind) for event in navigator.events[1:6]]
        assert first == [
            (1.0, "replan_failure"),
            (1.0, "clear_global"),
            (2.0, "replan_failure"),
            (2.0, "clear_local"),
            (2.0, "clear_global"),
        ]


class TestLatency:
    """``latency: nav2``: the recorded times of a tree that waits for costmaps, for updates on whole seconds."""

    def params(self, **changes):
        params = plain_navigation(recoveries=True, **changes)
        return params.replace(bt=params.bt.replace(latency="nav2"))

    def test_replans_are_a_second_and_the_planning_time_apart(self):
        navigator, _ = drive(params=self.params())
        assert navigator.status == "succeeded"
        replans = [event.time for event in navigator.events]
        assert replans[:4] == pytest.approx([0.03, 1.06, 2.09, 3.12])
        assert len(navigator.follower.calls("set_plan")) == len(replans)

    def test_the_controller_cycles_from_its_first_path_on(self):
        navigator, _ = drive(params=self.params())
        times = [entry[1] for entry in navigator.follower.calls("compute")]
        assert times[:3] == pytest.approx([0.0305, 0.0805, 0.1305])

    @pytest.mark.parametrize(
        ("error", "grid", "latest"),
        [
            (None, walled_off(), 22.04),
            (ControllerError("nothing legal"), OPEN, 20.12),
            (ControllerAbort("no"), OPEN, 17.02),
        ],
    )
    def test_a_run_without_a_chance_lasts_as_long_as_in_nav2(self, error, grid, latest):
        follower = PlainFollower() if error is None else PlainFollower(raises(error))
        navigator, run = drive(follower, self.params(), grid)
        assert (navigator.status, navigator.number_recoveries) == ("failed", 15)
        assert run.time == pytest.approx(latest, abs=PERIOD)
        assert not any(command.v > 0.0 for command in run.commands)

    def test_a_run_continues_after_pickling(self):
        navigator = Navigator(PlainFollower(_nothing), self.params(), "plain")
        navigator.reset(context())
        begun = Drive(navigator).run(30)
        copy = pickle.loads(pickle.dumps(begun))
        assert copy.run().commands == begun.run().commands


class TestJazzy:
    """Recoveries are tried only where they may help, and controllers forget when an action ends."""

    def params(self, **changes):
        return plain_navigation(recoveries=True, release="jazzy", **changes)

    def test_no_recovery_helps_against_an_invalid_path(self):
        invalid = PlainFollower(raises(InvalidPath("nothing left")))
        navigator, run = drive(invalid, self.params())
        assert (navigator.status, run.time) == ("failed", 0.0)
        assert kinds(navigator) == ["replan", "controller_failure"]
        navigator, _ = drive(PlainFollower(raises(ControllerAbort("unknown"))), self.params())
        assert navigator.number_recoveries > 6

    def test_no_recovery_helps_where_start_or_goal_is_off_the_map(self):
        params = self.params()
        navigator = Navigator(PlainFollower(), params, "plain")
        navigator.reset(context(goal=Pose(9.0, 1.0)))
        Drive(navigator).run()
        assert set(kinds(navigator)) == {"replan_failure", "planner_failure"}
        navigator, _ = drive(params=params, grid=walled_off())
        assert navigator.number_recoveries == 15

    def test_the_goal_is_checked_before_the_controller_is_asked(self):
        calls = {}
        for release in ("humble", "jazzy"):
            navigator, run = drive(params=plain_navigation(release=release))
            assert navigator.status == "succeeded"
            calls[release] = len(run.commands) - navigator.controller_calls
        assert calls == {"humble": 0, "jazzy": 1}

    def test_a_controller_that_waits_too_long_for_its_costmap_ends_the_navigation(self):
        slow = plain_navigation(release="jazzy").local_costmap.replace(update_frequency=1.0)
        navigator, run = drive(PlainFollower(raises(ControllerError("stuck"))), self.params(local_costmap=slow))
        assert (navigator.status, navigator.failure_reason) == ("failed", "Costmap timed out waiting for update")
        assert run.time == pytest.approx(0.35 + 0.35)

    def test_the_controller_forgets_whenever_an_action_ends(self):
        class Forgetful(PlainFollower):
            def end_action(self):
                self.log.append(("end_action",))

        navigator, _ = drive(Forgetful(), self.params())
        assert navigator.status == "succeeded"
        assert len(navigator.follower.calls("end_action")) == 1
        navigator, _ = drive(Forgetful(), plain_navigation())
        assert not navigator.follower.calls("end_action")
        failing = Forgetful(raises(ControllerError("stuck")))
        navigator, _ = drive(failing, self.params())
        attempts = kinds(navigator).count("controller_failure")
        assert len(failing.calls("end_action")) >= attempts > 1


class TestLocalCostmap:
    def test_fixed_window_with_a_static_layer_is_the_whole_inflated_map(self):
        navigator, _ = drive(steps=1)
        params, robot = navigator.params.local_costmap, context().robot
        expected = build_static_costmap(OPEN, params, params.make_footprint(robot))
        assert np.array_equal(navigator.follower.costmap.costs, expected.costs)

    def test_scan_is_asked_for_only_where_a_layer_looks_at_it(self):
        assert Navigator(PlainFollower(), plain_navigation(), "plain").observation_keys == ("pose", "odom", "velocity")
        rolling = Navigator(PlainFollower(), load_preset("thesis"), "plain")
        assert rolling.observation_keys == ("pose", "odom", "velocity", "scan")

    def test_window_is_updated_at_its_own_rate(self):
        navigator = Navigator(PlainFollower(), load_preset("thesis"), "plain")
        navigator.reset(context())
        scan = np.full(360, 3.5, dtype=np.float32)
        seen = []
        for _ in range(12):
            navigator.act({**STANDING, "scan": scan})
            costmap = navigator.follower.costmap
            seen.append((costmap.costs == 254).any())
            scan = scan.copy()
            scan[0] = 1.0
        assert seen == [False] * 4 + [True] * 8

    def test_a_scan_that_is_held_is_not_a_new_scan(self):
        navigator = Navigator(PlainFollower(), load_preset("thesis"), "plain")
        navigator.reset(context())
        first, other = np.full(360, 3.0, dtype=np.float32), np.full(360, 2.0, dtype=np.float32)
        seen = [navigator._new_scan({"scan": scan.copy()}) for scan in (first, first, other, other, first)]
        assert [scan is not None for scan in seen] == [True, False, True, False, True]
        assert navigator._new_scan({}) is None

    def test_scan_of_another_lidar_is_refused(self):
        navigator = Navigator(PlainFollower(), load_preset("thesis"), "plain")
        navigator.reset(context())
        with pytest.raises(ConfigError, match="scan: expected 360 ranges, one a beam, got 10"):
            navigator.act({**STANDING, "scan": np.ones(10)})
