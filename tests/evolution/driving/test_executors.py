"""Anything with the interface of concurrent.futures.Executor drives, to the same results."""

from __future__ import annotations

import sys
from concurrent.futures import BrokenExecutor, Executor, Future

import pytest

from evolution.driving.evaluator import Evaluator
from evolution.driving.executors import EXECUTORS
from evolution.driving.jobs import JobPlan
from gym_mapbench.errors import ConfigError, PluginError, RunError
from tests.evolution import fake_runs
from tests.evolution.driving.test_evaluator import jobs_of, map_sets, plan_of
from tests.evolution.fake_runs import CONTROLLERS, WORLD

PLAIN = "tests.evolution.fake_runs:plain_pool"


def test_a_plain_executor_gives_the_same_results():
    plan = JobPlan(CONTROLLERS, WORLD, root_seed=3)
    results = []
    for executor in ("processes", PLAIN):
        with Evaluator(fake_runs.drive, workers=2, executor=executor) as evaluator:
            sets = evaluator.evaluate(map_sets(2), plan)
        results.append([[[one.time_s for runs in of_map for one in runs] for of_map in one_set] for one_set in sets])
    assert results[0] == results[1]


def test_a_plain_executor_warms_its_workers_up():
    with Evaluator(fake_runs.tell_warmth, warm_up=fake_runs.touch_warm_up, executor=PLAIN) as evaluator:
        assert [result.reason for result in evaluator.run(jobs_of(plan_of("any")))] == ["yes"]


def test_a_dead_worker_takes_a_plain_pool_along_but_not_the_other_runs(tmp_path):
    plan = plan_of("good", "raises", "fails_once", mark=str(tmp_path / "mark"))
    with Evaluator(fake_runs.misbehave, workers=2, executor=PLAIN) as evaluator:
        good, raises, fails_once = evaluator.run(jobs_of(plan))
    assert good.outcome in ("goal", "timeout")
    assert raises.reason.startswith("ValueError: the costmap is upside down, fake_runs.py line ")
    assert fails_once.time_s == fake_runs.drive(jobs_of(plan)[-1]).time_s


def test_a_run_that_always_kills_its_worker_ends_a_search_on_a_plain_pool():
    with Evaluator(fake_runs.misbehave, executor=PLAIN) as evaluator, pytest.raises(RunError, match="workers die"):
        evaluator.run(jobs_of(plan_of("kills")))


def test_an_executor_that_cannot_be_made():
    with pytest.raises(ConfigError, match="unknown executor 'proceses'; did you mean 'processes'"):
        Evaluator(fake_runs.drive, executor="proceses")
    sundays = pytest.raises(
        PluginError, match=r"no_pool': OSError: the cluster is closed on Sundays, fake_runs.py line"
    )
    with Evaluator(fake_runs.drive, executor="tests.evolution.fake_runs:no_pool") as evaluator, sundays:
        evaluator.run(jobs_of(plan_of("any")))


def test_an_executor_that_is_none(monkeypatch):
    monkeypatch.setitem(EXECUTORS._entries, "forgotten", lambda setup: None)
    with (
        Evaluator(fake_runs.drive, executor="forgotten") as evaluator,
        pytest.raises(PluginError, match="executor 'forgotten': expected an Executor, got None"),
    ):
        evaluator.run(jobs_of(plan_of("any")))


class Answering(Executor):
    """An executor that answers every job in one way."""

    def __init__(self, answer):
        self.answer = answer

    def submit(self, *_job):
        return self.answer()

    def shutdown(self, *_args, **_options):
        pass


def full():
    raise ValueError("the queue is full")


def broken():
    raise BrokenExecutor("a worker died")


def finished(value):
    future = Future()
    future.set_result(value)
    return future


def cancelled():
    future = Future()
    future.cancel()
    future.set_running_or_notify_cancel()
    return future


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        (full, r"executor 'odd': ValueError: the queue is full, test_executors.py line \d+"),
        (lambda: sys.exit(0), r"executor 'odd': SystemExit: 0, test_executors.py line \d+"),
        (lambda: None, "executor 'odd': expected a Future of a job, got None"),
        (lambda: finished("goal"), "executor 'odd': expected the result of a run, got 'goal'"),
        (broken, "workers die before their first run"),
        (cancelled, "workers die before their first run"),
    ],
)
def test_an_executor_that_fails_is_one_line(monkeypatch, answer, message):
    monkeypatch.setitem(EXECUTORS._entries, "odd", lambda setup: Answering(answer))
    with (
        Evaluator(fake_runs.drive, executor="odd") as evaluator,
        pytest.raises((PluginError, RunError), match=message),
    ):
        evaluator.run(jobs_of(plan_of("any")))


def test_an_executor_that_cannot_be_stopped_costs_no_result(monkeypatch, caplog):
    class Unstoppable(Answering):
        def shutdown(self):
            """Take none of the arguments that every executor takes."""

    result = fake_runs.drive(jobs_of(plan_of("any"))[0])
    monkeypatch.setitem(EXECUTORS._entries, "odd", lambda setup: Unstoppable(lambda: finished(result)))
    with Evaluator(fake_runs.drive, executor="odd") as evaluator:
        assert len(evaluator.run(jobs_of(plan_of("any")))) == 1
    assert "executor 'odd': TypeError: " in caplog.text


def test_registered_in_a_script(monkeypatch):
    monkeypatch.setitem(EXECUTORS._entries, "plain", fake_runs.plain_pool)
    with Evaluator(fake_runs.drive, executor="plain") as evaluator:
        assert len(evaluator.run(jobs_of(plan_of("any")))) == 1
