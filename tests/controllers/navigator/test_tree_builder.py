from __future__ import annotations

import re

import numpy as np
import pytest

from controllers.base import ControllerError, Twist
from controllers.navigator.behavior_tree import Condition, Node, Sequence, SequenceWithMemory, Status
from controllers.navigator.behavior_tree import ReactiveSequence as Reactive
from controllers.navigator.conditions import GlobalUpdatedGoal, PathExpiringTimer, distance_traveled, time_expired
from controllers.navigator.decorators import (
    Again,
    DistanceController,
    GoalUpdatedController,
    Returning,
    SingleTrigger,
    SpeedController,
)
from controllers.navigator.navigator import Navigator
from controllers.navigator.path_keeper import NearestPose
from controllers.navigator.path_nodes import IsGoalNearby, PathLongerOnApproach, TruncatePath, TruncatePathLocal
from controllers.navigator.rate import Clock
from controllers.navigator.tree_builder import MAKERS
from controllers.navigator.tree_loop import TreeLoop
from controllers.tree_xml.nodes import NODES
from gym_mapbench.releases import RELEASES
from gym_mapbench.world.scenario import Pose
from tests.controllers.navigator.test_behavior_tree import F, R, S, Scripted
from tests.controllers.plain_follower import OPEN, Drive, PlainFollower, context, plain_navigation, walled_off
from tests.controllers.trees import FOLLOW, PLAN, default_xml, xml_of

START, GOAL = Pose(0.5, 0.5, 0.5), Pose(4.5, 2.4, 0.0)
STRAIGHT = np.column_stack([np.arange(0.0, 10.0, 0.5), np.zeros(20), np.zeros(20)])

CUT = '<TruncatePath input_path="{path}" output_path="{part}" distance="1.5"/>'
SMOOTH = '<SmoothPath unsmoothed_path="{path}" smoothed_path="{smooth}"/>'


class Robot:
    """A robot that is where it is put, and drives as fast as it is told."""

    acceleration = 0.0

    def __init__(self) -> None:
        self.pose, self.odometry = Pose(0.0, 0.0, 0.0), Twist(0.0, 0.0)


class Remembering(PlainFollower):
    """A follower that remembers its plans."""

    def __init__(self) -> None:
        super().__init__()
        self.paths: list[np.ndarray] = []

    def set_plan(self, path) -> None:
        super().set_plan(path)
        self.paths.append(path)


def ticks(node: Node, times: int) -> list[Status]:
    return [node.execute_tick() for _ in range(times)]


def run_of(xml: str, release: str = "humble", grid=OPEN, follower=None, steps: int = 1500, **bt) -> Navigator:
    params = plain_navigation(recoveries=True, release=release)
    tree = params.bt.replace(**bt) if not xml else params.bt.replace(xml=xml, **bt)
    navigator = Navigator(follower or PlainFollower(), params.replace(bt=tree), "plain")
    navigator.reset(context(grid, START, GOAL))
    Drive(navigator, START).run(steps)
    return navigator


def replans(navigator: Navigator) -> list[float]:
    return [event.time for event in navigator.events if event.kind == "replan"]


def failing(now: float) -> Twist:
    raise ControllerError("no command")


def failing_at_times(now: float) -> Twist | None:
    if 1.0 < now % 4.0 < 1.6:
        raise ControllerError("no command")
    return None


def test_every_node_that_can_be_read_can_be_built():
    assert MAKERS.keys() == NODES.keys()


@pytest.mark.parametrize("latency", ["ideal", "nav2"])
@pytest.mark.parametrize("release", RELEASES)
@pytest.mark.parametrize(
    ("grid", "answer"), [(OPEN, lambda now: None), (OPEN, failing), (OPEN, failing_at_times), (walled_off(), None)]
)
def test_the_default_tree_read_from_its_xml_drives_as_the_default_tree(release, latency, grid, answer):
    follower = PlainFollower(answer) if answer else PlainFollower()
    usual = run_of("", release, grid, follower, latency=latency)
    read = run_of(default_xml(release), release, grid, follower, latency=latency)
    assert (read.events, read.status, read.failure_reason) == (usual.events, usual.status, usual.failure_reason)
    assert len(usual.events) > 1


