"""Expected held-out fitness: what is expected of a further trial of a set."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evolution.driving import RunResult
from evolution.search.archive import Archive
from evolution.search.judging import Fitness, JudgingSettings, scores_of
from evolution.search.judging.exact import judge_map
from evolution.search.judging.expected_fitness import Estimate, chances_in_time, deviations_of, expected_fitness
from evolution.search.validation_stage.candidates import best_expected, largest_contribution
from tests.evolution.search.test_archive import Answers, archive_of, sets_of

FITNESS = Fitness.of(JudgingSettings(), 150.0)


def driven(*slowest):
    """A map on which two controllers always take 20 s, and the third these times."""
    steady = tuple(RunResult("goal", 20.0, 1.0) for _ in slowest)
    return steady, steady, tuple(RunResult("goal", time, 1.0) for time in slowest)


def deviations(**maps):
    singles = {name: scores_of(one, FITNESS) for name, one in maps.items()}
    return deviations_of(singles, singles)


def estimate(time, deviation, in_time=1.0):
    judged = judge_map(driven(time), FITNESS)
    return Estimate(judged.values, judged.score, deviation, in_time)


def test_the_deviation_of_a_map_with_one_repeat_is_that_of_similar_maps():
    steady, unsteady = driven(30.0, 31.0, 32.0), driven(80.0, 100.0, 130.0)
    found = deviations(steady=steady, unsteady=unsteady, once=driven(31.0))
    variances = [np.var(scores_of(one, FITNESS), ddof=1) for one in (steady, unsteady)]
    assert found["once"] == pytest.approx(np.sqrt(4 * np.mean(variances) / 4))
    expected = np.sqrt((2 * variances[0] + 4 * np.mean(variances)) / 6)
    assert found["steady"] == pytest.approx(expected)
    assert deviations(once=driven(31.0), other=driven(50.0)) == {"once": 0.0, "other": 0.0}


def test_maps_with_one_high_score_are_not_the_similar_maps_of_maps_with_a_low_score():
    lucky = {f"lucky{n}": driven(100.0 + n, 30.0, 31.0, 30.0) for n in range(5)}
    steady = {f"steady{n}": driven(34.0 + n, 33.0, 35.0, 34.0) for n in range(5)}
    found = deviations(**lucky, **steady, low=driven(30.5), high=driven(100.5))
    assert found["low"] < 0.1 * found["high"]


def test_times_that_nearly_reached_the_limit_are_not_expected_to_stay_below_it():
    near, far = driven(40.0, 60.0, 130.0, 145.0, 50.0), driven(40.0, 41.0, 42.0, 41.0, 40.0)
    maps = {"near": near, "far": far}
    found = chances_in_time(maps, {name: scores_of(one, FITNESS) for name, one in maps.items()}, 150.0)
    assert found["near"] < 0.9
    assert found["far"] > 0.99
    assert chances_in_time({"one": driven(149.0)}, {"one": [0.3]}, 150.0) == {"one": 1.0}
    logs = np.log([40.0, 60.0, 130.0, 145.0, 50.0])
    alone = chances_in_time({"near": near}, {"near": [0.3] * 5}, 150.0)["near"]
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
    assert expected_fitness("abc", doubtful, FITNESS) == pytest.approx(fitness * normal * below, rel=0.01)
    late = certain | {"c": estimate(90.0, 0.0, in_time=0.7)}
    assert expected_fitness("abc", late, FITNESS) == pytest.approx(0.7 * fitness)
    equal = {"a": estimate(20.0, 0.1), "b": estimate(20.0, 0.1)}
    assert expected_fitness("ab", equal, FITNESS) == 20_000.0  # no pattern


def answer(job):
    """One controller is slower on some maps than on others, and on the slowest unsteady."""
    kind = int(job.scenario.map.digest[:2], 16) % 4
    luck = np.random.default_rng(job.seed).normal()
    slow = (21.0, 30.0, 45.0, 60.0 + 15.0 * luck)[kind] + int(job.scenario.map.digest[2:4], 16) / 100
    return RunResult("goal", max(slow, 20.0) if job.controller.registered_name == "mppi" else 20.0, 1.0, seed=job.seed)


def test_the_middle_map_is_rank_stable():
    archive = Archive(Answers(answer), archive_of().plan)
    archive.evaluate(sets_of(12))
    archive.drive(dict.fromkeys(list(archive.scenarios)[::2], 6))
    fitness = Fitness.of(JudgingSettings(caution=1.0), 150.0)
    fittest, chosen = archive.best(fitness, 3), best_expected(archive, fitness, 3)
    assert set(best_expected(archive, fitness, 3, frozenset(chosen))).isdisjoint(chosen)
    assert order_kept(archive, chosen) > order_kept(archive, fittest) + 0.1
    pairs = Fitness.of(JudgingSettings(fitness="pairs"), 150.0)
    assert best_expected(archive, pairs, 3) == archive.best(pairs, 3)
    assert best_expected(archive_of(), FITNESS, 3) == ()


def order_kept(archive, names):
    """The share of many trials in which the maps keep the order of their scores."""
    archive.drive(dict.fromkeys(names, 60))
    scores = sorted((scores_of(archive.results(name), FITNESS) for name in names), key=np.mean)
    return np.mean([a < b < c for a, b, c in zip(*(some[6:] for some in scores), strict=True)])


def test_the_largest_contribution_is_found_by_expected_fitness():
    """By fitness low maps would be missed most, as others, fitter than the steady one, nearly run out of time."""
    kinds = {}

    def answer(job):
        luck = abs(np.random.default_rng(job.seed).normal())
        kind = kinds[job.scenario.map.digest]
        time = {"steady": 140.0 - luck, "late": 149.9 - 3.0 * luck, "middle": 48.0 - luck, "low": 21.0 - luck / 4}[kind]
        return RunResult("goal", time if job.controller.registered_name == "mppi" else 20.0, 1.0, seed=job.seed)

    sets = sets_of(8)
    names = list(dict.fromkeys(scenario.map.digest for one in sets for scenario in one))
    kinds |= dict(zip(names, ["steady", *["late"] * 5, *["middle"] * 6, *["low"] * len(names)], strict=False))
    archive = Archive(Answers(answer), archive_of().plan)
    archive.evaluate(sets)
    archive.drive(dict.fromkeys(names, 6))
    fitness = Fitness.of(JudgingSettings(), 150.0)
    best = best_expected(archive, fitness, 3)
    assert [kinds[name] for name in best if kinds[name] not in ("low", "middle")] == ["steady"]
    assert kinds[largest_contribution(archive, fitness, best)] == "steady"
    fittest = {
        name: fitness(archive.results_of(archive.map_set(archive.best(fitness, 3, {name})))).fitness for name in best
    }
    assert kinds[max(fittest, key=fittest.get)] != "steady"
