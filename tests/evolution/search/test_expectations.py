"""What a search expects of maps and sets, the further seeds that follow from it, and the offspring of the archive."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from evolution.driving import RunResult
from evolution.search.algorithms.archive_mating import ArchiveMating
from evolution.search.archive import Archive
from evolution.search.budget import Budget
from evolution.search.elite import race
from evolution.search.expectations import Expectations
from evolution.search.judging import Fitness, JudgingSettings, scores_of
from evolution.search.operators import MapMutation, MapSampling, MutationSettings, Mutator
from evolution.search.sections import ValidationSettings
from evolution.search.settings import EvolveSettings
from evolution.search.validation_stage import validate
from tests.evolution.fake_runs import CONTROLLERS, SMALL, WAFFLE
from tests.evolution.search.test_archive import Answers, archive_of, sets_of

FITNESS = Fitness.of(JudgingSettings(aggregate="median"), 150.0)


def answer(job):
    """One controller is slower on some maps than on others, and on the slowest unsteady."""
    kind = int(job.scenario.map.digest[:2], 16) % 4
    luck = np.random.default_rng(job.seed).normal()
    slow = (21.0, 30.0, 45.0, 60.0 + 15.0 * luck)[kind] + int(job.scenario.map.digest[2:4], 16) / 100
    return RunResult("goal", max(slow, 20.0) if job.controller.registered_name == "mppi" else 20.0, 1.0, seed=job.seed)


def expectations_of(fitness=FITNESS, sets=12, how=answer):
    """Expectations of the maps of some sets with one run of each controller."""
    archive = Archive(Answers(how), archive_of().plan)
    archive.evaluate(sets_of(sets) if sets else [])
    expectations = Expectations(archive, lambda: fitness, 3)
    expectations.update()
    return expectations


def order_kept(archive, names):
    """The share of many trials in which the maps keep the order of their scores."""
    archive.drive(dict.fromkeys(names, 60))
    scores = sorted((scores_of(archive.results(name), FITNESS) for name in names), key=np.mean)
    return np.mean([a < b < c for a, b, c in zip(*(some[6:] for some in scores), strict=True)])


def test_the_best_expected_set_keeps_its_order_more_often_than_the_fittest():
    expectations = expectations_of()
    archive = expectations.archive
    archive.drive(dict.fromkeys(list(archive.scenarios)[::2], 6))
    expectations.update()
    fittest, chosen = archive.best(FITNESS, 3), expectations.best
    assert order_kept(archive, chosen) > order_kept(archive, fittest) + 0.1


def test_no_exchange_of_a_map_improves_the_best_expected_set():
    expectations = expectations_of(sets=4)
    least = expectations.value_of(expectations.best)
    for role, name in ((role, name) for role in range(3) for name in expectations.archive.solved()):
        assert expectations.value_in(role, name) >= least - 1e-9
    assert [expectations.value_in(role, name) for role, name in enumerate(expectations.best)] == [least] * 3
    assert expectations.value_in(1, expectations.best[0]) == np.inf
    scores = [expectations.estimates[name].score for name in expectations.best]
    assert scores == sorted(scores)
    bars = expectations.bars(expectations.known)
    assert all(bar >= least for bar in bars)
    assert expectations.bars([]) == [np.inf] * 3
    assert bars[1] == min(value for name in expectations.archive.solved() if (value := _other(expectations, name)))


def _other(expectations, name):
    """What the set is worth with another map in the middle."""
    return expectations.value_in(1, name) if name not in expectations.best else np.inf


def test_without_enough_solved_maps_there_is_no_best_set():
    assert expectations_of(sets=0).best == ()


def test_the_controller_that_differs_most_between_maps_comes_first():
    expectations = expectations_of()
    names = [spec.registered_name for spec in expectations.archive.plan.controllers]
    assert names[expectations.most_different_first()[0]] == "mppi"


def test_a_map_with_one_repeat_is_hoped_to_be_steady():
    expectations = expectations_of()
    archive = expectations.archive
    archive.drive(dict.fromkeys(list(archive.scenarios)[::2], 6))
    expectations.update()
    potentials, best = expectations.potentials(), expectations.value_of(expectations.best)
    assert set(potentials) == set(archive.solved())
    once = [name for name in potentials if archive.repeats_of(name) == 1]
    assert min(potentials[name] for name in once) < best
    for name, potential in potentials.items():
        values = [expectations.value_in(role, name) for role in range(3)]
        assert potential <= min(values) + 1e-9


def test_a_role_gets_a_share_by_what_a_map_might_gain_in_it():
    expectations = expectations_of()
    archive = expectations.archive
    archive.drive(dict.fromkeys(list(archive.scenarios)[::2], 6))
    expectations.update()
    shares = expectations.shares_of_roles()
    assert sum(shares) == pytest.approx(1.0)
    assert min(shares) >= 0.1 / 3
    assert min(shares) == shares[0]  # a set can hardly be better by another flat map


def test_candidates_are_the_best_set_and_the_best_maps_of_the_roles():
    expectations = expectations_of()
    eight = expectations.candidates(8)
    assert eight[:3] == list(expectations.best)
    assert len(set(eight)) == 8
    best_in = [[name for name in expectations.ranked(role) if name not in expectations.best] for role in range(3)]
    assert all(any(name in of_role[:6] for of_role in best_in) for name in eight[3:])
    assert expectations.candidates(4) == eight[:4]
    assert set(expectations.candidates(20, eight)) == set(eight)
    assert set(expectations.candidates(1000)) == set(expectations.known)


def test_maps_with_a_failed_repeat_are_known_if_their_first_runs_reached_the_goal():
    def once(job):
        run = answer(job)
        fails = job.repeat == 2 and int(job.scenario.map.digest[:2], 16) % 4 == 3
        return replace(run, outcome="timeout") if fails else run

    expectations = expectations_of(how=once)
    archive = expectations.archive
    before = dict(expectations.estimates)
    archive.drive_more(archive.missing(dict.fromkeys(archive.scenarios, 4)))
    expectations.update()
    failed = [name for name in archive.scenarios if not archive.is_solved(name)]
    assert failed
    assert set(failed) <= set(expectations.known)
    steady = [expectations.estimates[name].success for name in archive.solved()]
    for name in failed:
        assert expectations.estimates[name].success < min(before[name].success, *steady)


def test_racing_gives_most_runs_to_the_maps_that_matter():
    options = EvolveSettings(archive=True, elite_seeds=2)
    expectations = expectations_of()
    archive = expectations.archive
    for _ in range(12):
        before = archive.count
        race(expectations, Budget(options, archive))
        assert archive.count - before <= 2 * 3 * 3
    repeats = {name: archive.repeats_of(name) for name in archive.scenarios}
    assert max(repeats.values()) == 5
    assert list(repeats.values()).count(1) > 3
    assert min(map(archive.repeats_of, expectations.best)) >= 3 > np.mean(list(repeats.values()))


def test_racing_keeps_to_the_budget():
    options = EvolveSettings(archive=True, elite_seeds=2, runs=72 + 8, pop_size=8, evaluations=8)
    expectations = expectations_of(sets=8)
    archive = expectations.archive
    assert archive.count == 72
    race(expectations, Budget(options, archive))
    assert archive.count == 72 + 6  # two maps, three controllers


def mating_of(expectations, adaptive=True):
    """Offspring of an archive, of random shapes."""
    settings = MutationSettings(probability=1.0, maps="one", adaptive=adaptive)
    mutation = MapMutation(Mutator(SMALL, settings, WAFFLE), (lambda map_set, place: place) if adaptive else None)
    return ArchiveMating(expectations, mutation, MapSampling(3, SMALL))


@pytest.mark.parametrize("adaptive", [True, False])
def test_an_offspring_is_the_best_set_with_one_new_map(adaptive):
    expectations = expectations_of()
    mating, best = mating_of(expectations, adaptive), set(expectations.best)
    offspring = [one.X[0] for one in mating.do(None, None, 40, random_state=np.random.default_rng(0))]
    assert len(offspring) == 40
    known = expectations.archive.scenarios
    for child in offspring:
        new = [one.world_digest for one in child if one.world_digest not in best]
        assert len(new) == 1
    parents = expectations.parents
    assert not set(parents) & set(known)
    assert 25 < len(parents) < 40  # the others are sampled
    assert set(parents.values()) <= set(known)
    assert len(set(parents.values()) - best) > 3
    assert bool(mating.mutation.trials) == adaptive
    assert all({one.world_digest for one in trial.before} == best for trial in mating.mutation.trials)


def test_parents_are_among_the_best_maps_of_a_role():
    expectations = expectations_of()
    mating = mating_of(expectations)
    mating.do(None, None, 40, random_state=np.random.default_rng(1))
    good = {name for role in range(3) for name in expectations.ranked(role)[:8]}
    assert set(expectations.parents.values()) <= good


def test_without_a_best_set_solved_maps_are_joined_by_sampled_ones():
    solvable = sorted(scenario.map.digest for map_set in sets_of(4) for scenario in map_set)[:2]

    def hard(job):
        run = answer(job)
        return run if job.scenario.map.digest in solvable else replace(run, outcome="timeout")

    expectations = expectations_of(sets=4, how=hard)
    children = mating_of(expectations).do(None, None, 5, random_state=np.random.default_rng(9))
    known = expectations.archive.scenarios
    for child in (one.X[0] for one in children):
        assert {one.map.digest for one in child} > set(solvable)
        assert sum(one.world_digest not in known for one in child) == 1


def test_the_same_seed_makes_the_same_offspring():
    found = []
    for _ in range(2):
        offspring = mating_of(expectations_of()).do(None, None, 8, random_state=np.random.default_rng(3))
        found.append([one.X[0].digest for one in offspring])
    assert found[0] == found[1]
    assert len(set(found[0])) == 8


def first_fails_somewhere(job):
    """The first controller fails on every third map, always; the others are quick."""
    first = job.controller.name == CONTROLLERS[0].name
    fails = first and int(job.scenario.map.digest[:2], 16) % 3 == 0
    return RunResult("timeout" if fails else "goal", 150.0 if fails else 20.0 + first, 1.0, seed=job.seed)


def test_maps_that_a_controller_fails_are_followed_where_failures_count():
    """``regret`` looks for them; maps without a value for a failed run leave them out."""
    counting = Fitness.of(JudgingSettings(fitness="regret", failures="par2", aggregate="median"), 150.0)
    expectations = expectations_of(counting, how=first_fails_somewhere)
    archive = expectations.archive
    failed = {name for name in archive.scenarios if not archive.is_solved(name)}
    assert failed
    assert failed < set(expectations.known)
    assert set(expectations.best) <= failed
    race(expectations, Budget(EvolveSettings(elite_seeds=2, elite=True, evaluations=100), archive))
    assert {name for name in archive.scenarios if archive.repeats_of(name) > 1} <= failed
    stage = ValidationSettings(candidates=4, seeds=2, held_out_seeds=2)
    options = EvolveSettings(validation=stage, fitness="regret", failures="par2", aggregate="median")
    found = validate(expectations, counting, stage, Budget(options, archive))
    assert {one.world_digest for one in found.map_set} <= failed
    assert found.judged.fitness == pytest.approx(found.result.fitness) == pytest.approx(-np.log(300.0 / 20.0))
    assert not failed & set(expectations_of(how=first_fails_somewhere).known)
