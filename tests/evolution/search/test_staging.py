"""Staging: which runs are left out, and that no search notices."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from controllers import registry
from controllers.nav2_params import load_preset
from controllers.registry import relative_cost
from evolution.driving import ControllerSpec, Evaluator, JobPlan, RunResult
from evolution.search.experiment import Experiment
from evolution.search.judging import Fitness, JudgingSettings, missing_runs
from evolution.search.loop import evolve
from evolution.search.settings import EvolveSettings
from evolution.search.staging import contenders, next_stage, single_stage, stages_of
from gym_mapbench.errors import ConfigError
from tests.evolution.fake_runs import CONTROLLERS, SMALL, WORLD, drive

SEARCH = EvolveSettings(pop_size=6, evaluations=40, shapes=SMALL)
GOAL, FAILED, LATE = (RunResult(outcome, 10.0, 1.0) for outcome in ("goal", "collision", "timeout"))


class Failing(Evaluator):
    """Answers in this process; one run in seven fails, and the failures depend on the job alone."""

    def run(self, jobs):
        self.driven += len(jobs)
        return [self._answer(job) for job in jobs]

    def _answer(self, job):
        outcome = np.random.default_rng(job.seed).choice(["goal", "collision", "timeout"], p=[0.85, 0.1, 0.05])
        return replace(drive(job), outcome=str(outcome), timings={})


def search(**options):
    evaluator = Failing(drive)
    experiment = Experiment(SEARCH.replace(**options), CONTROLLERS, WORLD)
    return evolve(experiment, evaluator), evaluator.driven


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(
    "options",
    [
        {},
        {"fitness": "cluster", "repeats": 2},
        {"fitness": "roles", "algorithm": "random"},
        # All controllers drive the further seeds of the elite, so fewer runs are left out than without them.
        {
            "elite": True,
            "elite_seeds": 2,
            "mutation": {"maps": "one", "adaptive": True},
            "caution": 1.0,
            "pop_size": 10,
            "evaluations": 60,
        },
        {"fitness": "pairs", "elite": True, "aggregate": "median"},
    ],
)
def test_a_search_in_stages_finds_the_same_with_fewer_runs(options, seed):
    staged, fewer = search(seed=seed, **options)
    whole, all_runs = search(seed=seed, staged=False, **options)
    assert fewer < all_runs
    assert staged.record.generations == whole.record.generations
    assert [one.map_set.digest for one in staged.population] == [one.map_set.digest for one in whole.population]
    assert staged.best.results == whole.best.results
    assert staged.best.judgement == whole.best.judgement
    pairs = list(zip(staged.record.individuals, whole.record.individuals, strict=True))
    assert all(ours == theirs for ours, theirs in pairs if not ours["not_driven"])
    assert not any(theirs["not_driven"] for _, theirs in pairs)
    assert all(whole.record.runs[key]["outcome"] == row["outcome"] for key, row in staged.record.runs.items())


@pytest.mark.parametrize("failures", ["censor", "par2"])
def test_a_policy_that_gives_failed_runs_a_value_leaves_out_none(failures):
    assert search(failures=failures)[1] == search(failures=failures, staged=False)[1]


def test_the_cheapest_controller_runs_first():
    navigation = load_preset("thesis")
    costs = [relative_cost(name, navigation) for name in ("rpp", "graceful", "dwb", "mppi", "policy.zip")]
    assert costs == sorted(costs)
    assert relative_cost("shim_rpp", navigation) == relative_cost("rpp", navigation)


def test_a_cost_that_is_no_number_is_refused(monkeypatch):
    def costly():
        """Make a controller."""

    costly.relative_cost = "high"
    monkeypatch.setitem(registry.CONTROLLERS._entries, "costly", costly)
    with pytest.raises(ConfigError, match=r"^controller 'costly': expected relative_cost as a number, got 'high'$"):
        relative_cost("costly", load_preset("thesis"))
    named = (ControllerSpec(name="rpp", kind="mppi"), *CONTROLLERS[:1], ControllerSpec(name="mine", kind="rpp"))
    assert stages_of(JobPlan(named, WORLD)) == ((2,), (1,), (0,))
    assert single_stage(JobPlan(named, WORLD)) == ((0, 1, 2),)


def test_a_map_runs_until_its_first_failure():
    stages = ((2,), (0,), (1,))
    assert next_stage([[], [], []], stages, 1) == (2,)
    assert next_stage([[], [], [GOAL]], stages, 1) == (0,)
    assert next_stage([[], [], [FAILED]], stages, 1) == ()
    assert next_stage([[GOAL], [], [GOAL]], stages, 1) == (1,)
    assert next_stage([[GOAL], [FAILED], [GOAL]], stages, 1) == ()
    assert next_stage([[GOAL], [GOAL], [GOAL]], stages, 2) == (2,)
    assert next_stage([[FAILED], [], [FAILED]], ((0, 1, 2),), 1) == (0, 1, 2)
    assert next_stage([[], [FAILED], [GOAL]], stages, 1) == ()  # the second controller ran first then


class Erratic(Failing):
    """Any controller may be the slowest one on a map, and fails one run in three."""

    def _answer(self, job):
        rng = np.random.default_rng(job.seed)
        outcome = "goal" if rng.random() < 0.67 else "timeout"
        return replace(drive(job), outcome=outcome, time_s=float(rng.uniform(5.0, 100.0)), timings={})


@pytest.mark.parametrize("seed", range(6))
def test_stages_may_change_their_order_while_runs_fail(seed):
    options = {"elite": True, "elite_seeds": 1, "parents": True, "evaluations": 60, "seed": seed}
    found = evolve(Experiment(SEARCH.replace(**options), CONTROLLERS, WORLD), Erratic(drive))
    assert any(row["not_driven"] for row in found.record.individuals)


OF_MAP = st.one_of(
    st.tuples(*[st.sampled_from([(GOAL,), (replace(GOAL, time_s=20.0),), (FAILED,), (LATE,)])] * 3),
    st.tuples(st.sampled_from([(FAILED,), (LATE,)]), st.just(()), st.sampled_from([(), (GOAL,)])),
)


@given(st.tuples(OF_MAP, OF_MAP, OF_MAP), st.sampled_from(["gini", "cluster", "pairs"]), st.floats(0.0, 200.0))
def test_no_result_of_the_missing_runs_is_below_the_bound(results, name, cost):
    fitness = Fitness.of(JudgingSettings(fitness=name, base_cost=cost, cluster_scale=3.0), 150.0)
    missing = missing_runs(results)
    if missing > 4:
        return
    values = [fitness(_filled(results, list(runs))).fitness for runs in product([GOAL, FAILED, LATE], repeat=missing)]
    assert fitness.bound(results) == pytest.approx(min(values))
    assert all(fitness.bound(results) <= value + 1e-9 for value in values)


def _filled(results, runs):
    return tuple(tuple(one or (runs.pop(),) for one in of_map) for of_map in results)


def test_only_sets_that_may_survive_get_their_missing_runs():
    fitness = Fitness.of(JudgingSettings(), 150.0)
    slow = ((GOAL,), (replace(GOAL, time_s=30.0),), (GOAL,))
    unsolved = ((), (), (FAILED,))
    partial = (((GOAL,),) * 3, slow, unsolved)
    least = fitness.bound(partial)
    assert contenders([partial], fitness, [least - 1.0, least - 2.0], 2) == []
    assert contenders([partial], fitness, [least, least - 2.0], 2) == [0]
    assert contenders([partial], fitness, [least - 1.0], 2) == [0]
