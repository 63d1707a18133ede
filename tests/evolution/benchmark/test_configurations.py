"""Comparison of parameter sets: sides, verdict, sweeps, directory and the command."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from evolution import compare, configuration_of, load
from evolution.benchmark import (
    ParameterComparison,
    differences_in_words,
    parameter_rows,
    read_sweep,
    sweep,
    table_of_compared,
    table_of_scores,
    verdict_of_comparison,
)
from evolution.cli import main
from gym_mapbench.costmap import FilterMask, KeepoutFilter, SpeedFilter
from gym_mapbench.errors import ConfigError
from tests.controllers.trees import default_xml
from tests.evolution import fake_runs

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"
HALL, PARAMS = str(EXAMPLES / "hall.yaml"), str(EXAMPLES / "nav2_params.yaml")


def run(label, name, outcome, time, controller="rpp", repeat=0):
    fixed = {"path_length_m": 5.0, "n_recoveries": 0}
    row = {"configuration": label, "map": name, "controller": controller, "repeat": repeat, "outcome": outcome}
    return {**row, "time_s": time, **fixed}


def by_hand(swept=False):
    names = [f"m{number}" for number in range(8)]
    a = [run("a", name, "timeout" if name < "m6" else "goal", 10.0) for name in names]
    b = [run("b", name, "goal", 5.0) for name in names]
    return ParameterComparison((*a, *b), ({"key": "x.y", "a": "1", "b": ""},), swept)


def test_the_verdict_by_hand():
    headline, success, time, maps, why, keys = verdict_of_comparison(by_hand())
    assert headline == "b is better than a: b reaches the goal more often."
    assert success == (
        "b reaches the goal in 8 of 8 runs, a in 2 of 8. b is better on 6 of 8 maps, a on 0 (p = 0.031)."
    )
    assert time.startswith(
        "In the 2 pairs of runs in which both reach the goal, b takes 0.500 times as long as a (p = "
    )
    assert maps.startswith("The largest differences are on m0 (a 0/1, b 1/1 in 5.0 s);")
    assert why == (
        "No difference of times can be shown: Wilcoxon's test needs at least 6 maps where both reach the goal and has "
        "at most 2."
    )
    assert keys == "The configurations differ in 1 key: x.y."


def test_only_the_first_of_many_keys_that_differ_have_lines():
    rows = [{"key": f"x.{number}", "a": "1", "b": ""} for number in range(22)]
    assert differences_in_words(rows[:20]) == [f"x.{number}: a 1, b -" for number in range(20)]
    assert differences_in_words(rows)[19:] == ["x.19: a 1, b -", "2 more keys differ; the page of --html FILE has all."]


def test_a_side_with_the_worse_ranks_and_the_better_mean_is_not_called_faster():
    """``b`` is slower on 18 of 20 maps, by a hundredth, and far faster on two."""
    times = {f"m{number}": 1.0 if number < 2 else 10.1 for number in range(20)}
    rows = [run("a", name, "goal", 10.0) for name in times] + [run("b", name, "goal", s) for name, s in times.items()]
    found = ParameterComparison(tuple(rows), ())
    assert found.pairs[0]["time_ratio"] < 1.0
    assert found.pairs[0]["p_time_holm"] < 0.05
    assert verdict_of_comparison(found)[0] == "b against a: no difference is shown, neither in success nor in time."
    swept = verdict_of_comparison(replace(found, against_first=True))
    assert "No value is shown to differ from a." in swept


def test_tasks_on_one_map_are_not_maps():
    """Six tasks of one map are six tasks; tests say so, and for which maps they hold."""
    rows = tuple({**row, "walls": "hall"} for row in by_hand().rows)
    headline, success, *_, few, why, _ = verdict_of_comparison(ParameterComparison(rows, ()))
    assert headline == "b is better than a on this map: b reaches the goal more often."
    assert "b is better on 6 of 8 tasks, a on 0" in success
    assert few == "Intervals and tests count tasks and are about this map only, as there are fewer than five maps."
    assert "needs at least 6 tasks where both reach the goal and has at most 2." in why


def test_equal_sides_are_not_told_apart():
    a = by_hand().rows[8:]
    same = ParameterComparison((*a, *({**row, "configuration": "c"} for row in a)), ())
    headline, *_, keys = verdict_of_comparison(same)
    assert headline == "c against b: no difference is shown, neither in success nor in time."
    assert keys == "The configurations differ in no key that MapBench reads."


def test_one_pair_of_runs_is_singular():
    rows = tuple(run(label, "m", "goal", 5.0) for label in "ab")
    _, success, time, *_ = verdict_of_comparison(ParameterComparison(rows, ()))
    assert success.startswith("b reaches the goal in 1 of 1 run, a in 1 of 1. b is better on 0 of 1 pair of runs, a on")
    assert time.startswith("In the one pair of runs in which both reach the goal, b takes 1.000 times as long as a")


def test_a_map_on_which_only_the_controllers_differ_shows_no_difference():
    """RPP is slower than DWB on m0 with both files; the files differ on m1 alone."""
    times = {"m0": {"dwb": 5.0, "rpp": 50.0}, "m1": {"dwb": 5.0, "rpp": 6.0}}
    rows = [
        run(label, name, "goal", time, kind)
        for label in "ab"
        for name, of in times.items()
        for kind, time in of.items()
    ]
    rows[-1]["time_s"] = 7.0
    found = ParameterComparison(tuple(rows), ())
    assert [row["map"] for row in found.table("maps")] == ["m1", "m0"]
    (maps,) = (text for text in verdict_of_comparison(found) if "largest differences" in text)
    assert maps.startswith("The largest differences are on m1 (a.dwb 1/1 in 5.0 s, ")
    assert "m0" not in maps


def test_asked_metrics_are_in_the_tables():
    """The mean of the runs at the goal, or of all runs for a metric that is weighted by success."""
    rows = [
        {**row, "jerk": number, "barn_score": 0.25 + 1e-4 * (number % 2)} for number, row in enumerate(by_hand().rows)
    ]
    found = replace(by_hand(), rows=tuple(rows), metrics=("jerk", "barn_score"))
    *_, jerk, barn = table_of_scores(found.table(), found.metrics)
    assert (jerk["over all maps"], jerk["a"]) == ("jerk", "6.5")
    assert jerk["b"].startswith("11.5 (")
    assert barn["a"].startswith("0.25 (")
    assert [row["jerk"].split()[0] for row in table_of_compared(found)] == ["6.5", "11.5"]


def test_several_controllers_are_compared_by_name():
    rows = tuple(run(label, "m", "goal", 5.0, name) for label in "ab" for name in ("dwb", "rpp"))
    found = ParameterComparison(rows, ())
    assert list(found.sides) == ["a.dwb", "a.rpp", "b.dwb", "b.rpp"]
    assert [(row["first"], row["second"]) for row in found.pairs] == [("a.dwb", "b.dwb"), ("a.rpp", "b.rpp")]


def test_p_values_are_corrected_over_all_pairs():
    third = tuple({**row, "configuration": "c"} for row in by_hand().rows[:8])
    found = ParameterComparison((*by_hand().rows, *third), ())
    assert len(found.pairs) == 3
    assert found.pairs[0]["p_success_holm"] == pytest.approx(3 * found.pairs[0]["p_success"])
    assert len(replace(found, against_first=True).pairs) == 2


def test_keys_that_differ():
    own = configuration_of("own", "thesis", ["rpp"])
    (point,) = sweep(own.plan, [read_sweep("rpp.lookahead_dist=0.9")])[1:]
    assert parameter_rows([own, point]) == (
        {"key": "controller_server.rpp.lookahead_dist", "own": "0.6", "lookahead_dist=0.9": "0.9"},
    )


def test_values_are_written_as_in_a_parameter_file():
    own = configuration_of("own", "thesis", ["rpp"])
    navigation = own.plan.settings.navigation
    bare = navigation.replace(local_costmap=navigation.local_costmap.replace(plugins=("static_layer", "voxel_layer")))
    settings = own.plan.settings.replace(navigation=bare)
    rows = parameter_rows([own, replace(own, label="b", plan=replace(own.plan, settings=settings))])
    values = {row["key"]: (row["own"], row["b"]) for row in rows}
    assert values["local_costmap.plugins"][1] == "[static_layer, voxel_layer]"
    assert values["local_costmap.inflation_layer.enabled"] == ("true", "")


def with_tree(label, **tree):
    made = configuration_of(label, "thesis", ["rpp"])
    navigation = made.plan.settings.navigation
    settings = made.plan.settings.replace(navigation=navigation.replace(bt=navigation.bt.replace(**tree)))
    return replace(made, plan=replace(made.plan, settings=settings))


def test_trees_and_their_numbers_are_among_the_keys_that_differ():
    own, often = with_tree("own", xml=default_xml()), with_tree("often", replanning_frequency=2.0)
    usual = configuration_of("usual", "thesis", ["rpp"])
    assert parameter_rows([usual, often]) == ({"key": "bt_navigator.replanning_frequency", "usual": "1", "often": "2"},)
    (row,) = parameter_rows([usual, own])
    assert row["key"] == "bt_navigator.default_nav_to_pose_bt_xml"
    assert (row["usual"], row["own"][:17]) == ("Nav2's default tree", "a tree of its own")
    slow = with_tree("slow", xml=default_xml(), latency="nav2")
    assert parameter_rows([own, slow]) == ({"key": "bt_navigator.latency", "own": "ideal", "slow": "nav2"},)


def with_names(label, **names):
    """The parameters of the thesis, in which the controllers have other names."""
    made = configuration_of(label, "thesis", ["dwb", "rpp"])
    navigation = made.plan.settings.navigation
    plugins = {names.get(name, name): plugin for name, plugin in navigation.controllers.items()}
    settings = made.plan.settings.replace(navigation=navigation.replace(controllers=plugins))
    return replace(made, plan=replace(made.plan, settings=settings))


def test_controllers_of_one_kind_are_compared_whatever_their_names():
    first, second = with_names("a", dwb="FollowPath"), with_names("b", dwb="Dwa", rpp="Pursuit")
    assert parameter_rows([first, second]) == ()
    (faster,) = sweep(second.plan, [read_sweep("rpp.lookahead_dist=0.9")])[1:]
    assert parameter_rows([first, faster]) == (
        {"key": "controller_server.rpp.lookahead_dist", "a": "0.6", "lookahead_dist=0.9": "0.9"},
    )
    assert parameter_rows([first, with_names("b", rpp="FollowPath", dwb="rpp")]) == ()


def test_a_name_that_another_controller_has_is_not_given_twice():
    first, second = configuration_of("a", "thesis", ["dwb"]), with_names("b", dwb="Dwa", rpp="dwb")
    keys = [row["key"] for row in parameter_rows([first, second])]
    assert any(key.startswith("controller_server.Dwa.") for key in keys)


def test_costmap_filters_differ_in_their_masks_and_numbers():
    """Without the topics and files that only connect the nodes, and whose names are not those of the user's file."""
    own = configuration_of("own", "jazzy", ["rpp"])

    def with_filters(label, **filters):
        navigation = own.plan.settings.navigation
        costmap = navigation.global_costmap.replace(**filters)
        settings = own.plan.settings.replace(navigation=navigation.replace(global_costmap=costmap))
        return replace(own, label=label, plan=replace(own.plan, settings=settings))

    def keys(*configurations):
        return [row["key"].removeprefix("global_costmap.") for row in parameter_rows(configurations)]

    mask, other = (FilterMask.from_values(np.full((2, 3), value, np.int8), 0.5) for value in (0, 100))
    a, b = (
        with_filters(name, keepout_filters={"no": KeepoutFilter(mask=m)}) for name, m in (("a", mask), ("b", other))
    )
    assert keys(a, b) == ["no.mask"]
    assert keys(a, a) == []
    of_keepout = ["plugin", "enabled", "override_lethal_cost", "lethal_override_cost", "mask"]
    assert keys(own, a) == ["filters", *(f"no.{key}" for key in of_keepout)]
    slow, slower = (
        with_filters(name, speed_filters={"slow": SpeedFilter(mask=mask, base=base)})
        for name, base in (("slow", 100.0), ("slower", 50.0))
    )
    assert keys(slow, slower) == ["slow.base"]


