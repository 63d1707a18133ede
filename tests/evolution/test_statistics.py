"""Statistics against hand-worked values and their own definitions."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
import scipy
from hypothesis import given
from hypothesis import strategies as st

from evolution import statistics
from evolution.statistics import (
    bootstrap_interval,
    cliffs_delta,
    critical_difference,
    friedman,
    holm,
    kruskal_wallis,
    median_interval,
    pairwise_mann_whitney,
    rank_correlation,
    share_difference_interval,
    share_interval,
    summarize,
    vargha_delaney_a12,
    wilson_interval,
)
from gym_mapbench.errors import ConfigError

SAMPLES = st.lists(st.floats(-100, 100, allow_nan=False), min_size=1, max_size=12)


def test_holm_by_hand():
    # Sorted 0.01, 0.03, 0.04 times 3, 2, 1 = 0.03, 0.06, 0.04; the running maximum makes the last 0.06.
    assert holm([0.04, 0.01, 0.03]) == pytest.approx([0.06, 0.03, 0.06])


def test_a12_by_hand():
    # Of the four pairs (1,2) (1,3) (3,2) (3,3): one larger, one tie.
    assert vargha_delaney_a12([1, 3], [2, 3]) == pytest.approx(1.5 / 4)


@given(SAMPLES, SAMPLES)
def test_a12_counts_pairs(first, second):
    counted = sum((a > b) + 0.5 * (a == b) for a in first for b in second) / (len(first) * len(second))
    assert vargha_delaney_a12(first, second) == pytest.approx(counted)
    assert cliffs_delta(first, second) == pytest.approx(-cliffs_delta(second, first))


def test_kruskal_wallis_by_hand():
    # Ranks 1,2 | 3,4 | 5,6: H = 12/(6*7) * (9/2 + 49/2 + 121/2) - 3*7 = 4.5714.
    result = kruskal_wallis({"a": [1, 2], "b": [3, 4], "c": [5, 6]})
    assert result.statistic == pytest.approx(4.571428, abs=1e-5)
    assert result.effect == pytest.approx(4.571428 / 5, abs=1e-5)
    assert "n = 2, 2, 2" in str(result)


def test_equal_groups_do_not_differ():
    assert kruskal_wallis({"a": [1, 1], "b": [1, 1]}).p_value == 1.0


def test_pairs_are_corrected_and_sized():
    results = pairwise_mann_whitney({"a": list(range(10)), "b": list(range(100, 110)), "c": list(range(10))})
    by_pair = {result.groups: result for result in results}
    assert by_pair["a", "b"].p_value < 0.01
    assert by_pair["a", "b"].effect == 1.0  # the smaller is better
    assert by_pair["a", "c"].p_value == 1.0


def test_the_family_of_a_correction_is_what_was_tested():
    groups = {"a": list(range(10)), "b": list(range(5, 15)), "c": list(range(20, 30))}
    (alone,) = pairwise_mann_whitney(groups, [("a", "b")])
    of_all = next(result for result in pairwise_mann_whitney(groups) if result.groups == ("a", "b"))
    assert alone.effect == of_all.effect
    assert alone.p_value <= of_all.p_value
    assert pairwise_mann_whitney({"a": [1.0], "b": [2.0]}, []) == []


def test_friedman_and_critical_difference():
    table = np.array([[1.0, 2.0, 3.0]] * 10)
    assert friedman(table, ["a", "b", "c"]).effect == pytest.approx(1.0)
    ranks, difference = critical_difference(table)
    assert ranks == pytest.approx([1, 2, 3])
    # Demsar 2006, table 5: q(0.05, 3 methods) = 2.343.
    assert difference == pytest.approx(2.343 * np.sqrt(3 * 4 / 60), rel=1e-3)


def test_bootstrap_interval_covers_and_repeats():
    values = np.random.default_rng(0).normal(5, 1, 50)
    low, high = bootstrap_interval(values, np.random.default_rng(1))
    assert low < values.mean() < high
    assert (low, high) == bootstrap_interval(values, np.random.default_rng(1))


def test_a_bootstrap_interval_of_five_values_holds_the_mean():
    """Of normal samples the plain percentile interval holds it in 85 %."""
    rng = np.random.default_rng(0)
    held = [low < 0 < high for low, high in (bootstrap_interval(rng.normal(size=5), rng) for _ in range(400))]
    assert np.mean(held) > 0.91
    with pytest.raises(ConfigError, match="two values, got 1"):
        bootstrap_interval([1.0], rng)


def test_a_share_of_single_trials_has_wilsons_interval():
    assert share_interval(0.75, [[1], [1], [0], [1]]) == wilson_interval(3, 4)
    assert share_interval(0.0, []) == (0.0, 1.0)


def test_groups_whose_trials_are_alike_count_once():
    """Ten runs on each of ten maps, two of which fail whatever the seed, tell as much as one run on each."""
    groups = [[float(number > 1)] * 10 for number in range(10)]
    assert share_interval(0.8, groups) == pytest.approx(wilson_interval(8, 10))
    assert share_interval(1.0, [[1.0] * 10] * 10) == pytest.approx(wilson_interval(10, 10), abs=0.01)


@pytest.mark.parametrize(("groups", "repeats"), [(10, 10), (20, 5)])
def test_the_interval_of_a_share_holds_it_where_failures_depend_on_the_map(groups, repeats):
    """Wilson's interval of all runs holds it in two of three samples only."""
    rng = np.random.default_rng(0)
    held = []
    for _ in range(300):
        chances = rng.beta(1.6, 0.4, groups)
        runs = (rng.random((groups, repeats)) < chances[:, None]).astype(float)
        low, high = share_interval(float(runs.mean()), runs.tolist())
        held.append(low <= 0.8 <= high)
    assert np.mean(held) > 0.92


