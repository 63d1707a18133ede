"""The exact best set of driven maps, against trying every set."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evolution.driving.jobs import RunResult
from evolution.search.judging import Fitness, JudgingSettings
from evolution.search.judging.exact import best_set
from gym_mapbench.errors import ConfigError

TIME_LIMIT = 50.0
RUN = st.builds(
    RunResult,
    outcome=st.sampled_from(["goal", "goal", "goal", "timeout", "collision"]),
    time_s=st.sampled_from([4.0, 5.0, 6.5, 8.0, 9.0, 13.0, 20.0, 31.0]),
    path_length_m=st.just(1.0),
)
MAPS = st.lists(
    st.sampled_from([1, 1, 2, 4]).flatmap(lambda repeats: st.tuples(*[st.tuples(*[RUN] * repeats)] * 3)),
    min_size=3,
    max_size=9,
)
"""Maps with different numbers of repeats, as an elite has more of them."""
OPTIONS = st.fixed_dictionaries(
    {
        "fitness": st.sampled_from(["gini", "cluster", "pairs"]),
        "failures": st.sampled_from(["exclude", "censor", "par2"]),
        "unevenness_weight": st.sampled_from([0.0, 1.0, 3.0]),
        "epsilon": st.sampled_from([0.0, 1e-8, 0.05]),
        "caution": st.sampled_from([0.0, 1.0, 3.0]),
    }
)


def fitness_of(**options):
    return Fitness.of(JudgingSettings(cluster_scale=2.7, **options), TIME_LIMIT)


def brute_force(maps, fitness, size):
    return min(fitness(tuple(maps[name] for name in names)).fitness for names in combinations(maps, size))


@settings(max_examples=120)
@given(MAPS, OPTIONS, st.integers(1, 3))
def test_no_set_is_better(results, options, size):
    maps = {f"m{i}": one for i, one in enumerate(results)}
    fitness = fitness_of(**options)
    names = best_set(maps, fitness, size)
    assert len(set(names)) == size
    found = fitness(tuple(maps[name] for name in names)).fitness
    assert found == pytest.approx(brute_force(maps, fitness, size), abs=1e-9)


@pytest.mark.parametrize("kind", ["gini", "cluster"])
def test_many_maps(kind):
    rng = np.random.default_rng(3)
    maps = {
        f"m{i}": tuple((RunResult("goal", float(time), 1.0),) for time in rng.gamma(2.0, 4.0, 3) + 4) for i in range(30)
    }
    fitness = fitness_of(fitness=kind)
    found = fitness(tuple(maps[name] for name in best_set(maps, fitness, 3))).fitness
    assert found == pytest.approx(brute_force(maps, fitness, 3), abs=1e-9)


def test_by_hand():
    # Gini of (t, t, t) is 0, of (0, 0, t) is 2/3; of (1, 1, 4) it is 1/3: the middle of the two.
    def runs(*times):
        return tuple((RunResult("goal", time, 1.0),) for time in times)

    maps = {"equal": runs(5.0, 5.0, 5.0), "even": runs(1.0, 1.0, 4.0), "one": runs(0.0, 0.0, 9.0), "x": runs(4, 5, 6)}
    assert set(best_set(maps, fitness_of(fitness="gini"), 3)) == {"equal", "even", "one"}
    assert fitness_of()(tuple(maps[name] for name in ("equal", "even", "one"))).fitness == pytest.approx(-20 * 2 / 3)


def test_one_solved_map_shows_pairs():
    def runs(outcome, *times):
        return tuple((RunResult(outcome, time, 1.0),) for time in times)

    maps = {
        "alike": runs("goal", 5.0, 5.5),
        "apart": runs("goal", 5.0, 9.0),
        **{f"failed {number}": runs("collision", 5.0, 9.0) for number in range(2)},
    }
    few = {name: maps[name] for name in ("alike", "failed 0", "failed 1")}
    assert best_set(maps, fitness_of(fitness="pairs"), 1) == ("apart",)
    assert "alike" in best_set(few, fitness_of(fitness="pairs"), 2)


def test_what_cannot_be_answered_is_said():
    with pytest.raises(ConfigError, match="expected 1 to 3 maps per set, got 4"):
        best_set({}, fitness_of(), 4)
    with pytest.raises(ConfigError, match="expected at least 3 maps, got 0"):
        best_set({}, fitness_of(), 3)