def test_a_grid_and_its_own_values():
    plan = configuration_of("own", "thesis", ["rpp"]).plan
    two = [
        read_sweep("rpp.lookahead_dist=0.6,0.9"),
        read_sweep("local_costmap.inflation_layer.inflation_radius=0.3,0.4"),
    ]
    found = sweep(plan, two)
    assert len(found) == 5
    assert found[0].plan == plan
    assert found[3].label == "lookahead_dist=0.9,inflation_radius=0.3"
    assert found[3].plan.settings.navigation.local_costmap.inflation_layer.inflation_radius == 0.3
    assert len(sweep(plan, [read_sweep("rpp.lookahead_dist=0.6")])) == 1


def test_sobol_points_are_in_range_and_repeat():
    plan = configuration_of("own", "thesis", ["mppi"], seed=4).plan
    two = [read_sweep("mppi.temperature=0.1,0.5"), read_sweep("mppi.time_steps=20,40")]
    found = [one.values for one in sweep(plan, two, 5)[1:]]
    assert found == [one.values for one in sweep(plan, two, 5)[1:]]
    assert len(found) == 5
    assert all(0.1 <= one["mppi.temperature"] <= 0.5 for one in found)
    assert all(one["mppi.time_steps"] in range(20, 41) for one in found)


@pytest.mark.parametrize(
    ("text", "samples", "message"),
    [
        ("rpp.lookahed_dist=1", None, "did you mean 'lookahead_dist'"),
        ("rp.lookahead_dist=1", None, "did you mean 'rpp'"),
        ("rpp.lookahead_dist", None, "expected CONTROLLER.PARAMETER=VALUE"),
        ("rpp.lookahead_dist=a", None, "expected CONTROLLER.PARAMETER=VALUE"),
        ("rpp.allow_reversing=1", None, "expected a parameter that is a number"),
        ("rpp.lookahead_dist=1", 4, "expected the lowest and the highest value"),
        ("dwb.Twirling.scale=1,2", None, "expected a critic that the controller lists, got Twirling"),
    ],
)
def test_bad_sweeps(text, samples, message):
    plan = configuration_of("own", "thesis", ["rpp", "dwb"]).plan
    with pytest.raises(ConfigError, match=message):
        sweep(plan, [read_sweep(text)], samples)