class TestTreesOfUsers:
    def test_replanning_by_distance_plans_once_a_metre(self):
        navigator = run_of(
            xml_of(f"<PipelineSequence><DistanceController>{PLAN}</DistanceController>{FOLLOW}</PipelineSequence>")
        )
        assert (navigator.status, len(replans(navigator))) == ("succeeded", 5)

    def test_replanning_by_speed_plans_less_often_while_the_robot_is_slow(self):
        tree = xml_of(f"<PipelineSequence><SpeedController>{PLAN}</SpeedController>{FOLLOW}</PipelineSequence>")
        slow, fast = run_of(tree, follower=PlainFollower(lambda now: Twist(0.06, 0.0)), steps=240), run_of(tree)
        assert np.allclose(replans(slow), [0.0, 1.0, 5.8, 10.6], atol=0.11)
        assert 1.0 < np.diff(replans(fast)).mean() < 1.3

    def test_a_plan_is_kept_while_it_is_valid(self):
        keeps = "<Fallback><ReactiveSequence><Inverter><GlobalUpdatedGoal/></Inverter>"
        keeps += f'<IsPathValid path="{{path}}"/></ReactiveSequence>{PLAN}</Fallback>'
        navigator = run_of(
            xml_of(f'<PipelineSequence><RateController hz="1.0">{keeps}</RateController>{FOLLOW}</PipelineSequence>')
        )
        assert (navigator.status, replans(navigator)) == ("succeeded", [0.0])

    def test_an_expired_plan_is_made_anew(self):
        keeps = '<Fallback><ReactiveSequence><Inverter><PathExpiringTimer seconds="2.5" path="{path}"/></Inverter>'
        keeps += f'<IsPathValid path="{{path}}"/></ReactiveSequence>{PLAN}</Fallback>'
        navigator = run_of(
            xml_of(f'<PipelineSequence><RateController hz="2.0">{keeps}</RateController>{FOLLOW}</PipelineSequence>')
        )
        assert np.allclose(np.diff(replans(navigator)), 3.0, atol=0.6)

    def test_the_robot_follows_the_part_of_the_path_that_is_cut_for_it(self):
        cut = (
            '<TruncatePathLocal input_path="{path}" output_path="{part}" distance_forward="1" distance_backward="0.5"/>'
        )
        follow, follower = FOLLOW.replace("{path}", "{part}"), Remembering()
        run_of(
            xml_of(
                f'<PipelineSequence><RateController hz="1.0">{PLAN}</RateController>{cut}{follow}</PipelineSequence>'
            ),
            follower=follower,
        )
        lengths = [np.hypot(*np.diff(path[:, :2], axis=0).T).sum() for path in follower.paths]
        assert len(lengths) > 10
        assert 1.4 < max(lengths) < 1.6

    def test_a_tree_may_plan_once_and_fail_without_recoveries(self):
        navigator = run_of(xml_of(f"<Sequence>{PLAN}{FOLLOW}</Sequence>"), follower=PlainFollower(failing))
        assert (navigator.status, navigator.failure_kind) == ("failed", "controller_failure")
        assert navigator.number_recoveries == 0

    def test_a_spin_that_is_no_recovery_is_not_counted(self):
        turn = '<Spin spin_dist="1.0" is_recovery="false"/>'
        navigator = run_of(xml_of(f"<Sequence>{turn}{PLAN}{FOLLOW}</Sequence>"))
        assert (navigator.status, navigator.number_recoveries) == ("succeeded", 0)
        assert replans(navigator)[0] > 0.5

    @pytest.mark.parametrize("release", RELEASES)
    @pytest.mark.parametrize(
        "loop",
        [
            '<Repeat num_cycles="-1"><AlwaysSuccess/></Repeat>',
            '<RetryUntilSuccessful num_attempts="-1"><AlwaysFailure/></RetryUntilSuccessful>',
            '<RecoveryNode number_of_retries="2000000000"><AlwaysFailure/><AlwaysSuccess/></RecoveryNode>',
        ],
    )
    def test_a_loop_that_lets_no_time_pass_goes_on_in_the_next_tick(self, release, loop):
        navigator = run_of(xml_of(f"<Sequence>{loop}{PLAN}{FOLLOW}</Sequence>"), release, steps=3)
        assert (navigator.status, navigator.events) == ("running", [])

    @pytest.mark.parametrize("latency", ["ideal", "nav2"])
    def test_a_planner_that_always_fails_is_retried_until_the_run_ends(self, latency):
        drive = f"<Sequence>{PLAN}{FOLLOW}</Sequence><AlwaysSuccess/>"
        tree = xml_of(f'<RecoveryNode number_of_retries="999999">{drive}</RecoveryNode>')
        navigator = run_of(tree, grid=walled_off(), steps=2, latency=latency)
        assert navigator.status == "running"

    def test_since_jazzy_what_stands_before_a_retry_is_asked_again(self):
        retry = '<RetryUntilSuccessful num_attempts="2"><AlwaysFailure/></RetryUntilSuccessful>'
        clear = '<ClearEntireCostmap service_name="local_costmap/clear_entirely_local_costmap"/>'
        tree = xml_of(
            f"<Sequence><ReactiveFallback><Inverter>{clear}</Inverter>{retry}</ReactiveFallback>{DRIVE}</Sequence>"
        )
        clears = [len(run_of(tree, release, steps=2).events) for release in RELEASES]
        assert clears == [1, 2, 2]

    def test_a_negative_length_of_path_is_all_of_it_in_lyrical_alone(self):
        cut = (
            '<TruncatePathLocal input_path="{path}" output_path="{part}" distance_forward="-1" distance_backward="0"/>'
        )
        tree = xml_of(f"<Sequence>{PLAN}{cut}{FOLLOW.replace('{path}', '{part}')}</Sequence>")
        lengths = []
        for release in RELEASES:
            run_of(tree, release, follower=(follower := Remembering()), steps=3)
            lengths.append(len(follower.paths[0]))
        assert lengths[:2] == [1, 1]
        assert lengths[2] > 50

    @pytest.mark.parametrize(("checks", "backs"), [("false", False), ("true", True)])
    def test_a_back_up_without_collision_checks_ignores_the_wall_behind(self, checks, backs):
        back = f'<BackUp backup_dist="0.3" backup_speed="0.1" disable_collision_checks="{checks}"/>'
        navigator = Navigator(PlainFollower(), plain_navigation(recoveries=True, release="jazzy"), "plain")
        tree = navigator.params.bt.replace(xml=xml_of(f"<Sequence>{back}{PLAN}{FOLLOW}</Sequence>"))
        navigator.params = navigator.params.replace(bt=tree)
        start = Pose(0.3, 1.0, 0.0)
        navigator.reset(context(OPEN, start, GOAL))
        commands = Drive(navigator, start).run(100).commands
        assert (min(command.v for command in commands) < 0.0) == backs

    @pytest.mark.parametrize(("speed", "forward"), [("0.2", True), ("-0.2", False)])
    def test_a_drive_on_the_heading_goes_its_distance_and_counts_as_no_recovery(self, speed, forward):
        dist = "0.4" if forward else "-0.4"
        drive = f'<DriveOnHeading dist_to_travel="{dist}" speed="{speed}" time_allowance="5"/>'
        params = plain_navigation(recoveries=True)
        xml = xml_of(f"<Sequence>{drive}{PLAN}{FOLLOW}</Sequence>")
        navigator = Navigator(PlainFollower(), params.replace(bt=params.bt.replace(xml=xml)), "plain")
        start = Pose(2.0, 1.5, 0.0)
        navigator.reset(context(OPEN, start, GOAL))
        commands = Drive(navigator, start).run(60).commands
        driven = [command.v for command in commands if command.w == 0.0 and abs(command.v) == pytest.approx(0.2)]
        assert np.isclose(sum(driven) * 0.05, float(dist), atol=0.03)
        assert (len(replans(navigator)) > 0, navigator.number_recoveries) == (True, 0)

    @pytest.mark.parametrize(
        ("ports", "fails_after"),
        [
            ('dist_to_travel="1.0" speed="0.1" time_allowance="0.5"', 0.6),
            ('dist_to_travel="1.0" speed="-0.1"', 0.0),
            ('dist_to_travel="3.0" speed="1.0"', 0.0),
        ],
    )
    def test_a_drive_on_the_heading_fails_out_of_time_against_its_sign_and_before_a_wall(self, ports, fails_after):
        params = plain_navigation(recoveries=True)
        xml = xml_of(f"<Sequence><Inverter><DriveOnHeading {ports}/></Inverter>{PLAN}{FOLLOW}</Sequence>")
        navigator = Navigator(PlainFollower(), params.replace(bt=params.bt.replace(xml=xml)), "plain")
        start = Pose(4.0, 1.5, 0.0)
        navigator.reset(context(OPEN, start, GOAL))
        Drive(navigator, start).run(60)
        assert fails_after <= replans(navigator)[0] <= fails_after + 0.15

    def test_the_lyrical_drive_on_the_heading_has_the_limits_of_its_code(self):
        params = plain_navigation(recoveries=True, release="lyrical")
        drive = '<DriveOnHeading dist_to_travel="0.5" speed="0.4" time_allowance="5"/>'
        xml = xml_of(f"<Sequence>{drive}{PLAN}{FOLLOW}</Sequence>")
        navigator = Navigator(PlainFollower(), params.replace(bt=params.bt.replace(xml=xml)), "plain")
        start = Pose(2.0, 1.5, 0.0)
        navigator.reset(context(OPEN, start, GOAL))
        commands = Drive(navigator, start).run(12).commands
        assert commands[1].v == pytest.approx(0.25)
        assert max(command.v for command in commands) == pytest.approx(0.4)

    @pytest.mark.parametrize("kind", ["ClearCostmapAroundRobot", "ClearCostmapExceptRegion"])
    def test_clears_of_a_square_count_as_recoveries(self, kind):
        of = {"ClearCostmapAroundRobot": "around", "ClearCostmapExceptRegion": "except"}[kind]
        clear = f'<{kind} service_name="local_costmap/clear_{of}_local_costmap" reset_distance="2"/>'
        navigator = run_of(xml_of(f"<Sequence>{clear}{DRIVE}</Sequence>"), steps=3)
        assert [event.kind for event in navigator.events] == ["clear_local", "replan"]

    def test_a_robot_that_stops_at_once_is_stuck(self):
        asks = f"<ReactiveSequence><Inverter><IsStuck/></Inverter>{FOLLOW}</ReactiveSequence>"
        stops = PlainFollower(lambda now: Twist(0.0 if now > 1.0 else 0.6, 0.0))
        navigator = run_of(xml_of(f"<Sequence>{PLAN}{asks}</Sequence>"), follower=stops, steps=60)
        assert navigator.status == "failed"
        brakes = PlainFollower(lambda now: Twist(max(0.0, 0.4 - 0.4 * max(0.0, now - 1.0)), 0.0))
        assert run_of(xml_of(f"<Sequence>{PLAN}{asks}</Sequence>"), follower=brakes, steps=60).status == "running"

    def test_a_timeout_gives_up_a_path(self):
        tree = xml_of(f'<Sequence>{PLAN}<Timeout msec="1000">{FOLLOW}</Timeout></Sequence>')
        navigator = run_of(tree, "jazzy", latency="nav2", steps=100)
        assert navigator.status == "failed"
        assert len(navigator.follower.calls("compute")) in (20, 21)

    def test_a_number_that_the_tree_sets_counts(self):
        wait = '<SetBlackboard value="0.5" output_key="pause"/><Wait wait_duration="{pause}"/>'
        navigator = run_of(xml_of(f"<Sequence>{wait}{DRIVE}</Sequence>"), "jazzy", steps=30)
        assert 0.5 <= replans(navigator)[0] <= 0.65

    def test_a_robot_may_wait_and_plan_at_once(self):
        both = f'<Parallel success_count="-1" failure_count="1"><Wait wait_duration="1"/>{PLAN}</Parallel>'
        navigator = run_of(xml_of(f"<Sequence>{both}{FOLLOW}</Sequence>"), "jazzy", latency="nav2")
        assert navigator.status == "succeeded"
        assert replans(navigator)[0] < 0.1
        assert navigator.follower.calls("compute")[0][1] >= 1.0

    @pytest.mark.parametrize("latency", ["ideal", "nav2"])
    @pytest.mark.parametrize("release", RELEASES)
    @pytest.mark.parametrize(
        "inside",
        [
            f"<Fallback><AlwaysSuccess/><Sequence>{PLAN}{FOLLOW}</Sequence></Fallback>",
            f"<Sequence>{PLAN}<ForceSuccess><Timeout msec='1000'>{FOLLOW}</Timeout></ForceSuccess></Sequence>",
            f"<Sequence>{PLAN}{CUT}{FOLLOW.replace('{path}', '{part}')}</Sequence>",
        ],
    )
    def test_a_success_far_from_the_goal_is_a_failure_with_a_reason(self, release, latency, inside):
        navigator = run_of(xml_of(inside), release, latency=latency)
        assert (navigator.status, navigator.failure_kind) == ("failed", "controller_failure")
        assert re.fullmatch(
            r"the behaviour tree succeeded \d\.\d\d m from the goal, which the goal checker never found reached",
            navigator.failure_reason,
        )
        assert all(event.kind != "controller_failure" for event in navigator.events)

    @pytest.mark.parametrize("release", RELEASES)
    def test_a_tree_that_fails_by_itself_gives_a_reason(self, release):
        navigator = run_of(xml_of(f"<Sequence>{PLAN}<AlwaysFailure/>{FOLLOW}</Sequence>"), release)
        assert (navigator.status, navigator.failure_kind) == ("failed", "controller_failure")
        assert re.fullmatch(
            r"the behaviour tree failed 4\.\d\d m from the goal, though neither planner nor controller had failed",
            navigator.failure_reason,
        )

    @pytest.mark.parametrize("release", RELEASES)
    @pytest.mark.parametrize(
        "inside",
        [
            f"<Sequence>{PLAN}{FOLLOW}<BackUp backup_dist='1.0' backup_speed='0.2'/></Sequence>",
            f"<Sequence>{PLAN}{SMOOTH}{FOLLOW.replace('{path}', '{smooth}')}</Sequence>",
        ],
    )
    def test_the_goal_is_reached_where_the_goal_checker_once_said_so(self, release, inside):
        assert run_of(xml_of(inside), release, latency="nav2").status == "succeeded"

    @pytest.mark.parametrize(("start", "status"), [(GOAL._replace(x=4.4), "succeeded"), (START, "failed")])
    def test_a_tree_without_a_followed_path_succeeds_where_the_goal_checker_finds_the_robot(self, start, status):
        params = plain_navigation(recoveries=True)
        xml = xml_of(f"<Fallback><AlwaysSuccess/><Sequence>{PLAN}{FOLLOW}</Sequence></Fallback>")
        navigator = Navigator(PlainFollower(), params.replace(bt=params.bt.replace(xml=xml)), "plain")
        navigator.reset(context(OPEN, start, GOAL))
        Drive(navigator, start).run(3)
        assert navigator.status == status

    def test_recoveries_have_the_numbers_of_the_tree(self):
        tree = xml_of(
            f'<RecoveryNode number_of_retries="2"><Sequence>{PLAN}{FOLLOW}</Sequence>'
            '<Wait wait_duration="1.5"/></RecoveryNode>'
        )
        navigator = run_of(tree, follower=PlainFollower(failing))
        waits = [event.time for event in navigator.events if event.kind == "wait"]
        assert len(waits) == 2
        assert 1.5 <= waits[1] - waits[0] < 2.5


