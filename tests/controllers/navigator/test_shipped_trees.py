"""The trees for NavigateToPose that Nav2 brings: each drives, or is refused with the reason."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from controllers.navigator import navigator as navigator_module
from controllers.navigator.navigator import Navigator
from controllers.tree_xml.reading import read_tree
from gym_mapbench.errors import ConfigError
from gym_mapbench.releases import RELEASES
from gym_mapbench.world.scenario import Pose
from tests.controllers.navigator.test_tree_builder import replans, run_of
from tests.controllers.plain_follower import Drive, PlainFollower, context, plain_navigation
from tests.controllers.trees import FOLLOW, PLAN, default_xml, xml_of

CLEAR_LOCAL, CLEAR_GLOBAL = (
    f'<ClearEntireCostmap service_name="{of}_costmap/clear_entirely_{of}_costmap"/>' for of in ("local", "global")
)
IF_INVALID = (
    "<Fallback><ReactiveSequence>{asks}<Inverter><GlobalUpdatedGoal/></Inverter>"
    f'<IsPathValid path="{{{{path}}}}"/></ReactiveSequence>{PLAN.replace("{", "{{").replace("}", "}}")}</Fallback>'
)
EXPIRED = '<Inverter><PathExpiringTimer seconds="10" path="{path}"/></Inverter>'
RECOVERIES = (
    f"<ReactiveFallback><GoalUpdated/><RoundRobin><Sequence>{CLEAR_LOCAL}{CLEAR_GLOBAL}</Sequence>"
    '<Spin spin_dist="1.57"/><Wait wait_duration="5"/><BackUp backup_dist="0.30" backup_speed="0.05"/>'
    "</RoundRobin></ReactiveFallback>"
)


def pipeline(plan: str, follow: str = FOLLOW) -> str:
    return f"<PipelineSequence>{plan}{follow}</PipelineSequence>"


def recovering(plan: str, hz: str, follow: str = "{}") -> str:
    """Return a tree with clears in its contexts and the usual recoveries."""
    retried = f'<RecoveryNode number_of_retries="1">{plan}{CLEAR_GLOBAL}</RecoveryNode>'
    followed = follow.format(f'<RecoveryNode number_of_retries="1">{FOLLOW}{CLEAR_LOCAL}</RecoveryNode>')
    inside = pipeline(f'<RateController hz="{hz}">{retried}</RateController>', followed)
    return f'<RecoveryNode number_of_retries="6">{inside}{RECOVERIES}</RecoveryNode>'


def goal_patience(release: str) -> str:
    retry = "RetryUntilSuccesful" if release == "humble" else "RetryUntilSuccessful"
    sequence = "SequenceStar" if release == "humble" else "SequenceWithMemory"
    waits = f'<{sequence}><CancelControl/><Wait wait_duration="5"/></{sequence}>'
    patient = (
        '<PathLongerOnApproach path="{{path}}" prox_len="3.0" length_factor="2.0">'
        f'<{retry} num_attempts="1">{waits}</{retry}></PathLongerOnApproach>'
    )
    return recovering(PLAN, "1.0", f"<ReactiveSequence>{patient}{{}}</ReactiveSequence>")


def shipped(name: str, release: str) -> str:
    """Return a tree with the structure and the numbers of the one of this name."""
    inside = {
        "navigate_w_replanning_time": lambda: pipeline(f'<RateController hz="1.0">{PLAN}</RateController>'),
        "navigate_w_replanning_distance": lambda: pipeline(
            f'<DistanceController distance="1.0">{PLAN}</DistanceController>'
        ),
        "navigate_w_replanning_speed": lambda: pipeline(
            f'<SpeedController min_rate="0.1" max_rate="1.0" min_speed="0.0" max_speed="0.26">{PLAN}</SpeedController>'
        ),
        "navigate_w_replanning_only_if_goal_is_updated": lambda: pipeline(
            f"<GoalUpdatedController>{PLAN}</GoalUpdatedController>"
        ),
        "navigate_w_replanning_only_if_path_becomes_invalid": lambda: pipeline(
            f'<RateController hz="1.0">{IF_INVALID.format(asks="")}</RateController>'
        ),
        "navigate_w_recovery_and_replanning_only_if_path_becomes_invalid": lambda: recovering(
            IF_INVALID.format(asks=""), "1.0"
        ),
        "nav_to_pose_with_consistent_replanning_and_if_path_becomes_invalid": lambda: recovering(
            IF_INVALID.format(asks=EXPIRED), "2.0"
        ),
        "navigate_to_pose_w_replanning_goal_patience_and_recovery": lambda: goal_patience(release),
    }[name]()
    return xml_of(inside)


PLANS = {
    "navigate_w_replanning_time": {12, 13, 14},
    "navigate_w_replanning_distance": {5},
    "navigate_w_replanning_speed": {12, 13, 14},
    "navigate_w_replanning_only_if_goal_is_updated": {1},
    "navigate_w_replanning_only_if_path_becomes_invalid": {1},
    "navigate_w_recovery_and_replanning_only_if_path_becomes_invalid": {1},
    "nav_to_pose_with_consistent_replanning_and_if_path_becomes_invalid": {1, 2},
    "navigate_to_pose_w_replanning_goal_patience_and_recovery": {17, 18, 19},
}


@pytest.mark.parametrize("release", RELEASES)
@pytest.mark.parametrize("name", list(PLANS))
def test_the_robot_reaches_the_goal_and_plans_as_often_as_the_tree_says(name, release):
    navigator = run_of(shipped(name, release), release, latency="nav2")
    assert navigator.status == "succeeded"
    assert len(replans(navigator)) in PLANS[name]
    # Within the tolerance of the goal plans are centimetres long, so the patient tree may wait there, as Nav2's does.
    assert navigator.number_recoveries == ("patience" in name)


@pytest.mark.parametrize("release", RELEASES)
def test_the_default_tree_reaches_the_goal(release):
    assert run_of(default_xml(release), release).status == "succeeded"


@pytest.mark.parametrize("release", RELEASES)
def test_follow_point_stands_a_metre_before_the_goal_and_goes_on_following(release):
    plan = PLAN.replace("{goal}", "{updated_goal}")
    updated = f'<GoalUpdater input_goal="{{goal}}" output_goal="{{updated_goal}}">{plan}</GoalUpdater>'
    cut = '<TruncatePath distance="1.0" input_path="{path}" output_path="{truncated_path}"/>'
    follow = FOLLOW.replace("{path}", "{truncated_path}")
    inside = pipeline(
        f'<RateController hz="1.0"><Sequence>{updated}{cut}</Sequence></RateController>',
        f"<KeepRunningUntilFailure>{follow}</KeepRunningUntilFailure>",
    )
    navigator = run_of(xml_of(inside), release, steps=600)
    end, goal = navigator.path[-1], Pose(4.5, 2.4, 0.0)
    assert navigator.status == "running"
    assert 0.95 < np.hypot(end[0] - goal.x, end[1] - goal.y) < 1.1
    assert len(replans(navigator)) >= 25


@pytest.mark.parametrize(
    ("inside", "why"),
    [
        (
            pipeline(
                f'<RateController hz="0.5"><Sequence><ComputeRoute goal="{{goal}}"/>{PLAN}</Sequence></RateController>'
            ),
            "ComputeRoute: there is no route server here",
        ),
        (
            '<Sequence><DriveOnHeading dist_to_travel="0.2" speed="0.02" time_allowance="100"/><Spin/></Sequence>',
            "expected a node FollowPath, got none: nothing drives the robot to the goal",
        ),
    ],
)
def test_trees_along_routes_and_the_calibration_of_odometry_are_refused(inside, why):
    with pytest.raises(ConfigError, match=why):
        read_tree(xml_of(inside), "lyrical")


class Detours:
    """A planner whose plans numbered in ``long`` go far round."""

    def __init__(self, long: set[int]) -> None:
        self.long, self.count = long, 0

    def plan(self, costmap, start: Pose, goal: Pose) -> np.ndarray:
        self.count += 1
        middle = [(start.x, 2.9), (1.0, 2.9)] if self.count in self.long else []
        corners = np.array([start[:2], *middle, goal[:2]])
        points = [np.linspace(a, b, 40) for a, b in itertools.pairwise(corners)]
        poses = np.column_stack([np.vstack(points), np.zeros(40 * len(points))])
        poses[-1, 2] = goal.yaw
        return poses


def patient_run(monkeypatch, release: str, long: set[int], latency: str = "nav2") -> tuple[Navigator, Drive]:
    monkeypatch.setattr(navigator_module, "make_planner", lambda *args, **params: Detours(long))
    params = plain_navigation(recoveries=True, release=release)
    navigator = Navigator(
        PlainFollower(),
        params.replace(bt=params.bt.replace(xml=xml_of(goal_patience(release)), latency=latency)),
        "plain",
    )
    start, goal = Pose(0.5, 1.0, 0.0), Pose(4.5, 1.0, 0.0)
    navigator.reset(context(start=start, goal=goal))
    return navigator, Drive(navigator, start).run(900)


class TestGoalPatience:
    @pytest.mark.parametrize("latency", ["ideal", "nav2"])
    @pytest.mark.parametrize("release", RELEASES)
    def test_the_robot_waits_5_s_where_a_new_plan_near_the_goal_is_long(self, monkeypatch, release, latency):
        navigator, drive = patient_run(monkeypatch, release, {6, 7, 8, 9, 10, 11}, latency)
        (wait,) = [event.time for event in navigator.events if event.kind == "wait"]
        stood = [n * 0.05 for n, command in enumerate(drive.commands) if command == (0.0, 0.0)]
        assert navigator.status == "succeeded"
        assert replans(navigator)[5] <= wait < replans(navigator)[5] + 0.06
        assert 4.9 <= sum(wait <= time < wait + 6.0 for time in stood) * 0.05 <= 5.4

    @pytest.mark.parametrize("release", RELEASES)
    def test_it_goes_on_at_once_when_the_next_plan_is_short_again(self, monkeypatch, release):
        navigator, drive = patient_run(monkeypatch, release, {6})
        (wait,) = [event.time for event in navigator.events if event.kind == "wait"]
        stood = [n * 0.05 for n, command in enumerate(drive.commands) if command == (0.0, 0.0)]
        assert navigator.status == "succeeded"
        assert 0.8 <= sum(wait <= time < wait + 6.0 for time in stood) * 0.05 <= 1.3

    @pytest.mark.parametrize("long", [{2, 3}, set()])
    def test_far_from_the_goal_it_does_not_wait(self, monkeypatch, long):
        navigator, _ = patient_run(monkeypatch, "jazzy", long)
        assert (navigator.status, navigator.number_recoveries) == ("succeeded", 0)