def test_a_label_is_no_controller_of_another_label():
    two = [configuration_of("robot", "thesis", ["dwb", "rpp"]), configuration_of("robot.rpp", "fair", ["rpp"])]
    with pytest.raises(ConfigError, match=r"'robot\.rpp', a controller of another file"):
        compare(HALL, two, workers=1)


def test_a_sweep_changes_one_controller_and_each_parameter_once():
    plan = configuration_of("own", "thesis", ["a=rpp", "b=rpp", "mppi"]).plan
    for texts, message in (
        (["mppi.temperature=0.1", "mppi.temperature=0.2"], "all values of mppi.temperature in one option"),
        (["a.lookahead_dist=0.3", "b.lookahead_dist=0.9"], "one controller with the parameters of a, got a, b"),
    ):
        with pytest.raises(ConfigError, match=message):
            sweep(plan, list(map(read_sweep, texts)))


def test_close_values_of_a_sweep_have_labels_of_their_own():
    plan = configuration_of("own", "thesis", ["rpp"]).plan
    labels = [one.label for one in sweep(plan, [read_sweep("rpp.lookahead_dist=0.30,0.3000001")])]
    assert labels == ["own", "lookahead_dist=0.3", "lookahead_dist=0.3000001"]


@pytest.fixture
def no_robot(monkeypatch):
    monkeypatch.setattr("evolution.api.benchmarks.run_job", fake_runs.drive)
    monkeypatch.setattr("evolution.runs.exclusive.preparation_of", lambda *_: bool)