DRIVE = f"{PLAN}{FOLLOW}"
RATE, DISTANCE = f'<RateController hz="1.0">{PLAN}</RateController>', f"<DistanceController>{PLAN}</DistanceController>"


@pytest.mark.parametrize("latency", ["ideal", "nav2"])
@pytest.mark.parametrize("release", RELEASES)
@pytest.mark.parametrize(
    "inside",
    [
        f'{RATE}<Inverter><TimeExpired seconds="2.3"/></Inverter>{FOLLOW}',
        f'{RATE}{FOLLOW}<TimeExpired seconds="1.3"/>',
        f"{RATE}{DISTANCE}{FOLLOW}",
        f'{RATE}<RecoveryNode><Sequence><Wait wait_duration="0.7"/>{FOLLOW}</Sequence><Wait/></RecoveryNode>',
        f'{RATE}<RecoveryNode number_of_retries="150">{FOLLOW}<AlwaysSuccess/></RecoveryNode>',
        f"<RecoveryNode>{RATE}<Wait/></RecoveryNode><ReactiveSequence><GoalReached/>{FOLLOW}</ReactiveSequence>",
        f"<KeepRunningUntilFailure>{RATE}</KeepRunningUntilFailure>{FOLLOW}",
    ],
)
def test_a_tree_that_rests_does_what_it_does_when_every_tick_reaches_it(monkeypatch, inside, release, latency):
    def run() -> Navigator:
        tree = xml_of(f"<PipelineSequence>{inside}</PipelineSequence>")
        return run_of(tree, release, follower=PlainFollower(failing_at_times), steps=120, latency=latency)

    rested = run()
    monkeypatch.setattr(TreeLoop, "_rests", lambda loop: False)
    ticked = run()
    assert (rested.events, rested.status, rested.follower.log) == (ticked.events, ticked.status, ticked.follower.log)


