"""Rules of ``--fail-if`` on runs made by hand."""

from __future__ import annotations

import pytest

from evolution.benchmark import broken, read_rule, runs_by_controller
from gym_mapbench.errors import ConfigError
from gym_mapbench.metrics import METRICS

NAMES = ("dwb", "my.mppi")


def run(controller, outcome, time_s, recoveries):
    contacts = None if outcome == "error" else float(outcome == "collision")
    measures = {
        "n_recoveries": recoveries,
        "n_contacts": contacts,
        "spl": None if outcome == "error" else float(outcome == "goal"),
    }
    return {"map": "a", "controller": controller, "outcome": outcome, "time_s": time_s, **measures}


ROWS = [
    run("dwb", "goal", 10.0, 0),
    run("dwb", "goal", 20.0, 1),
    run("dwb", "collision", 3.0, 0),
    run("dwb", "goal", 30.0, 2),
    run("my.mppi", "timeout", 150.0, 4),
    run("my.mppi", "error", 0.0, None),
]


@pytest.mark.parametrize(
    ("rule", "line"),
    [
        ("success<0.95", "success<0.95: dwb 0.75, my.mppi 0"),
        ("success < 0.75", "success < 0.75: my.mppi 0"),
        ("dwb.success<=0.75", "dwb.success<=0.75: dwb 0.75"),
        ("dwb.time>19", "dwb.time>19: dwb 20"),
        ("dwb.time>20", None),
        ("time>1e9", "time>1e9: my.mppi has no value"),  # who never arrives is not on time
        ("collisions>0", "collisions>0: dwb 1"),
        ("my.mppi.timeouts!=0", "my.mppi.timeouts!=0: my.mppi 1"),
        ("my.mppi.recoveries==4", "my.mppi.recoveries==4: my.mppi 4"),  # an error counts no recoveries
        ("dwb.n_recoveries>0.5", "dwb.n_recoveries>0.5: dwb 0.75"),  # a metric
        ("dwb.n_contacts>0", "dwb.n_contacts>0: dwb 0.25"),  # a collision ends a run, and counts
        ("spl<0.8", "spl<0.8: dwb 0.75, my.mppi 0"),  # a failure counts 0
        ("errors>1", None),
        ("my.mppi.success<dwb.success", "my.mppi.success<dwb.success: my.mppi 0, dwb 0.75"),
        ("dwb.success < my.mppi.success", None),
        ("dwb.time>my.mppi.time", "dwb.time>my.mppi.time: my.mppi.time has no value"),
    ],
)
def test_worked_examples(rule, line):
    assert broken([read_rule(rule, NAMES)], runs_by_controller(ROWS, NAMES)) == ([] if line is None else [line])


@pytest.mark.parametrize("measure", ["success", "spl"])
def test_an_error_counts_in_spl_as_in_success(measure):
    rows = [run("dwb", "goal", 10.0, 0), *[run("dwb", "error", 0.0, None)] * 3]
    assert broken([read_rule(f"{measure}<0.5", ["dwb"])], {"dwb": rows}) == [f"{measure}<0.5: dwb 0.25"]


def test_a_refused_measure_is_answered_with_each_measure_once():
    with pytest.raises(ConfigError) as refused:
        read_rule("sucess<1", NAMES, ["path_length"])
    assert str(refused.value).count(" path_length") == 1


def test_labels_may_hold_spaces():
    rule = read_rule(" my params.success < the old.success ", ("my params", "the old"))
    assert (rule.owners, rule.measure, rule.sign) == (("my params",), "success", "<")
    assert rule.limit == ("the old", "success")


@pytest.mark.parametrize(
    ("rule", "reason"),
    [
        ("success", "expected a rule like success<0.95"),
        ("success<much", "expected a rule like"),
        ("sucess<1", "did you mean 'success'"),
        ("dwbb.success<1", "unknown controller or label 'dwbb'; did you mean 'dwb'"),
        ("dwb.sucess<1", "did you mean 'success'"),
        ("success<1<2", "expected a rule like"),
        ("mine:speed<1", "unknown measure"),
        ("dwb.success<mpi.success", "unknown controller or label 'mpi'"),
        ("dwb.success<__import__", "expected a rule like"),
        ("success<nan", "expected a rule like"),
    ],
)
def test_bad_rules(rule, reason):
    with pytest.raises(ConfigError, match=reason):
        read_rule(rule, NAMES)


def test_every_metric_can_be_judged():
    """The driven length has another name in the rows than among the metrics."""
    row = {"outcome": "goal", "time_s": 9.0, "path_length_m": 4.0, **dict.fromkeys(METRICS.built_in, 4.0)}
    del row["path_length"]
    for name in METRICS.built_in:
        assert read_rule(f"{name}>3", ["dwb"]).broken_by({"dwb": [row]}) == [f"{name}>3: dwb 4"]


@pytest.mark.parametrize("sign", ["<", "<=", "==", "!=", ">", ">="])
def test_labels_of_a_sweep_hold_an_equals_sign(sign):
    names = ("own", "lookahead_dist=0.3", "lookahead_dist=0.3,max_angular_accel=3")
    rule = read_rule(f"{names[1]}.time{sign}20", names)
    assert (rule.owners, rule.measure, rule.sign, rule.limit) == ((names[1],), "time", sign, 20.0)
    rule = read_rule(f"{names[2]}.time{sign}{names[1]}.time", names)
    assert (rule.owners, rule.measure, rule.sign, rule.limit) == ((names[2],), "time", sign, (names[1], "time"))


def test_a_metric_that_is_asked_for_can_be_judged():
    rule = read_rule("dwb.mine:speed<1", NAMES, ["mine:speed"])
    assert rule.broken_by({"dwb": [{**ROWS[0], "mine:speed": 0.5}]}) == ["dwb.mine:speed<1: dwb 0.5"]
