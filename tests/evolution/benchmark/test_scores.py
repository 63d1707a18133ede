"""Scores over all maps and of pairs, from runs made by hand."""

from __future__ import annotations

import pytest

from evolution.benchmark import Benchmark, ParameterComparison, pair_rows, score_rows
from evolution.statistics import share_difference_interval, wilson_interval


def runs(controller, times, outcome="goal", **measures):
    return [
        {"map": f"map_{number}", "controller": controller, "repeat": 0, "outcome": outcome, "time_s": time, **measures}
        for number, time in enumerate(times)
    ]


def test_one_map_gives_intervals_over_its_runs_and_few_runs_none():
    rows = [{**row, "map": "only", "repeat": number} for number, row in enumerate(runs("a", [1.0, 2.0, 3.0, 4.0, 5.0]))]
    (score,) = score_rows(rows, ("a",))
    assert 1.0 < score["mean s from"] < 3.0 < score["mean s to"] < 5.0
    (few,) = score_rows(rows[:4], ("a",))
    assert few["mean s from"] is None
    (none,) = score_rows(runs("a", [1.0], "timeout"), ("a",))
    assert (none["success"], none["mean s"]) == (0.0, None)


def test_shares_are_of_all_runs_and_measures_of_those_at_the_goal():
    rows = runs("a", [10.0, 20.0, 30.0], min_clearance=0.1, spl=0.8)
    rows += [{**row, "map": "other"} for row in runs("a", [99.0], "collision", min_clearance=0.0, spl=0.0)]
    (score,) = score_rows(rows, ("a",))
    assert (score["goals"], score["runs"], score["success"], score["collision"], score["timeout"]) == (
        3,
        4,
        0.75,
        0.25,
        0,
    )
    assert (score["success from"], score["success to"]) == wilson_interval(3, 4)
    assert (score["mean s"], score["clearance m"], score["spl"]) == (20.0, pytest.approx(0.1), pytest.approx(0.6))
    assert score["length m"] is None


def test_spl_is_at_most_the_success_also_with_errors():
    """A run that ended in an error has no measures, but it is a failure; its recoveries are unknown."""
    rows = runs("a", [10.0] * 3, spl=1.0, n_recoveries=1.0) + runs("a", [0.0], "error")
    (score,) = score_rows(rows, ("a",))
    assert (score["success"], score["spl"], score["recoveries"]) == (0.75, 0.75, 1.0)


def test_counts_and_weighted_metrics_are_of_every_run_in_all_tables():
    """A collision ends a run, so no run at the goal counts one."""
    rows = runs("a", [10.0] * 3, path_length_m=5.0, n_contacts=0.0, barn_score=0.4, jerk=1.0)
    rows += [{**row, "map": "map_0"} for row in runs("a", [3.0], "collision", n_contacts=1.0, barn_score=0.0, jerk=9.0)]
    names = ("n_contacts", "barn_score", "jerk")
    (score,) = score_rows(rows, ("a",), names)
    assert [score[name] for name in names] == [0.25, pytest.approx(0.3), 1.0]
    result = Benchmark(tuple(rows), names)
    assert result.table("controllers")[0] == score
    summary = result.table()[0]
    assert [summary[name] for name in names] == [0.5, pytest.approx(0.2), 1.0]


def test_pairs_are_runs_on_the_same_map_and_noise():
    rows = (
        runs("a", [10.0] * 6)
        + runs("b", [8.0, 7.0, 9.0, 8.0, 8.0])
        + [{**runs("b", [5.0], "timeout")[0], "map": "map_5"}]
    )
    (pair,) = pair_rows(rows, ("a", "b"))
    assert (pair["first"], pair["second"], pair["pairs"], pair["both"]) == ("a", "b", 6, 5)
    assert pair["gained"] == pytest.approx(-1 / 6)
    assert pair["gained from"] < pair["gained"] < 0.0 < pair["gained to"]  # one run of six shows nothing
    assert pair["faster s"] == pytest.approx(2.0)
    assert 1.0 <= pair["faster s from"] < 2.0 < pair["faster s to"] <= 3.0
    assert pair_rows(rows, ("a",)) == []


def test_a_benchmark_has_both_tables():
    result = Benchmark(tuple(runs("a", [1.0, 2.0]) + runs("b", [2.0, 4.0])))
    assert [row["mean s"] for row in result.table("controllers")] == [1.5, 3.0]
    assert [row["faster s"] for row in result.table("pairs")] == [-1.5]


def test_equal_values_have_no_interval():
    """An interval from 5 to 5 would say that the mean is known exactly."""
    (score,) = score_rows(runs("a", [5.0] * 6, n_recoveries=0), ("a",))
    assert (score["mean s"], score["mean s from"], score["recoveries"], score["recoveries to"]) == (5.0, None, 0, None)
    (pair,) = pair_rows(runs("a", [5.0] * 6) + runs("b", [4.0] * 6), ("a", "b"))
    assert (pair["faster s"], pair["faster s from"]) == (1.0, None)
    times = [19.05, 20.05, 8.15, 7.7, 12.35]
    (pair,) = pair_rows(runs("a", times) + runs("b", [time - 0.1 for time in times]), ("a", "b"))
    assert (pair["faster s"], pair["faster s from"]) == (pytest.approx(0.1), None)
    rows = [{**row, "configuration": row["controller"]} for row in runs("a", [5.0] * 6) + runs("b", [5.0] * 6)]
    (compared,) = ParameterComparison(tuple(rows), ()).pairs
    assert (compared["time_ratio"], compared["ratio_low"], compared["p_time"]) == (1.0, None, 1.0)