def test_the_difference_of_equal_shares_has_an_interval():
    """With six goals of six on both sides, either share may be as low as Wilson's 0.61."""
    goals = [[1.0]] * 6
    low, high = share_difference_interval(goals, goals)
    assert (low, high) == pytest.approx((-0.3903, 0.3903), abs=1e-4)
    assert share_difference_interval([], []) == (-1.0, 1.0)


def test_the_interval_of_a_paired_difference_is_newcombes():
    """His example: 36 pairs of successes, 12 that the second side alone has, 2 that the first alone has."""
    first = [[1.0]] * 36 + [[0.0]] * 12 + [[1.0]] * 2
    second = [[1.0]] * 48 + [[0.0]] * 2
    assert share_difference_interval(first, second) == pytest.approx((0.0569, 0.3404), abs=1e-4)


@pytest.mark.parametrize("goals", range(11))
def test_the_interval_of_a_difference_has_a_width_where_no_pair_differs(goals):
    """With half of the pairs at the goal, a correlation of 1 gives [0, 0], as if no further pair could differ."""
    both = [[1.0]] * goals + [[0.0]] * (10 - goals)
    low, high = share_difference_interval(both, both)
    assert low == pytest.approx(-high)
    assert high > 0.15
    if goals == 5:  # Wilson's ends are 0.2634 away, and the corrected correlation is (25 - 5) / 25
        assert high == pytest.approx(0.2634 * math.sqrt(2 * (1 - 0.8)), abs=1e-4)


def test_the_interval_of_a_difference_holds_it_on_few_maps():
    """A bootstrap interval of the differences holds it in 60 %, as five maps often show none."""
    rng, held = np.random.default_rng(0), []
    for _ in range(300):
        chances = rng.beta((9.5, 8.0), (0.5, 2.0), (5, 2))
        first, second = (rng.random((2, 5, 1)) < chances.T[:, :, None]).astype(float).tolist()
        low, high = share_difference_interval(first, second)
        held.append(low <= -0.15 <= high)
    assert np.mean(held) > 0.92


def test_summaries_bound_the_median():
    values = np.random.default_rng(0).exponential(5, 50)
    row = summarize(values)
    assert (row.ci_low, row.ci_high) == median_interval(values)
    assert row.ci_low < row.median < row.ci_high
    assert np.isnan(summarize(values[:4]).ci_low)


@pytest.mark.parametrize("n", [5, 6])
def test_the_interval_of_the_median_is_that_of_all_resamples(n):
    values = np.random.default_rng(n).exponential(5, n)
    medians = np.sort([np.median(resample) for resample in itertools.product(values, repeat=n)])
    low, high = (medians[int(np.ceil(len(medians) * share)) - 1] for share in (0.025, 0.975))
    assert median_interval(values) == pytest.approx((low, high))


@pytest.mark.parametrize("n", [8, 31, 200, 1500])
def test_the_chances_of_the_medians_add_up(n):
    medians, chances = statistics._medians_of_resamples(np.arange(float(n)))
    assert chances.sum() == pytest.approx(1.0)
    assert chances.min() > -1e-9
    assert (medians * chances).sum() == pytest.approx((n - 1) / 2)


def test_the_interval_of_the_median_depends_on_no_order():
    values = [-7.0, -6.0, -5.92, -4.96, -4.63, -4.34, -3.07, -2.81]
    assert median_interval(values) == median_interval(values[::-1]) == (-6.0, -3.07)


def test_rank_correlation():
    rho, low, high = rank_correlation(range(30), np.arange(30) ** 2)
    assert rho == pytest.approx(1.0)
    assert low > 0.9
    assert high <= 1.0
    assert np.isnan(rank_correlation([1, 1], [1, 2])[0])


def test_a_few_pairs_that_all_agree_leave_room_below():
    swapped = rank_correlation(range(6), [1, 0, 2, 3, 4, 5])
    for sign in (1, -1):
        rho, *interval = rank_correlation(range(6), sign * np.arange(6))
        assert rho == pytest.approx(sign)
        assert sorted(abs(end) for end in interval) == pytest.approx([swapped[1], 1.0], abs=0.03)


def test_bad_input_is_one_line():
    with pytest.raises(ConfigError, match="no value in 'b'"):
        kruskal_wallis({"a": [1.0], "b": []})
    with pytest.raises(ConfigError, match="at least 2 problems"):
        friedman([[1.0, 2.0]], ["a", "b"])


@given(st.integers(1, 300).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))))
def test_wilson_interval_is_that_of_scipy_to_the_bit(counts):
    low, high = wilson_interval(*counts)
    theirs = scipy.stats.binomtest(*counts).proportion_ci(0.95, method="wilson")
    assert (low, high) == (theirs.low, theirs.high)
    assert 0.0 <= low <= counts[0] / counts[1] <= high <= 1.0