class TestDecorators:
    def test_results_are_replaced(self):
        assert ticks(Returning(Scripted(R, S, F), F, S), 3) == [R, F, S]

    def test_a_child_is_retried_in_the_same_tick_and_the_count_begins_anew(self):
        retry = Again(Scripted(F, F, S, F, F, F), F, 3)
        assert ticks(retry, 2) == [S, F]

    def test_a_running_child_keeps_the_count(self):
        repeat = Again(Scripted(S, R, S, S, F), S, 3)
        assert ticks(repeat, 3) == [R, S, F]

    def test_a_single_trigger_ticks_its_child_once(self):
        child = Scripted(R, S)
        trigger = SingleTrigger(child)
        assert ticks(trigger, 4) == [R, S, F, F]
        assert child.ticks == 2
        trigger.stop()
        assert trigger.execute_tick() is S

    def test_a_goal_that_never_changes_is_new_once(self):
        child = Scripted(R, S)
        controller = GoalUpdatedController(child)
        assert (ticks(controller, 4), child.ticks) == ([R, S, R, R], 2)
        controller.stop()
        assert (controller.execute_tick(), child.ticks) == (S, 3)

    def test_distance_is_measured_from_the_last_success(self):
        robot, child = Robot(), Scripted(S)
        controller = DistanceController(child, 1.0, lambda: robot.pose)
        for x in (0.0, 0.9, 1.0, 1.9, 2.0):
            robot.pose = Pose(x, 0.0, 0.0)
            controller.execute_tick()
            controller.status = Status.RUNNING
        assert child.ticks == 3

    def test_the_rate_grows_with_the_mean_speed(self):
        robot, clock, child = Robot(), Clock(), Scripted(S)
        controller = SpeedController(child, (0.5, 2.0), (0.0, 1.0), clock, lambda: robot.odometry)
        due = []
        for step in range(120):
            clock.now = 0.05 * step
            robot.odometry = Twist(1.0 if step > 60 else 0.0, 0.0)
            before = child.ticks
            controller.execute_tick()
            controller.status = Status.RUNNING
            due += [clock.now] if child.ticks > before else []
        assert np.allclose(due, [0.0, 0.5, 2.5, 4.5, 5.0, 5.5])


