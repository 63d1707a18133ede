"""The surrogate: what it predicts of maps of motifs by runs on similar maps, and what the search does with it."""

from __future__ import annotations

from dataclasses import replace
from unittest import mock

import numpy as np

from evolution.driving import RunResult
from evolution.search.algorithms.archive_mating import ArchiveMating
from evolution.search.archive import Archive
from evolution.search.expectations import Expectations
from evolution.search.judging import Fitness, JudgingSettings
from evolution.search.operators import MapMutation, MapSampling, MutationSettings, Mutator
from evolution.search.surrogate import Surrogate, point_of
from gym_mapbench.generator import FamilySpec, ShapeSettings, draw_from
from gym_mapbench.world.scenario import MapSet
from tests.evolution.fake_runs import SMALL, WAFFLE
from tests.evolution.search.test_archive import Answers, archive_of, sets_of

FITNESS = Fitness.of(JudgingSettings(aggregate="median"), 150.0)
SHAPES = ShapeSettings()


def draw_of(*specs):
    """What samples maps of some families."""
    return lambda rng, shapes: draw_from(rng, specs, shapes, WAFFLE)


GATES = FamilySpec(name="gates", options={"routes": ["diagonal"], "count": [2, 4]})
DRAW = draw_of(GATES)


def genes_of(scenario):
    return scenario.genome.genes["sections"][0]["shared"]


def slow_time(scenario):
    """MPPI is slow at a small pitch, 20 s at a large one."""
    return 20.0 + 200.0 * max(1.65 - genes_of(scenario)["pitch"], 0.0)


def answer(job):
    mppi = job.controller.registered_name == "mppi"
    luck = np.exp(0.3 * np.random.default_rng(job.seed).normal())
    time = min(slow_time(job.scenario) * luck, 149.0) if mppi and job.scenario.genome else 20.0
    return RunResult("goal", time, 1.0, seed=job.seed)


def scenarios_of(count, seed=0, draw=DRAW):
    rng = np.random.default_rng(seed)
    sampling = MapSampling(3, SHAPES, draw)
    return {one.world_digest: one for one in (sampling.draw(rng) for _ in range(count))}


def expectations_of(count=60, how=answer, surrogate=True, draw=DRAW, most=np.inf):
    archive = Archive(Answers(how), archive_of().plan)
    scenarios = scenarios_of(count, draw=draw).values()
    archive.evaluate([MapSet(tuple(one for one in scenarios if most == np.inf or slow_time(one) < most))])
    expectations = Expectations(archive, lambda: FITNESS, 3, Surrogate() if surrogate else None)
    expectations.update()
    return expectations


def mppi_of(expectations):
    names = [spec.registered_name for spec in expectations.archive.plan.controllers]
    return names.index("mppi")


def correlation(first, second):
    return np.corrcoef(np.argsort(np.argsort(first)), np.argsort(np.argsort(second)))[0, 1]


def test_estimates_come_nearer_to_the_expected_times_than_the_runs():
    with_surrogate, without = expectations_of(), expectations_of(surrogate=False)
    scenarios = with_surrogate.archive.scenarios
    truth = [slow_time(one) for one in scenarios.values()]
    place = mppi_of(with_surrogate)
    found = [[one.estimates[name].values[place] for name in scenarios] for one in (with_surrogate, without)]
    errors = [np.abs(np.log(values) - np.log(truth)).mean() for values in found]
    assert errors[0] < 0.85 * errors[1]


def test_a_new_map_is_predicted_by_the_runs_on_others():
    expectations = expectations_of()
    surrogate = Surrogate()
    surrogate.update(expectations.archive.scenarios, expectations.archive.all_results(), FITNESS)
    new = scenarios_of(40, seed=7)
    forecasts = surrogate.forecasts(new)
    assert set(forecasts) == set(new)
    predicted = [one.logarithms[mppi_of(expectations)].mean for one in forecasts.values()]
    assert correlation(predicted, [slow_time(one) for one in new.values()]) > 0.8


def test_what_is_kept_changes_no_forecast():
    """Too few maps for a fit of hyperparameters, which looks at how many maps there were before."""
    expectations = expectations_of()
    scenarios, results = expectations.archive.scenarios, expectations.archive.all_results()
    names, new = list(results)[:9], scenarios_of(4, seed=7)
    before = {name: tuple(runs[:1] for runs in results[name]) for name in names[:6]}
    kept, anew = Surrogate(), Surrogate()
    kept.update(scenarios, before, FITNESS)
    kept.forecasts(new)
    kept.forecasts({name: scenarios[name] for name in before})
    for surrogate in (kept, anew):
        surrogate.update(scenarios, {name: results[name] for name in names}, FITNESS)
    for asked in (new, {name: scenarios[name] for name in names}):
        assert kept.forecasts(asked) == anew.forecasts(asked)


