"""SmoothPath: the leaf of a tree and the server that smooths paths."""

from __future__ import annotations

import re

import numpy as np
import pytest

from controllers.nav2_params.plugin_settings import SmootherPlugin
from controllers.navigator import error_codes
from controllers.navigator.actions import Outcome, Result
from controllers.navigator.navigator import Navigator
from controllers.navigator.smoother_server import SmootherServer, SmoothGoal
from gym_mapbench.costmap import Costmap
from gym_mapbench.errors import ConfigError, SmoothingError
from gym_mapbench.releases import RELEASES
from gym_mapbench.smoothers import Smoothed, make_smoother
from gym_mapbench.world.footprint import Footprint
from tests.controllers.navigator.test_tree_builder import GOAL, START, Remembering
from tests.controllers.plain_follower import OPEN, Drive, context, plain_navigation
from tests.controllers.trees import FOLLOW, PLAN, xml_of

SMOOTH = '<SmoothPath unsmoothed_path="{path}" smoothed_path="{path}"/>'
FREE = Costmap(np.zeros((100, 100), np.uint8), 0.1, 0.0, 0.0)
BLOCKED = Costmap(np.full((100, 100), 254, np.uint8), 0.1, 0.0, 0.0)
DISC = Footprint.from_radius(0.2)
BEND = np.column_stack([np.r_[np.linspace(2, 4, 20), np.full(20, 4.0)], np.r_[np.full(20, 2.0), np.linspace(2, 4, 20)]])
PATH = np.column_stack([BEND, np.zeros(len(BEND))])


def served(goal: SmoothGoal, costmap=FREE, smoothers=("simple",), seconds=0.0, release="jazzy") -> Outcome:
    made = {name: make_smoother(name) if isinstance(name, str) else name for name in smoothers}
    server = SmootherServer(made, lambda: costmap, DISC, seconds, release)
    server.begin(goal, 0.0)
    assert server.step(0.0) is None
    assert server.next_time == seconds
    return server.step(seconds)


def run_of(tree: str, release: str = "humble", latency: str = "ideal", steps: int = 3000, **params) -> Navigator:
    params = plain_navigation(recoveries=True, release=release).replace(**params)
    navigator = Navigator(
        Remembering(), params.replace(bt=params.bt.replace(xml=xml_of(tree), latency=latency)), "plain"
    )
    navigator.reset(context(OPEN, START, GOAL))
    Drive(navigator, START).run(steps)
    return navigator


def test_a_path_is_smoothed_on_the_costmap_after_some_time():
    outcome = served(SmoothGoal(PATH), seconds=0.005)
    assert outcome.result is Result.SUCCEEDED
    path, was_completed = outcome.value
    assert was_completed
    assert (path == make_smoother("simple", release="humble").smooth(FREE, PATH).path).all()


@pytest.mark.parametrize(
    ("goal", "options", "code", "why"),
    [
        (SmoothGoal(PATH, "mine"), {}, error_codes.INVALID_SMOOTHER, r"one of the smoothers \['simple'\], got 'mine'"),
        (SmoothGoal(PATH), {"smoothers": ("simple", "savitzky_golay")}, error_codes.INVALID_SMOOTHER, "got ''"),
        (SmoothGoal(()), {}, error_codes.INVALID_SMOOTHED_PATH, "expected a path of one pose or more"),
        (SmoothGoal(PATH), {"costmap": None}, error_codes.SMOOTHER_UNKNOWN, "there is no costmap yet"),
        (SmoothGoal(PATH, "", 0.0), {}, error_codes.SMOOTHER_TIMED_OUT, "more than the allowed 0 s"),
        (SmoothGoal(PATH, "", 0.004), {"seconds": 0.005}, error_codes.SMOOTHER_TIMED_OUT, "takes 0.005 s"),
        (
            SmoothGoal(PATH, check_for_collisions=True),
            {"costmap": BLOCKED},
            error_codes.SMOOTHED_PATH_IN_COLLISION,
            r"the smoothed path collides at \(2.000, 2.000, ",
        ),
    ],
)
def test_the_server_aborts_with_the_code_of_the_failure(goal, options, code, why):
    outcome = served(goal, **options)
    assert (outcome.result, outcome.code) == (Result.ABORTED, code)
    assert re.search(why, outcome.reason)


def test_the_server_looks_for_collisions_only_if_it_is_told_to():
    assert served(SmoothGoal(PATH), BLOCKED).result is Result.SUCCEEDED
    assert served(SmoothGoal(PATH, check_for_collisions=True)).result is Result.SUCCEEDED


def test_a_smoothing_that_takes_too_long_leaves_humbles_path_as_it_was():
    outcome = served(SmoothGoal(PATH, "", 0.001), seconds=0.005, release="humble")
    assert outcome.result is Result.SUCCEEDED
    assert outcome.value == Smoothed(PATH, was_completed=False)


class Refusing:
    """A smoother that fails."""

    def smooth(self, costmap, path):
        raise SmoothingError("no curve fits")


def test_a_smoother_that_fails_says_why():
    outcome = served(SmoothGoal(PATH), smoothers=(Refusing(),))
    assert (outcome.code, outcome.reason) == (error_codes.FAILED_TO_SMOOTH_PATH, "no curve fits")


