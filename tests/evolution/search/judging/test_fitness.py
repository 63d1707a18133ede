from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evolution.driving.jobs import RunResult
from evolution.search.judging import Fitness, JudgingSettings, calibrate_scale
from evolution.search.judging.exact import best_set
from evolution.search.judging.patterns import Pattern, gini
from evolution.search.judging.patterns.cluster import cluster_score, partial_pattern_score, pattern_score
from evolution.search.judging.patterns.gini import NO_PATTERN, gini_fitness
from gym_mapbench.errors import ConfigError, PluginError, RunError

# Means of DWB, MPPI and RPP on maps 1 to 3, s.
TABLE_5_3 = ((37.65, 6.54, 4.93), (8.13, 7.03, 11.73), (8.47, 7.8, 8.87))
TABLE_5_4 = ((7.79, 7.95, 11.11), (7.57, 6.26, 4.77), (13.91, 6.11, 8.3))
THESIS_SCALE = 2.7069

times = st.lists(st.floats(0.01, 1e4), min_size=1, max_size=8)


def results_of(*maps, outcome="goal"):
    """One repeat of every controller; a number is a successful time, a string an outcome."""
    return tuple(tuple((run_of(value, outcome),) for value in of_map) for of_map in maps)


def run_of(value, outcome="goal"):
    return RunResult(value, 150.0, 9.0) if isinstance(value, str) else RunResult(outcome, value, 2 * value)


def fitness_of(results, **options):
    return Fitness.of(JudgingSettings(**options), time_limit=150.0)(results)


def test_table_5_3_of_the_thesis():
    breakdown = fitness_of(results_of(*TABLE_5_3))
    assert sorted(breakdown.scores) == pytest.approx([0.0284, 0.1165, 0.4441], abs=5e-5)
    assert breakdown.pattern == pytest.approx(0.4014, abs=5e-5)
    assert breakdown.fitness == pytest.approx(-20 * 0.4014, abs=1e-3)
    assert breakdown.values == TABLE_5_3


def test_table_5_4_of_the_thesis():
    breakdown = fitness_of(results_of(*TABLE_5_4), fitness="cluster", cluster_scale=THESIS_SCALE)
    assert breakdown.pattern == pytest.approx(0.6791, abs=5e-5)
    assert breakdown.fitness == pytest.approx(-20 * 0.6791, abs=1e-3)


def test_gini_by_hand():
    # (4, 1, 3): sorted 1, 3, 4; sum of i t_i = 1 + 6 + 12 = 19; sum 8; g = 38/24 - 4/3 = 0.25.
    assert gini((4.0, 1.0, 3.0)) == pytest.approx(0.25)
    # (0, 0, 6): 3 * 6 = 18; g = 36/18 - 4/3 = 2/3, the largest value for three.
    assert gini((0.0, 6.0, 0.0)) == pytest.approx(2 / 3)
    assert [gini((time, time, time)) for time in (5.0, 5.4, 11.5, 20.45)] == [0.0] * 4
    assert gini((5.4, 5.4)) == 0.0
    assert gini((0.0, 0.0)) == 0.0


def test_gini_fitness_by_hand():
    # (0.3, 0, 0.1): gaps 0.1 and 0.2, mean 0.15, population variance 0.0025; 0.3 - 0.0025 = 0.2975.
    assert gini_fitness((0.3, 0.0, 0.1)) == pytest.approx(0.2975)
    assert gini_fitness((0.3, 0.0, 0.1), unevenness_weight=10.0) == pytest.approx(0.275)
    assert gini_fitness((0.1, 0.4)) == pytest.approx(0.3)
    assert gini_fitness((0.2, 0.3, 0.2)) == NO_PATTERN
    assert gini_fitness((0.2, 0.3, 0.2 + 1e-6), epsilon=1e-5) == NO_PATTERN
    assert gini_fitness((0.2,)) == gini_fitness(()) == NO_PATTERN


def test_cluster_by_hand():
    # (1, 2, 4) with scale 2: gaps 1, 3, 2, mean 2; 1 + 2/2 = 2 groups.
    assert cluster_score((1.0, 2.0, 4.0), 2.0) == pytest.approx(2.0)
    assert cluster_score((1.0, 2.0, 400.0), 2.0) == 3.0
    assert cluster_score((7.0,), 2.0) == 1.0
    # (3, 1, 1): sorted 1, 1, 3 against 1, 2, 3: distance 1; farthest: (3,3,3) -> sqrt(4 + 1); 1 - 1/sqrt(5).
    assert partial_pattern_score((3.0, 1.0, 1.0)) == pytest.approx(1 - 1 / np.sqrt(5))
    assert partial_pattern_score((1.0, 2.0, 3.0)) == 1.0
    assert partial_pattern_score((2.5, 1.75)) == pytest.approx(0.75)
    assert partial_pattern_score((1.0, 2.5)) == 1.0
    assert partial_pattern_score((2.0,)) == partial_pattern_score(()) == 0.0