def test_failures_nearby_make_a_map_less_likely_to_succeed():
    def fails(job):
        run = answer(job)
        return replace(run, outcome="timeout") if slow_time(job.scenario) > 60.0 and job.seed % 2 else run

    expectations = expectations_of(how=fails)
    surrogate = Surrogate()
    surrogate.update(expectations.archive.scenarios, expectations.archive.all_results(), FITNESS)
    new = scenarios_of(60, seed=7)
    forecasts = surrogate.forecasts(new)
    goals = {slow: [forecasts[name].goals for name in new if (slow_time(new[name]) > 65.0) == slow] for slow in (0, 1)}
    assert np.mean(goals[1]) < 0.85 < 0.9 < np.mean(goals[0])
    for forecast in forecasts.values():
        assert 0.0 <= forecast.estimate(FITNESS).success <= forecast.goals


def test_the_controller_whose_times_scatter_gets_the_further_runs():
    expectations = expectations_of()
    archive, place = expectations.archive, mppi_of(expectations)
    names = list(archive.scenarios)[:5]
    for _ in range(4):
        archive.drive_more({name: expectations.turn(name) for name in names})
        expectations.update()
    further = np.sum([archive.runs_of(name) for name in names], axis=0) - len(names)
    assert further.sum() == 4 * 5
    assert further[place] >= 14
    assert all(name in expectations.estimates for name in names)
    archive.drive_more({names[0]: tuple(5000 if one == place else 0 for one in range(3))})
    assert expectations.turn(names[0])[place] == 0  # at last less is known about another one
    assert sum(expectations.turn(names[0])) == 1


def test_without_a_surrogate_every_controller_gets_a_further_run():
    expectations = expectations_of(surrogate=False)
    assert {expectations.turn(name) for name in expectations.archive.scenarios} == {(1, 1, 1)}


def test_maps_without_motifs_are_estimated_by_their_parents_as_without_a_surrogate():
    sets = sets_of(6)
    archive = Archive(Answers(answer), archive_of().plan)
    archive.evaluate(sets)
    found = []
    for surrogate in (None, Surrogate()):
        expectations = Expectations(archive, lambda: FITNESS, 3, surrogate)
        expectations.update()
        found.append(expectations.estimates)
    assert found[0] == found[1]
    assert all(point_of(one) is None for map_set in sets for one in map_set)
    assert expectations.most_promising(list(sets[0]), 1, np.random.default_rng(0)) == 0


def test_a_metric_with_zeros_has_no_forecasts():
    expectations = expectations_of()
    results = expectations.archive.all_results()
    zeros = {
        name: tuple(tuple(replace(run, metrics={"n_recoveries": 0}) for run in runs) for runs in of_map)
        for name, of_map in results.items()
    }
    surrogate = Surrogate()
    counted = Fitness.of(JudgingSettings(metric="n_recoveries"), 150.0)
    surrogate.update(expectations.archive.scenarios, zeros, counted)
    assert surrogate.forecasts(expectations.archive.scenarios) == {}


def test_maps_of_other_families_routes_and_motifs_are_of_other_kinds():
    straight = FamilySpec(name="gates", options={"routes": ["straight"]})
    specs = [GATES, straight, FamilySpec(name="bends"), FamilySpec(name="sequences")]
    kinds = [{point_of(one).kind for one in scenarios_of(3, draw=draw_of(spec)).values()} for spec in specs]
    assert len(set.union(*kinds)) == sum(map(len, kinds)) >= 4
    rng = np.random.default_rng(0)
    scenario = MapSampling(3, SHAPES, DRAW).draw(rng)
    point = point_of(scenario)
    assert len(point.genes) == 1 + 1 + len(genes_of(scenario)) + 1


def mating_of(expectations):
    mutation = MapMutation(Mutator(SHAPES, MutationSettings(probability=1.0, maps="one"), WAFFLE))
    return ArchiveMating(expectations, mutation, MapSampling(3, SHAPES, DRAW))


def test_without_motifs_one_candidate_is_made_for_each_new_map():
    archive = Archive(Answers(answer), archive_of().plan)
    archive.evaluate(sets_of(6))
    expectations = Expectations(archive, lambda: FITNESS, 3, Surrogate())
    expectations.update()
    mating = ArchiveMating(
        expectations,
        MapMutation(Mutator(SMALL, MutationSettings(probability=1.0, maps="one"), WAFFLE)),
        MapSampling(3, SMALL),
    )
    with mock.patch.object(expectations, "most_promising", wraps=expectations.most_promising) as chosen:
        mating.do(None, None, 10, random_state=np.random.default_rng(0))
    assert {len(call.args[0]) for call in chosen.call_args_list} == {1}


def test_the_most_promising_maps_are_slower_than_mutations_of_the_same_parents():
    """On no map known so far does MPPI take more than 45 s on average; it would at a smaller pitch."""
    times = []
    for surrogate in (True, False):
        expectations = expectations_of(surrogate=surrogate, most=45.0)
        offspring = mating_of(expectations).do(None, None, 90, random_state=np.random.default_rng(1))
        new = [child[2] for (child,) in offspring.get("X") if child[2].world_digest not in expectations.best]
        assert len(new) > 10
        times.append(np.mean([slow_time(one) for one in new]))
    assert times[0] > times[1] + 5.0
