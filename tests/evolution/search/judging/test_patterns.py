"""Roles and pairs: worked examples, their limits, and the exact best set against trying all sets."""

from __future__ import annotations

import math
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evolution.driving import RunResult
from evolution.search.experiment import Experiment
from evolution.search.judging import Fitness, JudgingSettings
from evolution.search.judging.exact import best_set
from evolution.search.judging.patterns import gini
from evolution.search.judging.patterns.pairs import pair_scores
from evolution.search.judging.patterns.roles import groups, role_scores
from evolution.search.settings import EvolveSettings
from gym_mapbench.errors import ConfigError
from tests.evolution.fake_runs import CONTROLLERS, WORLD

TIMES = st.lists(st.floats(5.0, 140.0), min_size=3, max_size=3)


def results_of(times):
    """One run of each controller on a map, all at the goal."""
    return tuple((RunResult("goal", time, 1.0),) for time in times)


@pytest.mark.parametrize(
    ("times", "scores"),
    [
        ((20, 20, 20), (1, 0, 0)),
        ((20, 20, 20 * math.sqrt(1.2)), (0.5, math.log(1.2) / 2 / math.log(1.5), 0)),
        ((20, 20, 40), (0, 1, 0)),
        ((40, 20, 20 * 1.1), (0, 1 - math.log(1.1) / math.log(1.2), math.log(1.1) / math.log(1.5))),
        ((20, 30, 60), (0, 0, 1)),
        ((20, 25, 60), (0, 0, math.log(1.25) / math.log(1.5))),
    ],
)
def test_roles_of_three_controllers(times, scores):
    assert role_scores(times) == pytest.approx(scores)


def test_no_regret_is_zero_without_a_sign():
    """``-0.0`` in a table is no number that a reader expects."""
    fitness = Fitness.of(JudgingSettings(fitness="regret"), 150.0)
    assert str(fitness((results_of((10.0, 20.0, 30.0)),)).fitness) == "0.0"


def test_more_controllers_fill_roles_by_their_number_of_groups():
    assert groups((10, 10, 30, 90)) == pytest.approx(3)
    assert role_scores((10, 10, 30, 90)) == pytest.approx((0, 0, 1, 0))
    assert role_scores((10, 10, 10, 10)) == pytest.approx((1, 0, 0, 0))


def test_the_pattern_is_that_of_the_best_assignment_of_maps_to_roles():
    fitness = Fitness.of(JudgingSettings(fitness="roles"), 150.0)
    equal, mixed, spread = results_of((20, 20, 20)), results_of((20, 20, 40)), results_of((20, 30, 60))
    for order in ((equal, mixed, spread), (spread, equal, mixed)):
        assert fitness(order).pattern == pytest.approx(1)
        assert fitness(order).fitness == pytest.approx(-20)
    assert fitness((equal, equal, spread)).pattern == pytest.approx(2 / 3)
    failed = ((RunResult("timeout", 150.0, 1.0),),) * 3
    assert fitness((failed, failed, failed)).pattern == 0  # three failures are not equally fast controllers


def test_pairs_ask_who_beats_whom():
    assert pair_scores((20, 20 * 1.2, 60)) == pytest.approx((1, 1, 0, 1, 0, 0))
    fitness = Fitness.of(JudgingSettings(fitness="pairs"), 150.0)
    there, back = results_of((20, 30, 60)), results_of((60, 30, 20))
    assert fitness((there, back)).pattern == pytest.approx(1)
    assert fitness((there, there)).pattern == pytest.approx(0.5)


@pytest.mark.parametrize("name", ["roles", "pairs", "gini", "cluster"])
@given(times=st.lists(TIMES, min_size=3, max_size=9))
@settings(max_examples=40, deadline=None)
def test_the_exact_best_set_is_the_best_of_all_sets(name, times):
    options = JudgingSettings(fitness=name, cluster_scale=10.0 if name == "cluster" else None)
    fitness = Fitness.of(options, 150.0)
    maps = {str(number): results_of(one) for number, one in enumerate(times)}
    values = [fitness(tuple(maps[name] for name in names)).fitness for names in combinations(maps, 3)]
    found = best_set(maps, fitness, 3)
    assert len(set(found)) == 3
    assert fitness(tuple(maps[name] for name in found)).fitness == pytest.approx(min(values))


@given(times=TIMES, factor=st.floats(0.1, 10.0))
def test_scores_depend_on_ratios_alone(times, factor):
    scaled = [factor * time for time in times]
    assert role_scores(scaled) == pytest.approx(role_scores(times), abs=1e-6)
    assert pair_scores(scaled) == pytest.approx(pair_scores(times), abs=1e-6)
    assert np.all((role_scores(times) >= 0) & (role_scores(times) <= 1))


@pytest.mark.parametrize(
    ("options", "controllers", "message"),
    [
        ({"fitness": "roles", "maps_per_set": 2}, 3, "maps_per_set: expected 3 or more with roles, got 2"),
        ({"fitness": "roles"}, 2, "controllers: expected 3 or more with roles, got 2"),
        ({"fitness": "roles", "failures": "par2"}, 3, "failures: expected 'exclude' with fitness 'roles', got 'par2'"),
        ({"fitness": "pairs", "maps_per_set": 1}, 3, "maps_per_set: expected 2 or more with pairs, got 1"),
        ({"fitness": "gini", "maps_per_set": 1}, 3, "maps_per_set: expected 2 or more with gini, got 1"),
        ({"fitness": "cluster", "maps_per_set": 1}, 3, "maps_per_set: expected 2 or more with cluster, got 1"),
        (
            {"fitness": "regret", "metric": "spl"},
            3,
            "metric: expected one of which less is better with fitness 'regret'",
        ),
        ({"fitness": "pairs", "metric": "min_clearance"}, 3, "metric: .* less is better with fitness 'pairs'"),
        (
            {"fitness": "regret", "objectives": ("n_obstacles", "min_clearance"), "algorithm": "nsga2"},
            3,
            "objectives: .* less is better with fitness 'regret', got 'min_clearance'",
        ),
    ],
)
def test_what_a_pattern_cannot_be_used_for_is_one_line(options, controllers, message):
    with pytest.raises(ConfigError, match=message):
        Experiment(EvolveSettings(**options), CONTROLLERS[:controllers], WORLD)


def test_values_below_zero_count_as_zero():
    """A clearance is a little below 0 where a robot touches a wall; the Gini coefficient stays below 1 - 1/n."""
    assert gini((-0.0002, -0.0003, 0.0006)) == pytest.approx(2 / 3)