def test_composition_by_hand():
    # 9 runs: 7 successful, one timeout, one collision, on map 3. s = 7/9, t = 1, two maps left:
    # Gini 0.25 and 0, fitness 0.25; f = 100 * 2/9 + 10 - 20 * 0.25 * 7/9 = 28.333...
    results = results_of((4.0, 1.0, 3.0), (5.0, 5.0, 5.0), ("timeout", 5.0, "collision"))
    breakdown = fitness_of(results)
    assert breakdown.scores == (pytest.approx(0.25), 0.0, None)
    assert (breakdown.success_rate, breakdown.timeouts) == (pytest.approx(7 / 9), 1.0)
    assert breakdown.fitness == pytest.approx(100 * 2 / 9 + 10 - 20 * 0.25 * 7 / 9)
    counted = fitness_of(results, timeout_outcomes=("timeout", "collision"))
    assert counted.fitness == pytest.approx(breakdown.fitness + 10)


def test_all_failed():
    results = results_of(*[["timeout"] * 3] * 3)
    assert fitness_of(results).fitness == pytest.approx(100 + 9 * 10)
    assert fitness_of(results).pattern == NO_PATTERN
    assert fitness_of(results, fitness="cluster", cluster_scale=1.0).fitness == pytest.approx(190)
    crashed = results_of(*[["collision"] * 3] * 3)
    assert fitness_of(crashed).fitness == pytest.approx(100)


def test_equal_ginis_cost_a_thousand_patterns():
    breakdown = fitness_of(results_of((1.0, 2.0), (2.0, 4.0), (1.0, 5.0)))
    assert breakdown.pattern == NO_PATTERN
    assert breakdown.fitness == pytest.approx(20 * 1000)


def test_failure_rules():
    results = results_of((1.0, 2.0), (3.0, "timeout"), (1.0, 9.0))
    assert fitness_of(results).values == ((1.0, 2.0), None, (1.0, 9.0))
    assert fitness_of(results, failures="censor").values[1] == (3.0, 150.0)
    assert fitness_of(results, failures="par2").values[1] == (3.0, 300.0)
    for rule in ("censor", "par2"):
        with pytest.raises(ConfigError, match="failures: expected 'exclude' with metric 'path_length'"):
            JudgingSettings(failures=rule, metric="path_length")


def test_repeats_are_aggregated_and_timeouts_counted_per_repeat():
    runs = (run_of(1.0), run_of(2.0), run_of(9.0))
    late = (run_of(1.0), run_of("timeout"), run_of("timeout"))
    results = ((runs, runs), (runs, late))
    assert fitness_of(results).values == ((4.0, 4.0), None)
    assert fitness_of(results, aggregate="median").values[0] == (2.0, 2.0)
    assert fitness_of(results).timeouts == pytest.approx(2 / 3)
    assert fitness_of(results).success_rate == pytest.approx(10 / 12)


def test_any_metric_can_be_compared():
    results = results_of((1.0, 2.0), (3.0, 4.0))
    assert fitness_of(results, metric="path_length").values == ((2.0, 4.0), (6.0, 8.0))
    with pytest.raises(ConfigError, match=r"unknown metric 'path_lenght'; did you mean 'path_length'\?"):
        fitness_of(results, metric="path_lenght")


def test_the_scale_is_the_median_gap_of_the_first_results():
    # Gaps: 1, 3, 2 and 4, 8, 4 -> sorted 1, 2, 3, 4, 4, 8: median 3.5; the failed map does not count.
    results = [results_of((1.0, 2.0, 4.0), (0.0, 4.0, 8.0)), results_of((1.0, 99.0, "timeout"))]
    fitness = Fitness.of(JudgingSettings(fitness="cluster"), 150.0)
    assert fitness.needs_scale
    with pytest.raises(ConfigError, match="cluster_scale: expected a value"):
        fitness(results[0])
    calibrated = fitness.calibrated(results)
    assert calibrated.cluster_scale == 3.5
    assert calibrated.calibrated(results[:1]) is calibrated
    given_one = Fitness.of(JudgingSettings(fitness="cluster", cluster_scale=1.5), 150.0)
    assert given_one.calibrated(results) is given_one
    with pytest.raises(RunError, match="no map that all controllers solved"):
        fitness.calibrated(results[1:])
    with pytest.raises(RunError, match="a median gap of 0 over 3 pairs"):
        calibrate_scale([(2.0, 2.0, 2.0)])


@given(times, st.floats(1e-3, 1e3))
def test_gini_is_bounded_and_free_of_scale_and_order(values, factor):
    value = gini(values)
    assert 0.0 <= value <= 1 - 1 / len(values) + 1e-12
    assert gini([factor * t for t in values]) == pytest.approx(value, abs=1e-9)
    assert gini(values[::-1]) == value


