"""``mapbench validate`` on what is around the controllers: worked examples of the tree, and what it refuses."""

from __future__ import annotations

import gzip
import json

import pytest

from evolution.cli import main
from evolution.validation.around.tree import TreeReplay

ALWAYS_IMPATIENT = {"follow_rest": [350, 6, 0]}


def replay(release="humble", **script):
    return TreeReplay({"script": script}, release).run()


def times(replayed, kind, text=""):
    """Times, s, of the events of one kind."""
    return [time / 1e6 for time, *event in replayed.events if event[0] == kind and event[1].startswith(text)]


def test_replans_are_a_second_and_the_planning_time_apart():
    plans = times(replay(follow_rest=[5000, 4, 0]), "goal_sent", "compute")
    assert plans[:4] == [0.0, 1.03, 2.06, 3.09]
    slow = times(replay(planner_rest=[1500, 4, 0]), "goal_sent", "compute")
    assert slow[:3] == pytest.approx([0.0, 2.51, 5.02])


def test_a_controller_that_always_fails_is_tried_fourteen_times():
    replayed = replay(**ALWAYS_IMPATIENT)
    (run,) = replayed.runs
    assert (run.status, run.end_us, run.number_recoveries) == ("failed", 20_000_000, 15)
    assert len(times(replayed, "server_begin", "follow")) == 14
    assert times(replayed, "goal_sent", "follow")[:2] == [0.03, 0.392]
    begins = {kind: times(replayed, "goal_sent", kind) for kind in ("spin", "wait", "backup")}
    assert begins == {"spin": [1.5, 17.43], "wait": [4.06], "backup": [9.82]}


def test_a_planner_that_always_fails_is_tried_fourteen_times():
    replayed = replay(planner_rest=[20, 6, 0])
    assert replayed.runs[0].end_us == pytest.approx(15_200_000, abs=40_000)
    assert len(times(replayed, "server_begin", "compute")) == 14


@pytest.mark.parametrize(
    ("script", "least", "most"),
    [
        (["F compute_path_to_pose 20 6 0"], 21.2, 22.0),
        (["F follow_path 350 6 0", "F compute_path_to_pose 20 4 0"], 20.1, 21.1),
    ],
)
def test_waiting_for_costmaps_takes_seconds(script, least, most):
    phases = [{"global_update_phase_ms": phase, "local_update_phase_ms": phase % 200} for phase in range(9, 1000, 110)]
    ends = [TreeReplay({"script": script, **phase}, "humble").run().runs[0].end_us / 1e6 for phase in phases]
    assert (min(ends), max(ends)) == pytest.approx((least, most), abs=0.15)


def test_halting_costs_21_ms_while_the_server_does_not_notice():
    replayed = replay(planner=[[20, 4, 0], [20, 6, 0], [20, 6, 0]], follow_rest=[20000, 4, 0], limit=2000)
    cancel = times(replayed, "cancel_sent", "follow")[0]
    assert times(replayed, "service", "local")[0] == pytest.approx(cancel + 0.021)


def test_a_tree_waits_20_ms_for_a_server_and_then_fails():
    replayed = replay(lat=30, limit=30000)
    assert times(replayed, "service", "global")[0] == 0.02


@pytest.mark.parametrize(("code", "recoveries"), [(106, 15), (104, 0), (108, 0)])
def test_jazzy_recovers_only_where_that_may_help(code, recoveries):
    assert replay("jazzy", follow_rest=[350, 6, code]).runs[0].number_recoveries == recoveries


@pytest.mark.parametrize(("release", "first"), [("humble", "spin"), ("jazzy", "local_costmap")])
def test_only_jazzy_begins_each_goal_with_the_first_recovery(release, first):
    fails = [[350, 6, 106]] * 2
    replayed = replay(release, follow=[*fails, [1000, 4, 0], *fails], follow_rest=[1000, 4, 0], runs=[2, 100])
    second = replayed.runs[1].start_us
    kinds = [text for time, kind, text in sorted(replayed.events) if time > second and kind in ("service", "goal_sent")]
    after_the_second_failure = [text for text in kinds if not text.startswith(("compute", "follow"))][1]
    assert after_the_second_failure.startswith(first)


FILES = {
    "behaviors.json": {"footprints": {}, "cases": []},
    "behaviors_with_smoother_humble.json": {"start": [0, 0, 0], "footprint": "none", "cases": []},
    "smoother.json": {"cases": []},
    "tree_humble.json.gz": {"nodes": [], "scenarios": []},
}


def write(directory, **changes):
    for name, document in {**FILES, **changes}.items():
        content = json.dumps(document).encode()
        (directory / name).write_bytes(gzip.compress(content) if name.endswith(".gz") else content)
    return str(directory)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({}, "tree_humble.npz"),
        ({"tree_humble.json.gz": {"nodes": []}}, "'scenarios'"),
        ({"tree_humble.json.gz": []}, "dict"),
    ],
)
def test_what_is_missing_is_said_in_one_line(tmp_path, capsys, changes, said):
    assert main(["validate", write(tmp_path, **changes)]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert "Traceback" not in error