class TestTrees:
    @pytest.mark.parametrize("release", RELEASES)
    @pytest.mark.parametrize("latency", ["ideal", "nav2"])
    def test_the_robot_follows_the_smoothed_path(self, release, latency):
        rate = f'<RateController hz="1.0"><Sequence>{PLAN}{SMOOTH}</Sequence></RateController>'
        navigator = run_of(f"<PipelineSequence>{rate}{FOLLOW}</PipelineSequence>", release, latency)
        assert navigator.status == "succeeded"
        followed = navigator.follower.paths
        plans = sum(event.kind == "replan" for event in navigator.events)
        assert len(followed) == plans if latency == "ideal" else len(followed) >= plans
        plain = run_of(f"<Sequence>{PLAN}{FOLLOW}</Sequence>", release, steps=2)
        assert (plain.follower.paths[0][1:-1, 2] == 0.0).all()
        assert followed[0][1:-1, 2].all()

    def test_the_default_is_the_simple_smoother_of_the_release(self):
        plain = plain_navigation(recoveries=True, release="jazzy")
        assert plain.used_smoothers == {}
        smoothing = plain.replace(bt=plain.bt.replace(xml=xml_of(f"<Sequence>{PLAN}{SMOOTH}{FOLLOW}</Sequence>")))
        assert smoothing.used_smoothers == {"simple_smoother": SmootherPlugin(params={"release": "jazzy"})}
        assert "smoothers" not in smoothing.model_dump(mode="json")

    def test_leaves_name_their_smoothers_themselves_or_by_a_selector(self):
        named = SMOOTH.replace("/>", ' smoother_id="golay"/>')
        selected = SMOOTH.replace("/>", ' smoother_id="{which}"/>')
        selector = '<SmootherSelector selected_smoother="{which}" default_smoother="plain"/>'
        smoothers = {"golay": {"kind": "savitzky_golay"}, "plain": {}}
        tree = f"<Sequence>{PLAN}{selector}{named}{selected}{FOLLOW}</Sequence>"
        assert run_of(tree, "jazzy", smoothers=smoothers, steps=3).status == "running"
        failed = run_of(tree, "jazzy", smoothers={"golay": {}, "other": {}})
        assert (failed.status, failed.failure_kind) == ("failed", "planner_failure")
        assert failed.failure_reason == "SmoothPath: expected one of the smoothers ['golay', 'other'], got 'plain'"
        assert [event.kind for event in failed.events][-2:] == ["smoothing_failure", "planner_failure"]

    @pytest.mark.parametrize(("duration", "helps"), [("0.0", True), ("3.0", False)])
    def test_a_recovery_may_help_the_smoother(self, duration, helps):
        ports = f'max_smoothing_duration="{duration}" was_completed="{{done}}" error_code_id="{{smoother_code}}"'
        smooth = SMOOTH.replace("/>", f" {ports}/>")
        helped = '<WouldASmootherRecoveryHelp error_code="{smoother_code}"/>'
        fails = f"<Sequence>{PLAN}{smooth}<AlwaysFailure/></Sequence>"
        tree = f"<RecoveryNode>{fails}<Sequence>{helped}<Wait/></Sequence></RecoveryNode>"
        navigator = run_of(f"<Sequence>{tree}{FOLLOW}</Sequence>", "jazzy", steps=5)
        assert any(event.kind == "wait" for event in navigator.events) == helps

    def test_a_failed_smoothing_keeps_the_old_path(self):
        smooth = SMOOTH.replace("/>", ' smoother_id="none"/>')
        navigator = run_of(f"<Sequence>{PLAN}<ForceSuccess>{smooth}</ForceSuccess>{FOLLOW}</Sequence>", steps=20)
        assert len(navigator.follower.paths) == 1

    @pytest.mark.parametrize(
        ("before", "ports"),
        [
            ("", 'unsmoothed_path="{path}" smoothed_path="{out}"'),
            ("", 'unsmoothed_path="{path}" smoothed_path="{path}" smoother_id="still"'),
            (
                '<TruncatePath input_path="{path}" output_path="{out}" distance="0.5"/>',
                'unsmoothed_path="{out}" smoothed_path="{out}"',
            ),
            (
                '<TruncatePathLocal input_path="{path}" output_path="{out}" distance_backward="8"/>',
                'unsmoothed_path="{out}" smoothed_path="{out}"',
            ),
        ],
    )
    def test_a_path_that_is_smoothed_in_every_tick_is_new_only_where_it_has_changed(self, before, ports):
        smooth = f"<SmoothPath {ports}/>" if "_id" in ports else f'<SmoothPath {ports} smoother_id="simple"/>'
        follow = FOLLOW if "{out}" not in ports else FOLLOW.replace("{path}", "{out}")
        rate = f'<RateController hz="1.0">{PLAN}</RateController>'
        tree = f"<PipelineSequence>{rate}{before}{smooth}{follow}</PipelineSequence>"
        smoothers = {"simple": {}, "still": {"params": {"max_its": 1}}}
        navigator = run_of(tree, smoothers=smoothers, steps=60)
        assert navigator.status == "running"
        assert len(navigator.follower.paths) == sum(event.kind == "replan" for event in navigator.events) == 3

    def test_smoothers_are_of_the_release_of_the_rest(self):
        params = plain_navigation(release="lyrical").replace(smoothers={"a": {"params": {"max_its": 50}}})
        assert params.smoothers["a"].params["refinement_num"] == 2
        with pytest.raises(ConfigError, match=r"smoothers\.a: expected parameters of Nav2's lyrical, got humble's"):
            params.replace(smoothers={"a": {"params": {"release": "humble"}}})
        with pytest.raises(ConfigError, match=r"smoothers\.a\.kind: unknown smoother 'simpel'"):
            params.replace(smoothers={"a": {"kind": "simpel"}})