def test_the_directory_is_read_back_and_continued(no_robot, tmp_path):
    two = [configuration_of(label, preset, ["rpp"], repeats=2) for label, preset in (("a", "thesis"), ("b", "fair"))]
    found = compare(HALL, two, out=tmp_path / "out", workers=1)
    again = load(tmp_path / "out")
    assert isinstance(again, ParameterComparison)
    assert again.rows == found.rows
    assert again.parameters == found.parameters
    assert verdict_of_comparison(again) == verdict_of_comparison(found)
    before = (tmp_path / "out" / "bench.json").read_bytes()
    compare(HALL, two, out=tmp_path / "out", resume=True, workers=2)
    assert (tmp_path / "out" / "bench.json").read_bytes() == before
    with pytest.raises(ConfigError, match="list of configurations was a, b when the benchmark began, got a"):
        compare(HALL, two[:1], out=tmp_path / "out", resume=True)
    assert [row["seed"] for row in found.rows[:2]] == [row["seed"] for row in found.rows[2:]]


def test_bad_labels_and_rules(tmp_path, capsys):
    for argv, message in (
        (
            ["--params", PARAMS, "--params", PARAMS],
            "--params: expected different labels, got 'nav2_params' twice; ",
        ),
        (
            ["--params", "a=thesis", "--params", "b=fair", "--fail-if", "c.success<a.success"],
            "unknown controller or label",
        ),
        (["--params", "a=thesis", "--params", "b=nothing.yaml"], "expected a file or one of the presets"),
        (["--sweep-samples", "3"], "expected the parameters to sweep"),
    ):
        assert main(["bench", HALL, *argv]) == 2
        (line,) = [one for one in capsys.readouterr().err.splitlines() if one.startswith("mapbench bench: ")]
        assert message in line


