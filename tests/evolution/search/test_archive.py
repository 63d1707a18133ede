"""The archive: what it drives, what it leaves out, and the best set it finds."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from evolution.driving import Evaluator, JobPlan, RunResult
from evolution.search.archive import Archive, best_by_exchange
from evolution.search.budget import runs_in
from evolution.search.judging import Fitness, JudgingSettings, is_solved, repeats_of
from evolution.search.operators.sampling import MapSampling
from evolution.search.staging import stages_of
from tests.evolution.fake_runs import CONTROLLERS, SMALL, WORLD


def answer(job):
    """Fail where the map is dense; else take longer on denser maps, and differently long with each seed."""
    share = float(job.scenario.map.occupancy.mean())
    slow = 3.0 if job.controller.registered_name == "mppi" else 1.0
    luck = np.random.default_rng(job.seed).uniform(0.9, 1.1)
    outcome = "timeout" if share > 0.25 and job.controller.name == "dwb" else "goal"
    return RunResult(outcome, (10.0 + slow * 100.0 * share) * luck, 1.0, seed=job.seed)


def unsteady(job):
    """Fail with one seed in six."""
    return replace(answer(job), outcome="timeout" if job.seed % 6 == 0 else "goal")


class Answers(Evaluator):
    """Answers jobs in this process, and keeps them."""

    def __init__(self, how=answer):
        super().__init__(how)
        self.how = how
        self.jobs = []

    def run(self, jobs):
        self.jobs += jobs
        return [self.how(job) for job in jobs]


def archive_of(staged=False, controllers=CONTROLLERS, how=answer):
    plan = JobPlan(controllers, WORLD)
    return Archive(Answers(how), plan, stages_of(plan) if staged else None)


def sets_of(count=4, seed=0):
    rng = np.random.default_rng(seed)
    return [MapSampling(3, SMALL).draw_set(rng) for _ in range(count)]


def test_every_map_is_driven_once_and_more_only_when_asked_for():
    archive, sets = archive_of(), sets_of()
    first = archive.evaluate(sets)
    assert archive.count == len(archive.evaluator.jobs) == 4 * 3 * 3
    assert archive.evaluate(sets[::-1]) == first[::-1]
    assert archive.count == 36
    digest = sets[0][0].map.digest
    archive.drive({digest: 3})
    assert archive.count == 36 + 2 * 3
    assert [len(runs) for runs in archive.results(digest)] == [3, 3, 3]
    seeds = [run.seed for runs in archive.results(digest) for run in runs]
    assert len(set(seeds)) == len(seeds)
    assert len(archive.take_new()) == 42
    assert archive.take_new() == []


def test_controllers_after_a_failure_do_not_run():
    archive = archive_of(staged=True)
    results = archive.evaluate(sets_of(12))
    maps = [of_map for one in results for of_map in one]
    unsolved = [of_map for of_map in maps if not of_map[0][0].success]
    assert 0 < len(unsolved) < len(maps)
    assert all((len(of_map[1]) == 0) == (of_map in unsolved) for of_map in maps)
    fitness = Fitness.of(JudgingSettings(), 150.0)
    whole = archive_of().evaluate(sets_of(12))
    for one, other in zip(results, whole, strict=True):
        left_out = sum(len(runs) == 0 for of_map in one for runs in of_map)
        assert fitness(one).success_rate == pytest.approx(fitness(other).success_rate - left_out / 9)
        if left_out == 0:
            assert fitness(one) == fitness(other)


def test_a_map_that_failed_once_is_not_driven_on():
    archive = archive_of(staged=True, how=unsteady)
    archive.evaluate(sets_of(12))
    archive.drive_while_solved(dict.fromkeys(archive.scenarios, 4))
    results = [archive.results(digest) for digest in archive.scenarios]
    solved = [of_map for of_map in results if is_solved(of_map)]
    assert 0 < len(solved) < len(results)
    assert all(repeats_of(of_map) == 4 for of_map in solved)
    for of_map in results:
        before = tuple(runs[: repeats_of(of_map) - 1] for runs in of_map)
        assert repeats_of(of_map) == 1 or is_solved(before)


def test_a_map_that_failed_once_can_be_driven_on():
    archive = archive_of(staged=True, how=unsteady)
    archive.evaluate(sets_of(12))
    archive.drive(dict.fromkeys(archive.scenarios, 2))
    failed = [name for name in archive.scenarios if archive.repeats_of(name) == 2 and not archive.is_solved(name)]
    digest = next(name for name in failed if len(set(archive.runs_of(name))) > 1)
    archive.drive_more(archive.missing({digest: 3}))
    assert archive.runs_of(digest) == (3, 3, 3)


def test_the_runs_that_maps_lack_are_counted_with_those_that_stages_left_out():
    archive = archive_of(staged=True)
    archive.evaluate(sets_of(12))
    twice = dict.fromkeys(archive.scenarios, 2)
    lacking, before = archive.missing(twice), archive.count
    assert {count for counts in lacking.values() for count in counts} == {1, 2}
    archive.drive_more(lacking)
    assert archive.count - before == runs_in(lacking)
    assert {archive.runs_of(name) for name in twice} == {(2, 2, 2)}
    assert runs_in(archive.missing(twice)) == 0


def test_controllers_can_get_different_numbers_of_further_runs():
    archive, sets = archive_of(), sets_of(2)
    archive.evaluate(sets)
    first, second = list(archive.scenarios)[:2]
    archive.drive_more({first: (0, 3, 1), second: (1, 0, 0)})
    archive.drive_more({first: (1, 1, 0)})
    assert archive.runs_of(first) == (2, 5, 2)
    assert archive.runs_of(second) == (2, 1, 1)
    assert archive.count == len(archive.evaluator.jobs) == 6 * 3 + 7
    assert [job.repeat for job in archive.evaluator.jobs[18:] if job.controller.name == "mppi"] == [1, 2, 3, 4]
    assert len({job.key for job in archive.evaluator.jobs}) == archive.count
    archive.drive_more({first: (3, 0, 3)})
    whole = archive_of()
    whole.evaluate(sets)
    whole.drive({first: 5})
    assert archive.results(first) == whole.results(first)


def test_sets_can_get_the_runs_that_stages_left_out():
    archive, sets = archive_of(staged=True), sets_of(12)
    archive.evaluate(sets)
    archive.complete(sets)
    assert archive.evaluate(sets) == archive_of().evaluate(sets)


@pytest.mark.parametrize("size", [2, 3, 4])
def test_the_best_set_is_one_of_solved_maps_that_no_exchange_improves(size):
    archive, fitness = archive_of(), Fitness.of(JudgingSettings(), 150.0)
    archive.evaluate(sets_of(8))
    solved = archive.solved()
    names = archive.best(fitness, size)
    assert set(names) <= set(solved)
    least = fitness(archive.results_of(archive.map_set(names))).fitness
    assert least == fitness(tuple(solved[name] for name in names)).fitness
    for gone in names:
        for new in set(solved) - set(names):
            changed = [new if name == gone else name for name in names]
            assert fitness(tuple(solved[name] for name in changed)).fitness >= least - 1e-9
    if size < 4:
        everything = (fitness(tuple(solved[name] for name in some)).fitness for some in combinations(solved, size))
        assert least == pytest.approx(min(everything))
    assert archive.best(fitness, len(solved) + 1) == ()


def test_a_map_is_judged_again_after_further_runs_and_by_another_fitness():
    archive, fitness = archive_of(), Fitness.of(JudgingSettings(caution=1.0), 150.0)
    archive.evaluate(sets_of(2))
    digest = next(name for name in archive.solved())
    once = archive.judged(digest, fitness)
    assert archive.judged(digest, fitness) is once
    assert once == fitness.judge_map(archive.results(digest))
    archive.drive({digest: 4})
    again = archive.judged(digest, fitness)
    assert again == fitness.judge_map(archive.results(digest)) != once
    other = Fitness.of(JudgingSettings(caution=2.0), 150.0)
    assert archive.judged(digest, other).spread == pytest.approx(2 * again.spread)
    assert archive.judged(digest, fitness) == again


def test_exchange_ends_where_there_is_nothing_to_exchange():
    archive = archive_of()
    archive.evaluate(sets_of(1))
    solved = archive.solved()
    assert best_by_exchange(tuple(solved), solved, len) == tuple(solved)


def test_maps_that_do_not_go_on_get_no_further_stage():
    archive, sets = archive_of(staged=True), sets_of(6)
    digests = [one.world_digest for map_set in sets for one in map_set]
    asked = []

    def every_other(names):
        asked.append(list(names))
        return [name for name in names if digests.index(name) % 2]

    archive.evaluate(sets, every_other)
    assert set(asked[0]) <= set(digests)
    assert len(asked) == 2
    for place, digest in enumerate(digests):
        runs = [len(some) for some in archive.results(digest)]
        assert runs == ([0, 0, 1] if place % 2 == 0 else runs)
        assert archive.is_solved(digest) <= bool(place % 2)
    assert any(archive.is_solved(digest) for digest in digests)
    assert set(archive.all_results()) == set(digests)


def test_a_map_without_runs_is_not_solved():
    archive, (one,) = archive_of(), sets_of(1)
    archive.scenarios |= {scenario.world_digest: scenario for scenario in one}
    archive._runs |= {scenario.world_digest: [[], [], []] for scenario in one}
    assert archive.solved() == archive.all_results() == {}
