from __future__ import annotations

import importlib
import os
import signal
import time
from pathlib import Path

import numpy as np
import pytest

from evolution import bench
from evolution.driving.evaluator import Evaluator
from evolution.driving.jobs import ControllerSpec, JobPlan, RunResult
from evolution.driving.pool import attempt
from evolution.driving.store import ResultStore
from evolution.search.operators.sampling import MapSampling
from gym_mapbench.errors import ConfigError, RunError
from tests.evolution import fake_runs
from tests.evolution.fake_runs import CONTROLLERS, SMALL, WORLD

OFFICE = Path(__file__).resolve().parents[3] / "examples" / "office.yaml"


def map_sets(count, seed=0):
    rng = np.random.default_rng(seed)
    return [MapSampling(3, SMALL).draw_set(rng) for _ in range(count)]


def plan_of(*names, **params):
    return JobPlan(tuple(ControllerSpec(name=name, params=params) for name in names), WORLD)


def jobs_of(plan, maps=1):
    return [job for map_set in map_sets(maps) for job in plan.jobs(map_set[0])]


def test_results_come_in_order_whatever_the_workers_do():
    plan = JobPlan(CONTROLLERS, WORLD, root_seed=3, repeats=2)
    sets = map_sets(4)
    expected = [
        tuple(
            tuple(
                tuple(fake_runs.drive(job).time_s for job in plan.jobs(scenario) if job.controller == controller)
                for controller in CONTROLLERS
            )
            for scenario in one
        )
        for one in sets
    ]
    for workers in (1, 2):
        with Evaluator(fake_runs.drive, workers=workers) as evaluator:
            results = evaluator.evaluate(sets, plan)
        times = [tuple(tuple(tuple(r.time_s for r in c) for c in m) for m in one) for one in results]
        assert times == expected
        assert evaluator.driven == 4 * 3 * 3 * 2


def test_running_workers_apply_a_function_to_jobs():
    jobs = jobs_of(plan_of("dwb", "mppi", "rpp"))
    here = [fake_runs.process_of(job) for job in jobs]
    with Evaluator(fake_runs.drive, workers=2) as evaluator:
        assert evaluator.map(fake_runs.process_of, jobs) == here
        evaluator.run(jobs)
        keys, processes = zip(*evaluator.map(fake_runs.process_of, iter(jobs)), strict=True)
        assert keys == tuple(job.key for job in jobs)
        assert os.getpid() not in processes
        assert evaluator.map(fake_runs.large_answer, jobs) == [fake_runs.large_answer(job) for job in jobs]
        assert (evaluator.driven, evaluator.reused) == (3, 0)


def test_nothing_is_driven_twice(tmp_path):
    plan = JobPlan(CONTROLLERS, WORLD)
    (one, other) = map_sets(2)
    seen = []

    def on_run(job, _result, left):
        seen.append((job, left))

    store = ResultStore(tmp_path / "results.sqlite")
    with store, Evaluator(fake_runs.drive, store, on_run=on_run) as evaluator:
        first = evaluator.evaluate([one, one, other], plan)
        assert evaluator.driven == len(store) == len({job.key for job, _ in seen}) == 18
        assert [left for _, left in seen] == list(range(17, -1, -1))
        again = evaluator.evaluate([other, one], plan)
        assert (evaluator.driven, evaluator.reused) == (18, 18)
    assert first == [again[1], again[1], again[0]]
    with ResultStore(tmp_path / "results.sqlite") as store, Evaluator(fake_runs.misbehave, store) as evaluator:
        assert evaluator.evaluate([one], plan) == [first[0]]
        assert evaluator.driven == 0


def test_a_faulty_controller_costs_its_own_runs_only(tmp_path):
    plan = plan_of("good", "raises", "kills", "exits", "wrong_type", "fails_once", mark=str(tmp_path / "mark"))
    with Evaluator(fake_runs.misbehave, workers=2, retries=1) as evaluator:
        results = dict(zip(plan.names, evaluator.run(jobs_of(plan)), strict=True))
    assert results["good"].outcome in ("goal", "timeout")
    assert results["good"].attempts == 1
    errors = {name: result for name, result in results.items() if name not in ("good", "fails_once")}
    assert {result.outcome for result in errors.values()} == {"error"}
    assert {result.attempts for result in errors.values()} == {2}
    assert errors["raises"].reason.startswith("ValueError: the costmap is upside down, fake_runs.py line ")
    assert errors["exits"].reason.startswith("SystemExit: 3, fake_runs.py line ")
    assert "the worker died" in errors["kills"].reason
    assert "expected a RunResult, got NoneType" in errors["wrong_type"].reason
    assert results["fails_once"].attempts == 2
    assert results["fails_once"].time_s == fake_runs.drive(jobs_of(plan)[-1]).time_s