@given(times)
def test_gini_is_the_mean_difference(values):
    """The definition: mean absolute difference over twice the mean."""
    differences = [abs(a - b) for a, b in itertools.product(values, repeat=2)]
    assert gini(values) == pytest.approx(np.mean(differences) / (2 * np.mean(values)), abs=1e-9)


@given(st.lists(st.floats(0, 1), max_size=6))
def test_gini_fitness_never_exceeds_the_spread(ginis):
    value = gini_fitness(ginis)
    assert value == NO_PATTERN or value <= max(ginis) - min(ginis) + 1e-12


@given(times, st.floats(1e-2, 1e3))
def test_cluster_scores_count_groups(values, scale):
    assert 1.0 <= cluster_score(values, scale) <= len(values)
    assert cluster_score([7.0 + t for t in values], scale) == pytest.approx(cluster_score(values, scale), rel=1e-6)


@given(st.lists(st.floats(1, 5), min_size=2, max_size=5))
def test_patterns_lie_between_0_and_1_whatever_the_order(values):
    assert 0.0 <= pattern_score(values) <= 1.0
    assert 0.0 <= partial_pattern_score(values) <= 1.0
    assert partial_pattern_score(values[::-1]) == partial_pattern_score(values)


class Contrast(Pattern):
    """Slowest over fastest; who is fastest counts too."""

    def score(self, times):
        return max(times) / min(times)

    def judge(self, scores, maps):
        return sum(scores) + len({times.index(min(times)) for times in maps})


class Broken(Contrast):
    def score(self, times):
        raise ValueError("no idea")


class Former(Contrast):
    """Written for an earlier version."""

    def read(self, times):
        return 10.0


class Lost(Contrast):
    def judge(self, scores, maps):
        return float("nan")


class Silent(Contrast):
    def judge(self, scores, maps):
        """Forget to return."""


class Unfinished(Pattern):
    """Without any method."""


class Endless(Contrast):
    def score(self, times):
        return float("inf")


class OneObjective(Contrast):
    objectives = "penalty"


class Aimless(Contrast):
    objectives = ()


class Unmade(Contrast):
    def __init__(self, settings, scale=None):
        raise ValueError("no wish")


HERE = "tests.evolution.search.judging.test_fitness"
WRONG = (
    ("Broken", r"ValueError: no idea, test_fitness.py line \d+"),
    ("Lost", "expected a finite pattern, got nan"),
    ("Endless", "expected a finite score, got inf"),
    ("Silent", "expected a finite pattern, got None"),
    ("Unmade", r"ValueError: no wish, test_fitness.py line \d+"),
    ("Unfinished", "NotImplementedError: Unfinished has no method score"),
)


@pytest.mark.parametrize(("name", "got"), [("OneObjective", "'penalty'"), ("Aimless", r"\(\)")])
def test_a_fitness_whose_objectives_are_no_names_is_refused(name, got):
    with pytest.raises(
        ConfigError, match=rf"fitness '{HERE}:{name}': objectives: expected a tuple of 1 .*, got {got}$"
    ):
        JudgingSettings(fitness=f"{HERE}:{name}")


def test_a_fitness_of_ones_own_gets_scores_and_times():
    # Ratios 4 and 5, the first controller is fastest on one map, the second on the other: 4 + 5 + 2 = 11, no failures.
    results = results_of((1.0, 4.0), (10.0, 2.0))
    breakdown = fitness_of(results, fitness=f"{HERE}:Contrast")
    assert (breakdown.scores, breakdown.pattern, breakdown.fitness) == ((4.0, 5.0), 11.0, -220.0)
    assert not Fitness.of(JudgingSettings(fitness=f"{HERE}:Contrast"), 150.0).needs_scale


def test_a_fitness_may_use_the_former_name_of_its_method():
    assert fitness_of(results_of((1.0, 4.0)), fitness=f"{HERE}:Former").scores == (10.0,)


def test_a_fitness_that_fails_says_so():
    for name, message in WRONG:
        with pytest.raises(PluginError, match=f"fitness '{HERE}:{name}': {message}"):
            fitness_of(results_of((1.0, 4.0)), fitness=f"{HERE}:{name}")
    with pytest.raises(ConfigError, match="fitness: unknown fitness 'ginni'; did you mean 'gini'"):
        JudgingSettings(fitness="ginni")
    with pytest.raises(ConfigError, match="expected a subclass of"):
        JudgingSettings(fitness=f"{HERE}:fitness_of")


def test_the_exact_best_set_of_a_fitness_that_does_not_know_it():
    fitness = Fitness.of(JudgingSettings(fitness=f"{HERE}:Contrast"), 150.0)
    maps = {str(i): results_of((1.0, 2.0 + i))[0] for i in range(3)}
    with pytest.raises(ConfigError, match="how to find its exact best set is not known"):
        best_set(maps, fitness, 2)