class TestConditions:
    def test_a_goal_is_new_once(self):
        assert ticks(GlobalUpdatedGoal(), 3) == [S, F, F]

    def test_time_and_distance_count_from_the_last_success(self):
        robot, clock = Robot(), Clock()
        timer, odometer = time_expired(1.0, clock), distance_traveled(1.0, lambda: robot.pose)
        found = []
        for step in (0.0, 0.5, 1.0, 1.5, 2.0):
            clock.now, robot.pose = step, Pose(0.0, step, 0.0)
            found.append((timer.execute_tick(), odometer.execute_tick()))
        assert found == [(F, F), (F, F), (S, S), (F, F), (S, S)]

    def test_a_new_path_does_not_expire(self):
        clock, newer = Clock(), STRAIGHT[1:]
        paths = [STRAIGHT, STRAIGHT, newer, newer]
        timer = PathExpiringTimer(1.0, lambda: paths[0], clock)
        found = []
        for now, path in zip((0.0, 0.9, 1.0, 2.0), list(paths), strict=True):
            clock.now, paths[0] = now, path
            found.append(timer.execute_tick())
        assert found == [F, F, F, S]

    def test_a_reactive_sequence_asks_again(self):
        answers = iter([True, True, False])
        child = Scripted(R)
        assert ticks(Reactive(Condition(lambda: next(answers)), child), 3) == [R, R, F]
        assert child.halts == 1

    def test_since_jazzy_a_running_child_halts_those_after_it(self):
        for halts_later, halts in ((False, 0), (True, 1)):
            later = Scripted(R, R)
            assert ticks(Reactive(Scripted(S, R), later, halts_later=halts_later), 2) == [R, R]
            assert later.halts == halts

    def test_a_sequence_with_memory_goes_on_with_the_child_that_failed(self):
        first, second = Scripted(S), Scripted(F, S)
        assert ticks(SequenceWithMemory(first, second), 2) == [F, S]
        assert first.ticks == 1
        assert ticks(Sequence(Scripted(S), Scripted(F, S)), 2) == [F, S]


