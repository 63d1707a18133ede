from __future__ import annotations

import numpy as np
import pytest

from controllers.base import ControllerError, Twist
from controllers.navigator.behavior_tree import Condition, Node, Sequence, SequenceWithMemory, Status
from controllers.navigator.behavior_tree import ReactiveSequence as Reactive
from controllers.navigator.conditions import GlobalUpdatedGoal, PathExpiringTimer, distance_traveled, time_expired
from controllers.navigator.decorators import Again, DistanceController, Returning, SingleTrigger, SpeedController
from controllers.navigator.navigator import Navigator
from controllers.navigator.path_keeper import NearestPose
from controllers.navigator.path_nodes import IsGoalNearby, TruncatePathLocal
from controllers.navigator.rate import Clock
from controllers.navigator.tree_builder import MAKERS
from controllers.navigator.tree_loop import TreeLoop
from controllers.releases import RELEASES
from controllers.tree_xml import NODES
from gym_mapbench.world.scenario import Pose
from tests.controllers.navigator.test_behavior_tree import F, R, S, Scripted
from tests.controllers.plain_follower import OPEN, Drive, PlainFollower, context, plain_navigation, walled_off
from tests.controllers.trees import FOLLOW, PLAN, default_xml, xml_of

START, GOAL = Pose(0.5, 0.5, 0.5), Pose(4.5, 2.4, 0.0)
STRAIGHT = np.column_stack([np.arange(0.0, 10.0, 0.5), np.zeros(20), np.zeros(20)])


class Robot:
    """A robot that is where it is put, and drives as fast as it is told."""

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


class TestPathNodes:
    def test_a_path_is_cut_around_the_nearest_pose(self):
        robot, cuts = Robot(), []
        node = TruncatePathLocal(lambda: STRAIGHT, cuts.append, 1.0, 0.5, NearestPose(robot, np.inf))
        for x in (3.1, 3.2, 3.4):
            robot.pose = Pose(x, 0.1, 0.0)
            node.execute_tick()
        assert [cut[:, 0].tolist() for cut in cuts] == [[2.5, 3.0, 3.5, 4.0], [3.0, 3.5, 4.0, 4.5]]

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