def test_a_run_that_takes_too_long_is_tried_again_and_leaves_the_pool_usable():
    with Evaluator(fake_runs.misbehave, timeout_s=0.5) as evaluator:
        (result,) = evaluator.run(jobs_of(plan_of("hangs")))
        evaluator.retries = 1000  # on a busy machine another run may take as long, too
        (other,) = evaluator.run(jobs_of(plan_of("good")))
    assert (result.outcome, result.attempts) == ("error", 2)
    assert result.reason == "no answer within 0.5 s (--run-timeout)"
    assert other.outcome in ("goal", "timeout")


FAILING = """
import numpy as np

from controllers.base import Twist


class Controller:
    name = "failing"
    observation_keys = ("goal",)

    def reset(self, context):
        pass

    def act(self, observation):
        return Twist(*np.linalg.solve(np.zeros((2, 2)), np.ones(2)))


def plan(job):
    raise RuntimeError("lost" + "." * 500)
"""


def test_an_error_in_the_code_of_a_user_names_its_file_and_line(tmp_path, monkeypatch):
    (tmp_path / "failing.py").write_text(FAILING)
    monkeypatch.syspath_prepend(tmp_path)
    own = bench(OFFICE, ["failing:Controller"], time_limit=1.0, workers=1).rows[0]
    assert own["outcome"] == "error"
    assert own["reason"] == "LinAlgError: Singular matrix, failing.py line 15"
    job = jobs_of(plan_of("any"))[0]
    failing = importlib.import_module("failing")
    reason = attempt(failing.plan, job).reason
    assert reason.startswith("RuntimeError: lost...")
    assert reason.endswith(", failing.py line 19")
    assert len(reason) <= 300
    assert attempt(_refuse, job).reason == "ConfigError: no room"


def _refuse(job):
    raise ConfigError("no room")


def test_warm_up_runs_in_every_worker_and_its_failure_is_said():
    jobs = jobs_of(plan_of("any"), maps=4)
    with Evaluator(fake_runs.tell_warmth, warm_up=fake_runs.touch_warm_up) as evaluator:
        assert {result.reason for result in evaluator.run(jobs)} == {"yes"}
    cannot_start = pytest.raises(RunError, match=r"workers cannot start: ImportError: no LLVM here")
    with Evaluator(fake_runs.drive, warm_up=fake_runs.broken_warm_up) as evaluator, cannot_start:
        evaluator.run(jobs)


def test_workers_that_cannot_start_end_the_run_with_one_line(tmp_path, monkeypatch):
    (tmp_path / "vanishing.py").write_text("def drive(job):\n    return None\n")
    monkeypatch.syspath_prepend(tmp_path)
    vanishing = __import__("vanishing")
    (tmp_path / "vanishing.py").write_text("")
    with Evaluator(vanishing.drive) as evaluator, pytest.raises(RunError, match=r"workers cannot start: .*drive"):
        evaluator.run(jobs_of(plan_of("any")))


@pytest.fixture
def heard_interrupts():
    """Python's own answer to Ctrl-C, which a shell's background jobs are told to ignore."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("heard_interrupts")
def test_ctrl_c_stops_the_workers_and_keeps_what_is_finished():
    with Evaluator(fake_runs.drive) as evaluator:
        done = evaluator.run(jobs_of(plan_of("any")))
        evaluator.run_job = fake_runs.interrupt_parent
        began = time.monotonic()
        with pytest.raises(KeyboardInterrupt):
            evaluator.run(jobs_of(plan_of("other", parent=os.getpid())))
        assert time.monotonic() - began < evaluator.timeout_s
        assert len(evaluator.store) == 1
        assert evaluator.run(jobs_of(plan_of("any"))) == done


def test_bad_options_are_refused():
    for options in ({"workers": 0}, {"retries": -1}, {"timeout_s": 0.0}):
        with pytest.raises(ConfigError, match="evaluator: expected"):
            Evaluator(fake_runs.drive, **options)


def test_error_results_read_back_from_the_store():
    with ResultStore() as store:
        result = RunResult("error", 0.0, 0.0, "it broke", 2, {"a": 0.1}, {"b": 1e-9}, 7)
        store.put("key", result)
        store.put("key", RunResult("goal", 1.0, 1.0))
        assert store.get("key") == result
        assert store.get("other") is None