def test_the_command_compares_and_fails_by_rule(tmp_path, capsys):
    page = tmp_path / "two.html"
    argv = ["bench", HALL, "--controllers", "rpp", "--params", "a=thesis", "--params", "b=jazzy", "--time-limit", "4"]
    argv += ["--workers", "1", "--format", "json", "--html", str(page), "--fail-if", "b.success<=a.success"]
    argv += ["--metric", "n_contacts"]
    assert main(argv) == 1
    output = capsys.readouterr()
    found = json.loads(output.out)
    assert [row["configuration"] for row in found["runs"]] == ["a", "b"]
    assert "--fail-if b.success<=a.success: b 0, a 0" in output.err
    assert "Comparison of parameter sets" in page.read_text(encoding="utf-8")
    assert '<td data-label="over all maps">n_contacts</td>' in page.read_text(encoding="utf-8")


@pytest.mark.parametrize(("params", "own"), [("thesis", "own"), ("mine=thesis", "mine")])
def test_a_label_names_the_own_values_of_a_sweep(params, own, no_robot, capsys):
    argv = ["bench", HALL, "--params", params, "--sweep", "rpp.lookahead_dist=0.3", "--workers", "1"]
    assert main([*argv, "--fail-if", f"lookahead_dist=0.3.success<{own}.success", "--format", "json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert [row["configuration"] for row in found["runs"]] == [own, "lookahead_dist=0.3"]


def test_a_label_of_the_only_file_changes_nothing(no_robot, capsys):
    printed = []
    for params in (PARAMS, f"mine={PARAMS}"):
        assert main(["bench", HALL, "--params", params, "--workers", "1"]) == 0
        printed.append(capsys.readouterr().out)
    assert printed[0] == printed[1]


def test_the_verdict_does_not_deny_goals_of_runs_that_begin_there():
    rows = tuple(run(label, "m", "goal", 0.0) for label in "ab")
    text = " ".join(verdict_of_comparison(ParameterComparison(rows, ())))
    assert "b reaches the goal in 1 of 1 run, a in 1 of 1." in text
    assert "Where both a and b reach the goal, a run begins there, so times cannot be compared." in text
    assert "There is no pair" not in text


def test_the_verdict_of_a_sweep_names_the_values_that_differ():
    often, fast, shown, *_ = verdict_of_comparison(by_hand(swept=True))
    assert often == "b reaches the goal most often, in 8 of 8 runs."
    assert fast == "Where both reach the goal, b takes 0.500 times as long as a, the least of all values."
    assert shown == "b is better than a: b reaches the goal more often."


@pytest.mark.parametrize(
    ("goals", "expected"),
    [
        ("abc", "All values reach the goal equally often, in 1 of 1 run."),
        ("bc", "b and c reach the goal most often, each in 1 of 1 run."),
        ("c", "c reaches the goal most often, in 1 of 1 run."),
    ],
)
def test_the_verdict_of_a_sweep_names_all_values_with_the_most_goals(goals, expected):
    rows = tuple(run(label, "m", "goal" if label in goals else "timeout", 5.0) for label in "abc")
    often, *others = verdict_of_comparison(ParameterComparison(rows, (), against_first=True))
    assert often == expected
    assert "No value is shown to differ from a." in others
    assert "Intervals and tests count runs and are about this map only, as there are fewer than five maps." in others


def swept(times):
    """Return a comparison of the values x and y of two keys, whose run takes the time that is given."""
    rows = tuple(run(f"{x}{y}", "m", "goal", time) for (x, y), time in times.items())
    keys = (
        {"key": "x", **{f"{x}{y}": str(x) for x, y in times}},
        {"key": "y", **{f"{x}{y}": str(y) for x, y in times}},
    )
    return ParameterComparison(rows, keys, against_first=True)


@pytest.mark.parametrize(
    ("times", "idle"),
    [
        ({(1, 1): 5.0, (1, 2): 5.0, (2, 1): 5.0, (2, 2): 5.0}, "x, y"),
        ({(1, 1): 5.0, (1, 2): 6.0, (2, 1): 5.0, (2, 2): 6.0}, "x"),
        ({(1, 1): 5.0, (1, 2): 5.0, (2, 1): 6.0, (2, 2): 5.5}, None),
        ({(1, 1): 5.0, (2, 2): 5.0, (3, 3): 5.0}, "x, y"),
        ({(1, 1): 5.0, (2, 2): 5.0, (3, 3): 6.0}, None),
    ],
)
def test_a_key_that_changes_no_run_is_named(times, idle):
    said = [line for line in verdict_of_comparison(swept(times)) if line.startswith("Without effect")]
    assert [line.split(". ")[0] for line in said] == ([] if idle is None else [f"Without effect in these runs: {idle}"])


def test_nothing_is_without_effect_in_runs_that_ended_in_an_error():
    found = swept({(1, 1): 5.0, (2, 1): 5.0})
    failed = replace(found, rows=tuple({**row, "outcome": "error"} for row in found.rows))
    assert not [line for line in verdict_of_comparison(failed) if line.startswith("Without effect")]


def test_times_of_a_sweep_are_compared_where_both_reach_the_goal():
    """``b`` has the shorter mean time of all goals, because it fails on the slow map that ``c`` solves."""
    names = [f"m{number}" for number in range(6)]
    b = [run("b", name, "timeout" if name == "m5" else "goal", 5.0) for name in names]
    c = [run("c", name, "goal", 50.0 if name == "m5" else 4.0) for name in names]
    _, fast, *_ = verdict_of_comparison(ParameterComparison((*b, *c), (), against_first=True))
    assert fast == "Where both reach the goal, c takes 0.800 times as long as b, the least of all values."
    d = [{**row, "configuration": "d"} for row in c]
    _, fast, *_ = verdict_of_comparison(ParameterComparison((*b, *c, *d), (), against_first=True))
    assert fast == "Where both reach the goal, c and d each take 0.800 times as long as b, the least of all values."
    _, fast, *_ = verdict_of_comparison(ParameterComparison((*c, *b), (), against_first=True))
    assert fast == "Where both reach the goal, no value takes less time than c."


def test_the_largest_differences_are_given_for_every_side():
    rows = [run(label, "m0", "goal" if label != "d" else "timeout", 5.0) for label in "abcd"]
    (line,) = [line for line in verdict_of_comparison(ParameterComparison(tuple(rows), ())) if "largest" in line]
    assert line.endswith("m0 (a 1/1 in 5.0 s, b 1/1 in 5.0 s, c 1/1 in 5.0 s, d 0/1).")


def test_a_controller_that_only_one_file_shares_is_compared_in_either_order():
    one = tuple(run("one", "m", "goal", 5.0, name) for name in ("FollowPath", "Pursuit"))
    two = (run("two", "m", "goal", 6.0, "FollowPath"),)
    pairs = [ParameterComparison(rows, ()).pairs for rows in ((*one, *two), (*two, *one))]
    assert [[(row["first"], row["second"]) for row in found] for found in pairs] == [
        [("one.FollowPath", "two")],
        [("two", "one.FollowPath")],
    ]


def test_copies_of_a_run_show_nothing():
    """Without noise, eight repeats are one run: its difference is not shown to be more than luck."""
    rows = tuple(
        {**run(label, "m", "goal", time, repeat=repeat), "seed": repeat, "controller_ms": 0.1 * repeat}
        for label, time in (("a", 5.0), ("b", 4.0))
        for repeat in range(8)
    )
    found = ParameterComparison(rows, ())
    (pair,) = found.pairs
    assert (pair["pairs"], pair["n"], pair["both"], pair["p_time"], pair["ratio_low"]) == (1, 1, 1, 1.0, None)
    assert verdict_of_comparison(found)[0] == "b against a: no difference is shown, neither in success nor in time."
    assert any("in every measure: 14 of 16 runs" in line for line in verdict_of_comparison(found))
    varied = tuple({**row, "path_length_m": 5.0 + row["repeat"]} for row in rows)
    assert ParameterComparison(varied, ()).pairs[0]["p_time"] == pytest.approx(2 / 2**8)