def straight(length: float, poses: int, yaw: float = 0.0) -> np.ndarray:
    """A path along x that ends at 5 m."""
    path = np.column_stack([np.linspace(5.0 - length, 5.0, poses), np.zeros(poses), np.zeros(poses)])
    path[-1, 2] = yaw
    return path


class TestPathLongerOnApproach:
    def ticks(self, *paths: np.ndarray, child: Node) -> list[Status]:
        """Tick with one path after the other."""
        newest: list[np.ndarray] = []
        node = PathLongerOnApproach(child, lambda: newest[-1], 3.0, 2.0)
        return [node.execute_tick() for path in paths if not newest.append(path)]

    @pytest.mark.parametrize(
        ("old", "new", "ticked"),
        [
            (straight(2.9, 30), straight(5.9, 60), 1),
            (straight(2.9, 30), straight(5.7, 60), 0),
            (straight(3.1, 30), straight(9.0, 90), 0),
            (straight(2.9, 30), straight(9.0, 30), 0),
            (straight(2.9, 30), straight(9.0, 90, yaw=1.0), 0),
            (np.empty((0, 3)), straight(9.0, 90), 0),
            (straight(2.9, 30), np.empty((0, 3)), 0),
        ],
    )
    def test_the_child_is_ticked_at_a_long_path_to_the_same_goal_after_a_short_one(self, old, new, ticked):
        child = Scripted(F)
        assert self.ticks(old, old, new, child=child) == [S, S, F if ticked else S]
        assert child.ticks == ticked

    def test_a_running_child_is_ticked_until_it_ends_and_once_for_each_long_path(self):
        child, short, long = Scripted(R, R, S, F), straight(1.0, 10), straight(4.0, 40)
        assert self.ticks(short, long, long, long, long, short, long, child=child) == [S, R, R, S, S, S, F]
        assert child.ticks == 4

    def test_a_path_that_is_short_again_leaves_the_child_alone(self):
        child, short, long = Scripted(R), straight(1.0, 10), straight(4.0, 40)
        assert self.ticks(short, long, straight(0.9, 9), long, child=child) == [S, R, S, R]
        assert (child.starts, child.halts) == (1, 0)

    def test_a_halt_halts_the_child_and_keeps_the_path_before(self):
        child, paths = Scripted(R), [straight(1.0, 10)]
        node = PathLongerOnApproach(child, lambda: paths[-1], 3.0, 2.0)
        node.execute_tick()
        paths.append(straight(4.0, 40))
        node.execute_tick()
        node.stop()
        assert child.halts == 1
        assert node.execute_tick() is R


