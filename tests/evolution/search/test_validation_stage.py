"""The validation stage: the set that is selected on held-out seeds, and its held-out fitness."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import combinations, product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evolution.driving import RunResult
from evolution.search.budget import Budget
from evolution.search.expectations import Expectations
from evolution.search.judging import Fitness, JudgingSettings, singles_of
from evolution.search.sections import ValidationSettings
from evolution.search.settings import EvolveSettings
from evolution.search.validation_stage import validate
from evolution.search.validation_stage.held_out import held_out
from evolution.search.validation_stage.selection import (
    MAX_SETS,
    _Values,
    chance_of_less,
    few_enough,
    select,
    values_of_trials,
)
from evolution.search.validation_stage.trials import judged_trials, trials_of
from gym_mapbench.errors import ConfigError
from tests.evolution.search.test_archive import answer, archive_of, sets_of

STAGE = ValidationSettings()
OPTIONS = EvolveSettings(validation=STAGE, aggregate="median")
FITNESS = Fitness.of(OPTIONS.judging, 150.0)


def selected(maps, fitness=FITNESS):
    """The set of three maps that is selected."""
    return select(maps, fitness, 3, STAGE)


def map_with(*slowest, outcome="goal"):
    """A map on which two controllers always take 20 s, and the third these times."""
    steady = tuple(RunResult("goal", 20.0, 1.0) for _ in slowest)
    return steady, steady, tuple(RunResult(outcome, time, 1.0) for time in slowest)


EQUAL, MIDDLE, APART = map_with(*[20.0] * 8), map_with(*[30.0] * 8), map_with(*[44.0] * 8)


def said_of(results, seeds, candidates):
    """The held-out fitness of a set, from its last seeds."""
    return held_out(results, FITNESS(results), FITNESS, seeds, candidates)


def test_the_reliable_set_is_selected_and_not_the_one_with_the_best_mean():
    lucky = map_with(20.0, 20.0, 20.0, 120.0, 120.0, 120.0, 120.0, 120.0)
    maps = {"lucky": lucky, "apart": APART, "equal": EQUAL, "middle": MIDDLE}
    assert FITNESS((EQUAL, MIDDLE, lucky)).fitness < FITNESS((EQUAL, MIDDLE, APART)).fitness
    assert selected(maps) == ("equal", "middle", "apart")


def test_maps_that_are_not_rank_stable_are_not_neighbours():
    near = map_with(*[29.0, 31.0] * 4)
    maps = {"near": near, "middle": MIDDLE, "apart": APART, "equal": EQUAL}
    assert selected(maps) in (("equal", "near", "apart"), ("equal", "middle", "apart"))


def test_where_no_set_is_reliable_the_one_with_the_largest_share_of_good_trials_is_selected():
    times = {"a": (20.0, 34.0), "b": (22.0, 40.0), "c": (24.0, 44.0), "d": (25.0, 60.0)}
    maps = {name: map_with(*both * 4) for name, both in times.items()}
    kept = {
        names: np.mean(values_of_trials([maps[name] for name in names], FITNESS)[1]) for names in combinations(maps, 3)
    }
    assert max(kept.values()) < STAGE.reliability
    assert kept[selected(maps)] == pytest.approx(max(kept.values()))


def test_of_reliable_sets_the_one_with_the_best_mean_trial_is_selected():
    unsteady, weaker = map_with(*[60.0, 66.0] * 4), map_with(*[50.0] * 8)
    maps = {"equal": EQUAL, "middle": MIDDLE, "unsteady": unsteady, "weaker": weaker}
    assert selected(maps) == ("equal", "middle", "unsteady")


def touched(of_map):
    """The map with a contact in the last run."""
    untouched = [tuple(replace(run, metrics={"n_contacts": 0.0}) for run in runs) for runs in of_map]
    *others, last = untouched
    return *others, (*last[:-1], replace(last[-1], metrics={"n_contacts": 1.0}))


def test_maps_with_a_contact_are_avoided_where_asked_and_while_others_suffice():
    near = map_with(*[29.0, 31.0] * 4)
    free = {"a": EQUAL, "b": near, "c": map_with(*[36.0] * 8)}
    free = {
        name: tuple(tuple(replace(run, metrics={"n_contacts": 0.0}) for run in runs) for runs in of_map)
        for name, of_map in free.items()
    }
    maps = {**free, "touched": touched(APART)}
    careful = STAGE.replace(avoid_contact=True)
    assert "touched" in select(maps, FITNESS, 3, STAGE)
    assert select(maps, FITNESS, 3, careful) == ("a", "b", "c")
    del maps["b"]
    assert "touched" in select(maps, FITNESS, 3, careful)


def test_a_map_that_failed_once_is_out_while_others_suffice():
    failed = map_with(*[80.0] * 7, 80.0, outcome="timeout")
    assert "failed" not in selected({"failed": failed, "a": EQUAL, "b": MIDDLE, "c": APART})
    assert set(selected({"failed": failed, "a": EQUAL, "b": MIDDLE})) == {"failed", "a", "b"}


def test_chances_of_order_are_those_of_all_pairs():
    low, high = [1.0, 2.0, 3.0], [2.5, 4.0]
    by_hand = np.mean([a < b for a, b in product(low, high)])
    assert chance_of_less(low, high) == by_hand == pytest.approx(5 / 6)


def test_a_set_keeps_its_order_where_all_neighbours_do():
    near, far = map_with(*[28.0, 31.0] * 4), map_with(*[29.0, 44.0] * 4)
    values = _Values({"far": far, "equal": EQUAL, "near": near}, FITNESS, 0.9)
    low, middle, high = (values.scores[name] for name in ("equal", "near", "far"))
    by_hand = np.mean([a < b for a, b in product(low, middle)]) * np.mean([a < b for a, b in product(middle, high)])
    assert values._chance_of_order(("far", "equal", "near")) == by_hand == 0.75


def test_a_map_that_every_trial_fails_keeps_no_order():
    failed = map_with(*[80.0] * 4, outcome="timeout")
    values = _Values({"a": EQUAL, "b": MIDDLE, "c": APART, "failed": failed}, FITNESS, 0.9)
    assert values.estimate(("a", "b", "c")) < 0.0 <= values.estimate(("a", "b", "failed"))


def test_held_out_fitness_uses_the_last_seeds_alone():
    before = map_with(*[150.0] * 3, *[44.0] * 5)
    said = said_of((EQUAL, MIDDLE, before), 5, 12)
    assert said.fitness == pytest.approx(FITNESS((EQUAL, MIDDLE, APART)).fitness)
    assert said.interval == pytest.approx((said.fitness, said.fitness))
    assert (said.order_kept, said.goals, said.runs, said.seeds, said.candidates) == (1, 45, 45, 5, 12)
    assert said.goals_interval[0] == pytest.approx(0.921, abs=1e-3)
    assert said.fitness_par2 == pytest.approx(said.fitness)


def test_held_out_fitness_shows_failures_and_lost_order():
    swapping = map_with(*[20.0, 20.0, 20.0, 50.0, 50.0])
    said = said_of((map_with(*[21.0] * 5), swapping, APART), 5, 3)
    assert said.order_kept == pytest.approx(0.6)  # by its median it is the first map, in two of five drives the last
    failing = said_of((EQUAL, MIDDLE, map_with(*[44.0] * 8, outcome="collision")), 5, 3)
    assert failing.goals == 40
    assert failing.order_kept == 0
    assert failing.fitness > failing.fitness_par2


@pytest.mark.parametrize("places", [(0, 1, 2), (0, 2, 1)])
def test_maps_with_equal_scores_in_a_trial_do_not_keep_their_ranks(places):
    cluster = Fitness.of(JudgingSettings(fitness="cluster", cluster_scale=5.0), 150.0)
    times = ((20.0, 20.0, 20.0, 20.0), (27.5, 27.5, 60.0, 60.0), (70.0, 70.0, 70.0, 70.0))  # 60 s are 3 clusters, too
    results = tuple(map_with(*times[place]) for place in places)
    judged = cluster(tuple(tuple(runs[:2] for runs in of_map) for of_map in results))
    assert sorted(judged.scores) == [1.0, 2.0, 3.0]
    assert held_out(results, judged, cluster, 2, 3).order_kept == 0
    assert held_out(results, judged, cluster, 4, 3).order_kept == 0.5


@pytest.mark.parametrize(("maps", "repeats", "count"), [(3, 5, 125), (2, 2, 4), (6, 5, 25)])
def test_trials_are_all_combinations_up_to_a_limit(maps, repeats, count):
    results = tuple(map_with(*(20.0 + 10 * number + repeat for repeat in range(repeats))) for number in range(maps))
    trials = trials_of(results)
    assert len(trials) == len(set(map(repr, trials))) == count
    assert all(one[0] in singles_of(results[0]) for one in trials)


TIMES = st.sampled_from([20.0, 22.5, 30.0, 41.0, 96.0])
SLOWEST = st.lists(st.tuples(TIMES, st.sampled_from(["goal", "goal", "goal", "timeout"])), min_size=1, max_size=6)


def unsteady(runs):
    """A map on which two controllers always take 20 s, and the third has these times and outcomes."""
    steady = tuple(RunResult("goal", 20.0, 1.0) for _ in runs)
    return steady, steady, tuple(RunResult(outcome, time, 1.0) for time, outcome in runs)


@given(st.lists(SLOWEST, min_size=2, max_size=4), st.sampled_from(["exclude", "par2"]), st.sampled_from([0.0, 0.5]))
def test_trials_are_judged_as_sets_of_their_own(maps, failures, caution):
    fitness = Fitness.of(JudgingSettings(failures=failures, caution=caution), 150.0)
    results = tuple(map(unsteady, maps))
    assert judged_trials(results, fitness) == [fitness(one) for one in trials_of(results)]


def fastest(place, others):
    """A map on which one controller takes 20 s, and the two others these times."""
    times = [*others[:place], 20.0, *others[place:]]
    return tuple(tuple(RunResult("goal", time, 1.0) for _ in range(8)) for time in times)


def test_the_order_of_maps_does_not_count_where_the_fitness_knows_none():
    options = OPTIONS.replace(fitness="pairs")
    equal = {name: fastest(place, (30.0, 30.0)) for place, name in enumerate("abc")}
    weak = {f"weak{n}": fastest(0, (21.0 + n / 2, 22.0 + n)) for n in range(6)}
    assert set(selected(weak | equal, Fitness.of(options.judging, 150.0))) == {"a", "b", "c"}


def test_of_hundreds_of_maps_those_with_the_fewest_failures_are_eligible():
    often, once = map_with(*[20.0] * 3, outcome="timeout"), map_with(*[20.0] * 3)
    once = (*once[:2], (*once[2][:2], RunResult("timeout", 150.0, 1.0)))
    maps = {f"often{n}": often for n in range(200)} | {f"once{n}": once for n in range(20)}
    kept = few_enough(maps, 3)
    assert math.comb(len(kept), 3) <= MAX_SETS < math.comb(len(kept) + 1, 3)
    assert list(kept) == [name for name in maps if name in kept]
    assert sum(name.startswith("once") for name in kept) == 20
    assert few_enough(kept, 3) == kept


@pytest.mark.parametrize("elite_seeds", [2, 7])
def test_the_least_runs_allowed_suffice_to_validate_a_set(elite_seeds):
    stage = STAGE.replace(seeds=3, candidates=5, held_out_seeds=4)
    options = OPTIONS.replace(validation=stage, archive=True, elite_seeds=elite_seeds, pop_size=8, evaluations=8)
    options = options.replace(runs=8 * 3 * 3 + options.validation_runs(3))
    options.check_runs(3)
    with pytest.raises(ConfigError, match="runs: expected at least"):
        options.replace(runs=options.runs - 1).check_runs(3)
    archive = archive_of(how=lambda job: replace(answer(job), outcome="goal"))
    archive.evaluate(sets_of(8))
    expectations = Expectations(archive, lambda: FITNESS, 3)
    assert validate(expectations, FITNESS, stage, Budget(options, archive)) is not None
    assert archive.count <= options.runs


def test_where_too_few_maps_were_ever_solved_the_others_join_them():
    never = map_with(*[20.0] * 5, outcome="timeout")
    assert set(selected({"never": never, "a": EQUAL, "b": APART})) == {"never", "a", "b"}


def test_a_map_that_fails_rarely_is_selected_where_the_set_stays_reliable():
    rarely = tuple(runs * 3 for runs in map_with(*[60.0] * 8))
    rarely = (*rarely[:2], (*rarely[2][:-1], RunResult("timeout", 150.0, 1.0)))
    steady = {name: tuple(runs * 3 for runs in of_map) for name, of_map in (("a", EQUAL), ("b", MIDDLE), ("c", APART))}
    assert "rarely" in selected({**steady, "rarely": rarely})
    often = (*rarely[:2], (*rarely[2][:-4], *[RunResult("timeout", 150.0, 1.0)] * 4))
    assert selected({**steady, "often": often}) == ("a", "b", "c")


def test_many_sets_with_a_strong_but_unreliable_map_do_not_crowd_out_the_reliable_ones():
    near = {f"near_{number}": map_with(*[28.0 + 0.05 * number] * 8) for number in range(15)}
    flat = {f"flat_{number}": map_with(*[20.0 + 0.05 * number] * 8) for number in range(15)}
    failed = replace(EQUAL[0][0], outcome="timeout")
    lucky = tuple((*runs, failed, failed) for runs in map_with(*[60.0] * 6))
    maps = {**flat, **near, "apart": APART, "lucky": lucky}
    names = selected(maps)
    assert "lucky" not in names
    assert "apart" in names
