"""The summary of a map by hand: medians, the difference, failed runs and outliers."""

from __future__ import annotations

import pytest

from evolution.runs import summary_of_map, typical_repeat


def runs(*times, failed=0):
    return [{"outcome": "goal", "time_s": time} for time in times] + failed * [{"outcome": "timeout", "time_s": 150.0}]


@pytest.mark.parametrize(
    ("of_map", "difference"),
    [
        ({"dwb": runs(20.0), "mppi": runs(22.0)}, "all alike (within 10 %)"),
        ({"dwb": runs(20.0), "mppi": runs(22.1), "rpp": runs(20.0)}, "mppi takes 1.1 times as long as dwb"),
        ({"mppi": runs(34.0, 30.0, 35.0), "dwb": runs(19.0, 90.0, 20.0)}, "mppi takes 1.7 times as long as dwb"),
        ({"dwb": runs(20.0, 24.0)}, "dwb 22.0 s"),
        ({"dwb": runs(failed=1)}, "dwb never reaches the goal"),
        ({"dwb": runs(20.0), "rpp": runs(failed=2)}, "rpp never reaches the goal"),
        ({"dwb": runs(failed=1), "rpp": runs(failed=1)}, "dwb, rpp never reach the goal"),
        ({"dwb": runs(0.0), "rpp": runs(0.0)}, "all alike (within 10 %)"),
    ],
)
def test_the_difference_is_the_ratio_of_the_medians(of_map, difference):
    assert summary_of_map("map_1", of_map).difference == difference


def test_a_sentence_names_sample_failures_and_outliers():
    dwb, rpp = runs(20.0, 22.0, 30.0, 33.1, 65.0), runs(30.0, 31.0, 50.0, 60.0, failed=1)
    assert summary_of_map("map_2", {"dwb": dwb, "rpp": rpp}).in_words == (
        "map_2: rpp takes 1.4 times as long as dwb. Medians of 5 runs: dwb 30.0 s (1 outlier: 65.0 s), "
        "rpp 40.5 s (1 of 5 failed)."
    )
    many = summary_of_map("a", {"dwb": runs(20.0, 21.0, 22.0, 60.0, 50.0)}).controllers[0]
    assert many.in_words == "dwb 22.0 s (2 outliers up to 60.0 s)"
    assert summary_of_map("a", {"dwb": runs(20.0)}).sample == "1 run"
    single = {"dwb": runs(20.0, 22.0, failed=1)}
    assert summary_of_map("a", single).in_words == "a, medians of 3 runs: dwb 21.0 s (1 of 3 failed)."
    three = {"dwb": runs(20.0), "mppi": runs(40.0, 41.0, 42.0), "rpp": runs(21.0, 22.0)}
    assert summary_of_map("a", three).sample == "medians of 1 to 3 runs"
    assert typical_repeat({"runs": three}) == 0
    assert typical_repeat({"runs": {"dwb": runs(20.0, 26.0, 21.0, 20.5), "rpp": runs(30.0, 31.0, 30.5)}}) == 2
    assert summary_of_map("a", {"dwb": runs(failed=2)}).controllers[0].in_words == "dwb no time (2 of 2 failed)"


def test_the_sample_of_a_title_counts_the_runs_at_the_goal():
    some = {"dwb": runs(20.0, 21.0, failed=3), "rpp": runs(20.0), "mppi": runs(failed=5)}
    assert summary_of_map("a", some).sample_at_goal == "medians of 1 to 5 runs (at the goal: 2 of dwb)"
    assert summary_of_map("a", {"dwb": runs(20.0, 21.0)}).sample_at_goal == "medians of 2 runs"