class TestTruncatePath:
    def cut(self, path: np.ndarray, distance: float) -> np.ndarray:
        written: list[np.ndarray] = []
        node = TruncatePath(lambda: path, written.append, distance)
        assert ticks(node, 2) == [S, S]
        assert written[0] is written[1]
        return written[0]

    @pytest.mark.parametrize(("distance", "poses"), [(1.0, 18), (0.9, 18), (0.0, 20), (100.0, 2)])
    def test_poses_near_the_end_are_left_out(self, distance, poses):
        assert len(self.cut(STRAIGHT, distance)) == poses

    def test_the_last_pose_looks_at_the_end(self):
        path = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0, 2.0, 0.0]])
        assert self.cut(path, 1.5)[-1].tolist() == [1.0, 0.0, np.pi / 2]
        assert path[1, 2] == 0.0

    def test_no_path_stays_none(self):
        assert len(self.cut(np.empty((0, 3)), 1.0)) == 0


class TestPathNodes:
    def test_a_path_is_cut_around_the_nearest_pose(self):
        robot, cuts = Robot(), []
        node = TruncatePathLocal(lambda: STRAIGHT, cuts.append, 1.0, 0.5, NearestPose(robot, np.inf))
        for x in (3.1, 3.2, 3.4):
            robot.pose = Pose(x, 0.1, 0.0)
            node.execute_tick()
        assert cuts[0] is cuts[1]
        assert [cut[:, 0].tolist() for cut in cuts[1:]] == [[2.5, 3.0, 3.5, 4.0], [3.0, 3.5, 4.0, 4.5]]

    def test_headings_count_where_a_path_comes_back(self):
        there_and_back = np.vstack([STRAIGHT, STRAIGHT[::-1] + np.array([0.0, 0.01, np.pi])])
        robot = Robot()
        robot.pose = Pose(3.0, 0.0, np.pi)
        assert NearestPose(robot, np.inf).on(there_and_back) == 6
        assert NearestPose(robot, np.inf, 1.0).on(there_and_back) == 33

    def test_the_nearest_pose_is_not_sought_far_ahead(self):
        robot = Robot()
        nearest = NearestPose(robot, 1.0)
        assert nearest.on(STRAIGHT) == 0
        robot.pose = Pose(9.0, 0.0, 0.0)
        assert nearest.on(STRAIGHT) == 2

    @pytest.mark.parametrize(("x", "found"), [(0.0, F), (8.4, F), (8.8, S)])
    def test_the_goal_is_near_where_little_of_the_path_is_left(self, x, found):
        robot = Robot()
        robot.pose = Pose(x, 0.0, 0.0)
        assert IsGoalNearby(lambda: STRAIGHT, 1.0, NearestPose(robot, np.inf)).execute_tick() is found
