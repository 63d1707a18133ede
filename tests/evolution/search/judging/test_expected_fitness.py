"""Expected held-out fitness: what is expected of a further trial of a set."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evolution.driving import RunResult
from evolution.search.judging import Fitness, JudgingSettings, scores_of
from evolution.search.judging.expected_fitness import (
    Estimate,
    chances_in_time,
    chances_of_goals,
    deviations_of,
    expected_fitness,
    places_of,
    shrunken_values,
)
from gym_mapbench.kernels.nearest import nearest

HERE = np.zeros(3)
FITNESS = Fitness.of(JudgingSettings(), 150.0)


def driven(*slowest):
    """A map on which two controllers always take 20 s, and the third these times."""
    steady = tuple(RunResult("goal", 20.0, 1.0) for _ in slowest)
    return steady, steady, tuple(RunResult("goal", time, 1.0) for time in slowest)


def deviations(**maps):
    singles = {name: scores_of(one, FITNESS) for name, one in maps.items()}
    return deviations_of(singles, places_of(maps, singles))


def estimate(time, deviation, success=1.0):
    judged = FITNESS.judge_map(driven(time))
    return Estimate(judged.values, judged.score, deviation, success)


def test_the_deviation_of_a_map_with_one_repeat_is_that_of_similar_maps():
    steady, unsteady = driven(30.0, 31.0, 32.0), driven(80.0, 100.0, 130.0)
    found = deviations(steady=steady, unsteady=unsteady, once=driven(31.0))
    variances = [np.var(scores_of(one, FITNESS), ddof=1) for one in (steady, unsteady)]
    assert found["once"] == pytest.approx(np.sqrt(4 * np.mean(variances) / 4))
    expected = np.sqrt((2 * variances[0] + 4 * np.mean(variances)) / 6)
    assert found["steady"] == pytest.approx(expected)
    assert deviations(once=driven(31.0), other=driven(50.0)) == {"once": 0.0, "other": 0.0}


def test_maps_with_one_high_score_are_not_the_similar_maps_of_maps_with_a_low_score():
    lucky = {f"lucky{n}": driven(100.0 + n, 30.0, 31.0, 30.0) for n in range(8)}
    steady = {f"steady{n}": driven(34.0 + n / 4, 33.0, 35.0, 34.0) for n in range(8)}
    found = deviations(**lucky, **steady, low=driven(30.5), high=driven(100.5))
    assert found["low"] < 0.1 * found["high"]


@given(seed=st.integers(0, 2**32 - 1), others=st.integers(0, 20), count=st.integers(1, 9))
def test_the_nearest_points_are_those_of_plain_numpy(seed, others, count):
    rng = np.random.default_rng(seed)
    points, others = (rng.integers(0, 4, (size, 3)) / 3 for size in (5, others))
    distances = np.abs(others[None] - points[:, None]).sum(axis=2)
    expected = np.argsort(distances, axis=1, kind="stable")[:, :count]
    assert np.array_equal(nearest(points, others, count), expected)


def test_times_that_nearly_reached_the_limit_are_not_expected_to_stay_below_it():
    near, far = driven(40.0, 60.0, 130.0, 145.0, 50.0), driven(40.0, 41.0, 42.0, 41.0, 40.0)
    maps = {"near": near, "far": far}
    found = chances_in_time(maps, places_of(maps, {name: scores_of(one, FITNESS) for name, one in maps.items()}), 150.0)
    assert found["near"] < 0.9
    assert found["far"] > 0.99
    assert chances_in_time({"one": driven(149.0)}, {"one": HERE}, 150.0) == {"one": 1.0}
    logs = np.log([40.0, 60.0, 130.0, 145.0, 50.0])
    alone = chances_in_time({"near": near}, {"near": HERE}, 150.0)["near"]
    drawn = np.random.default_rng(0).standard_t(8, 200_000) * np.std(logs, ddof=1) * np.sqrt(1.2) + logs.mean()
    assert alone == pytest.approx(np.mean(drawn < np.log(150.0)), abs=0.005)


@given(times=st.lists(st.floats(20.0, 200.0), min_size=1, max_size=8))
def test_many_repeats_outweigh_similar_maps(times):
    own = deviations(own=driven(*times * 40), other=driven(*[50.0] * 10))["own"]
    singles = scores_of(driven(*times * 40), FITNESS)
    assert own == pytest.approx(np.std(singles, ddof=1), rel=0.1, abs=1e-3)


def test_the_expected_fitness_is_the_fitness_times_the_chance_of_order():
    certain = {"a": estimate(20.0, 0.0), "b": estimate(40.0, 0.0), "c": estimate(90.0, 0.0)}
    fitness = FITNESS((driven(20.0), driven(40.0), driven(90.0))).fitness
    for names in permutations("abc"):
        assert expected_fitness(names, certain, FITNESS) == pytest.approx(fitness)
    gap = certain["c"].score - certain["b"].score
    doubtful = certain | {"b": estimate(40.0, 0.6 * gap), "c": estimate(90.0, 0.8 * gap)}
    normal = 0.8413447  # one standard deviation above the mean
    to_a = (certain["b"].score - certain["a"].score) / (0.6 * gap)
    below = np.mean(np.random.default_rng(1).normal(size=200_000) < to_a)
    assert expected_fitness("abc", doubtful, FITNESS) == pytest.approx(fitness * (normal * below) ** 2, rel=0.01)
    late = certain | {"c": estimate(90.0, 0.0, success=0.95)}
    assert expected_fitness("abc", late, FITNESS) == pytest.approx(0.95**2 * fitness)
    failing = certain | {"c": estimate(90.0, 0.0, success=0.6)}
    timeout = 100.0 / 9.0 + 10.0
    assert expected_fitness("abc", failing, FITNESS) == pytest.approx(0.6**2 * fitness + timeout / 3.0)
    equal = {"a": estimate(20.0, 0.1), "b": estimate(20.0, 0.1)}
    assert expected_fitness("ab", equal, FITNESS) == 20_000.0  # no pattern


def failing(*outcomes):
    """A map on which the third controller ends like this."""
    steady = tuple(RunResult("goal", 20.0, 1.0) for _ in outcomes)
    return steady, steady, tuple(RunResult(outcome, 30.0, 1.0) for outcome in outcomes)


def test_values_are_shrunk_towards_those_of_the_parent():
    maps = {"parent": driven(40.0), "other": driven(20.0), "third": driven(30.0), "child": driven(100.0, 70.0)}
    found = shrunken_values(maps, {"child": "parent"}, FITNESS)
    middle = np.median([40.0, 20.0, 30.0, 85.0])
    assert found["other"] == pytest.approx((20.0, 20.0, (0.5 * middle + 20.0) / 1.5))
    of_parent = (0.5 * middle + 40.0) / 1.5
    assert found["child"] == pytest.approx((20.0, 20.0, (0.5 * of_parent + 2 * 85.0) / 2.5))


def test_a_controller_without_runs_has_the_value_of_the_parent():
    partial = ((), (), (RunResult("goal", 90.0, 1.0),))
    found = shrunken_values({"parent": driven(60.0), "child": partial}, {"child": "parent"}, FITNESS)
    assert found["child"][:2] == pytest.approx(found["parent"][:2])
    assert found["parent"][2] < found["child"][2] < 90.0


def test_trials_with_a_failure_do_not_count_in_values():
    maps = {"steady": driven(30.0, 30.0), "failed": failing("goal", "timeout", "goal"), "never": failing("collision")}
    found = shrunken_values(maps, {}, FITNESS)
    assert found["failed"] == pytest.approx((20.0, 20.0, 30.0))
    assert found["never"] == pytest.approx((20.0, 20.0, 30.0))  # the median of all maps


def test_failures_of_similar_maps_lower_the_chance_of_goals():
    good = {f"good{n}": driven(*[25.0 + n / 10] * 3) for n in range(10)}
    bad = {f"bad{n}": failing("goal", "timeout") for n in range(10)}
    scores = dict.fromkeys(good, 0.05) | dict.fromkeys(bad, 0.3) | {"low": 0.06, "high": 0.29}
    maps = {**good, **bad, "low": driven(26.0), "high": driven(70.0)}
    found = chances_of_goals(maps, places_of(maps, {name: [score] for name, score in scores.items()}))
    assert found["low"] == pytest.approx(1.0 - (0.3 / 30.0) * 6.0 / 7.0)
    assert found["high"] == pytest.approx(1.0 - (10.3 / 20.0) * 6.0 / 7.0)
    assert found["good0"] == pytest.approx(1.0 - (0.3 / 30.0) * 6.0 / 9.0)
    assert chances_of_goals({"alone": driven(20.0)}, {"alone": HERE})["alone"] == pytest.approx(1.0 - 0.03 * 6.0 / 7.0)


def test_the_order_does_not_count_where_the_fitness_knows_none():
    pairs = Fitness.of(JudgingSettings(fitness="pairs"), 150.0)
    certain = {"a": estimate(30.0, 0.0), "b": estimate(60.0, 0.0)}
    doubtful = {name: one._replace(deviation=1.0) for name, one in certain.items()}
    assert expected_fitness("ab", certain, pairs) == expected_fitness("ab", doubtful, pairs) < 0.0
