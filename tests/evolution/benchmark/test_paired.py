"""Paired statistics: tests by hand, the units, and what swapping the sides does."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from evolution.benchmark.paired import Place, compare_pairs, groups_of, mcnemar, unit_of, wilcoxon

RUNS = st.lists(
    st.tuples(st.integers(0, 7), st.booleans(), st.booleans(), st.floats(1.0, 60.0), st.floats(1.0, 60.0)),
    min_size=1,
    max_size=30,
)


def rows(*runs):
    """Runs of a side: task, success and time of each. The walls are its name to the underscore."""
    return [
        {"map": name, "walls": name.split("_")[0], "outcome": "goal" if success else "timeout", "time_s": time}
        for name, success, time in runs
    ]


def compare(first, second):
    return compare_pairs(list(zip(first, second, strict=True)))


def sides(runs):
    first = rows(*((f"m{number}", a, x) for number, a, _, x, _ in runs))
    return first, rows(*((f"m{number}", b, y) for number, _, b, _, y in runs))


def test_six_maps_by_hand():
    first = rows(*((f"m{number}", False, math.nan) for number in range(6)), ("m6", True, 10.0))
    second = rows(*((f"m{number}", True, 5.0) for number in range(7)))
    found = compare(first, second)
    assert (found.n, found.wins, found.losses, found.both) == (7, 6, 0, 1)
    assert found.p_success == pytest.approx(2 * 0.5**6)
    assert found.time_ratio == pytest.approx(0.5)
    assert math.isnan(found.ratio_low)
    assert found.p_time == 1.0


def test_a_run_that_begins_at_the_goal_has_no_ratio():
    first = rows(("m0", True, 0.0), ("m1", True, 10.0))
    found = compare(first, rows(("m0", True, 0.0), ("m1", True, 5.0)))
    assert (found.both, found.time_ratio) == (2, pytest.approx(0.5))
    assert math.isnan(compare(first[:1], first[:1]).time_ratio)


def test_runs_on_one_map_of_many_count_once():
    """Five lost runs on one of six maps are one lost map."""
    names = [f"m{number}" for number in range(6) for _ in range(5)]
    first = rows(*((name, True, 10.0) for name in names))
    second = rows(*((name, name != "m0", 10.0) for name in names))
    found = compare(first, second)
    assert (found.pairs, found.n, found.wins, found.losses, found.p_success) == (30, 6, 0, 1, 1.0)


def test_units_are_maps_of_five_else_tasks_of_five_else_runs():
    maps, tasks = [Place(name, name) for name in "aabcde"], [Place(name, "hall") for name in "aabcde"]
    assert [unit_of(places) for places in (maps, tasks, maps[:5])] == ["map", "task", "run"]
    assert unit_of([Place(f"{name}_{number}", name) for name in "abcde" for number in range(3)]) == "map"
    values = [(Place("a", "hall"), 1.0), (Place("a", "hall"), 3.0), (Place("b", "hall"), 5.0)]
    assert [groups_of(values, unit) for unit in ("map", "task", "run")] == [
        [[1.0, 3.0, 5.0]],
        [[1.0, 3.0], [5.0]],
        [[1.0], [3.0], [5.0]],
    ]


def test_tasks_on_one_map_of_many_count_once():
    """A side that loses all eight tasks on one of five maps loses one map, whatever the names of the tasks."""
    tasks = [f"m{number}_{task}" for number in range(5) for task in range(8)]
    first = rows(*((name, True, 10.0) for name in tasks))
    second = rows(*((name, not name.startswith("m0"), 10.0) for name in tasks))
    found = compare(first, second)
    assert (found.pairs, found.n, found.wins, found.losses, found.p_success) == (40, 5, 0, 1, 1.0)


def test_the_units_of_the_times_are_those_of_the_success():
    """Both sides reach the goal on two of six maps: these are two units, not twenty."""
    names = [f"m{number}" for number in range(6) for _ in range(10)]
    first = rows(*((name, True, 10.0) for name in names))
    second = rows(*((name, name < "m2", 11.0) for name in names))
    found = compare(first, second)
    assert (found.n, found.both, found.p_time) == (6, 20, 0.5)
    assert math.isnan(found.ratio_low)


def test_mcnemar_and_wilcoxon_are_those_of_scipy():
    assert mcnemar(2, 9) == pytest.approx(stats.binomtest(2, 11).pvalue)
    assert mcnemar(0, 0) == 1.0
    assert wilcoxon([0.1, 0.3, -0.2, 0.5, 0.6]) == pytest.approx(stats.wilcoxon([0.1, 0.3, -0.2, 0.5, 0.6]).pvalue)
    assert wilcoxon([0.0, 0.0]) == 1.0
    assert math.isnan(wilcoxon([]))


def test_maps_with_equal_times_leave_wilcoxons_test_exact():
    """Five faster of any number of maps, the others equal: 2 of the 2 ** 5 signs are as far apart."""
    faster = [0.1, 0.2, 0.3, 0.4, 0.5]
    assert [wilcoxon([*faster, *[0.0] * equal]) for equal in (0, 3, 9, 60)] == [2 / 2**5] * 4


def test_times_that_differ_alike_are_ties():
    """A step of the clock is 0.05 s, so many differences are equal, but floats of them differ in the last digits."""
    steps, gains = [210, 399, 187, 333, 250, 402, 281, 517], [1, 1, -1, 2, 2, -2, 4, 5]
    differences = [0.05 * (step + gain) - 0.05 * step for step, gain in zip(steps, gains, strict=True)]
    assert len({*map(abs, differences)}) > 5
    assert wilcoxon(differences) == wilcoxon([*map(float, gains)])
    assert wilcoxon([0.1 + 0.2 - 0.3, 0.0]) == 1.0


@settings(max_examples=40, deadline=None)
@given(RUNS)
def test_swapped_sides_give_the_inverse_ratio(runs):
    first, second = sides(runs)
    one, other = compare(first, second), compare(second, first)
    assert (one.n, one.wins, one.losses, one.both) == (other.n, other.losses, other.wins, other.both)
    assert one.p_success == pytest.approx(other.p_success)
    assert one.time_ratio == pytest.approx(1 / other.time_ratio, nan_ok=True)
    assert one.p_time == pytest.approx(other.p_time, nan_ok=True)


@settings(max_examples=20, deadline=None)
@given(RUNS)
def test_the_interval_holds_the_ratio_and_repeats(runs):
    found = compare(*sides(runs))
    again = compare(*sides(runs))
    assert repr(found) == repr(again)
    if not math.isnan(found.ratio_low):
        assert found.ratio_low <= found.ratio_high
        assert found.ratio_low > 1 / 61
        assert found.ratio_high < 61