def test_p_values_of_times_are_corrected_over_all_pairs_of_controllers():
    times = [10.0, 12.0, 11.0, 13.0, 14.0, 15.0]
    rows = runs("a", times) + runs("b", [time + 1.0 + time / 100 for time in times])
    (pair,) = pair_rows(rows, ("a", "b"))
    assert pair["p_time_holm"] == pytest.approx(2 / 2**6)
    rows += runs("c", [time - 1.0 - time / 100 for time in times])
    assert [row["p_time_holm"] for row in pair_rows(rows, ("a", "b", "c"))] == pytest.approx([6 / 2**6] * 3)


def test_copies_of_a_run_count_once_in_intervals():
    rows = [{**row, "repeat": repeat, "seed": repeat} for row in runs("a", [5.0, 6.0]) for repeat in range(4)]
    (score,) = score_rows(rows, ("a",))
    assert (score["goals"], score["runs"], score["mean s"], score["mean s from"]) == (8, 8, 5.5, None)
    assert (score["success from"], score["success to"]) == wilson_interval(2, 2)
    both = rows + [{**row, "controller": "b", "time_s": 4.0} for row in rows]
    (pair,) = pair_rows(both, ("a", "b"))
    assert (pair["pairs"], pair["both"], pair["faster s"], pair["faster s from"]) == (8, 8, 1.5, None)
    assert (pair["gained from"], pair["gained to"]) == share_difference_interval([[1], [1]], [[1], [1]])


def test_a_mean_lies_in_its_interval_where_some_maps_have_more_runs_at_the_goal_than_others():
    """The map with most goals takes longest: in the mean it counts by its runs, and so it does in the interval."""
    times = {"m0": [30.0 + number for number in range(10)], **{f"m{number}": [10.0 + number] for number in range(1, 8)}}
    of_maps = [(name, number, row) for name, some in times.items() for number, row in enumerate(runs("a", some))]
    rows = [{**row, "map": name, "repeat": number} for name, number, row in of_maps]
    (score,) = score_rows(rows, ("a",))
    assert score["mean s from"] < score["mean s"] < score["mean s to"]
    (pair,) = pair_rows(rows + [{**row, "controller": "b", "time_s": 12.0} for row in rows], ("a", "b"))
    assert pair["faster s from"] < pair["faster s"] < pair["faster s to"]


def test_few_maps_at_the_goal_of_many_are_still_the_units():
    """Runs on the two maps at the goal depend on each other, however many runs there are."""
    rows = [row for name in range(6) for row in _runs_on(f"m{name}", "goal" if name < 2 else "timeout")]
    (score,) = score_rows(rows, ("a",))
    assert (score["goals"], score["mean s from"]) == (10, None)


def _runs_on(name, outcome):
    rows = runs("a", [5.0, 6.0, 7.0, 8.0, 9.0], outcome)
    return [{**row, "map": name, "repeat": repeat} for repeat, row in enumerate(rows)]


def test_tasks_with_the_same_walls_count_as_one_map():
    """On one of five maps all six tasks fail: the interval is that of five maps, not of thirty."""
    rows = [
        {**runs("a", [5.0], "timeout" if number == 0 else "goal")[0], "map": f"m{number}_{task}", "walls": f"m{number}"}
        for number in range(5)
        for task in range(6)
    ]
    (score,) = score_rows(rows, ("a",))
    assert (score["success from"], score["success to"]) == pytest.approx(wilson_interval(4, 5))
    (apart,) = score_rows([{**row, "walls": row["map"]} for row in rows], ("a",))
    assert (apart["success from"], apart["success to"]) == pytest.approx(wilson_interval(24, 30))


def test_a_mean_and_its_interval_weigh_maps_alike_where_some_have_copies():
    """On a map without noise all repeats are copies, on a map with people they are not; each map still counts alike."""
    first, second = (
        [
            {**row, "map": f"map_{number}", "repeat": repeat}
            for number in range(7)
            for repeat in range(10)
            for row in runs(name, [20.0 if name == "a" else 14.0 + repeat if number == 6 else 22.0 + number])
        ]
        for name in "ab"
    )
    (pair,) = pair_rows(first + second, ("a", "b"))
    assert pair["faster s from"] < pair["faster s"] < pair["faster s to"]
    alike = [row for row in first + second if row["repeat"] in (4, 5)]
    (few,) = pair_rows(alike, ("a", "b"))
    assert few["faster s"] == pytest.approx(pair["faster s"])
    assert few["faster s from"] == pytest.approx(pair["faster s from"])
    assert few["faster s to"] == pytest.approx(pair["faster s to"])
