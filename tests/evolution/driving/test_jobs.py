"""Jobs: what makes them different, and what is measured on them."""

from __future__ import annotations

import time

import pytest

from evolution.driving import try_controllers
from evolution.driving.jobs import ControllerSpec, JobPlan
from evolution.search.experiment import Experiment
from evolution.search.settings import EvolveSettings
from gym_mapbench.errors import ConfigError
from tests.evolution.driving.test_evaluator import map_sets
from tests.evolution.fake_runs import WORLD

MINE = "tests.metrics.test_run_metrics:half_time"


def plan_of(*metrics):
    return JobPlan((ControllerSpec(name="dwb"),), WORLD, metrics=metrics)


def key_of(plan):
    return plan.jobs(map_sets(1)[0][0])[0].key


def hanging():
    time.sleep(600.0)


def test_a_constructor_that_hangs_is_left_behind(monkeypatch):
    """It would hold up the playground, or any command, before a worker and its time limit see it."""
    monkeypatch.setattr("evolution.driving.worker.BUILD_SECONDS", 0.1)
    name = f"{__name__}:hanging"
    with pytest.raises(ConfigError, match=f"controller '{name}': was not made within 0.1 s"):
        try_controllers([ControllerSpec(name="mine", kind=name)], WORLD)


def test_metrics_that_are_measured_anyway_change_nothing():
    assert plan_of("time", "spl", "spl").metrics == ()
    assert key_of(plan_of("time", "spl")) == key_of(plan_of())


def test_metrics_of_others_belong_to_the_job():
    assert plan_of("spl", MINE, MINE).metrics == (MINE,)
    assert key_of(plan_of(MINE)) != key_of(plan_of())
    assert plan_of(MINE).jobs(map_sets(1)[0][0])[0].metrics == (MINE,)


def test_the_metric_of_a_search_is_measured():
    search = EvolveSettings(metric=MINE)
    assert Experiment(search, (ControllerSpec(name="dwb"),), WORLD).plan.metrics == (MINE,)


def test_another_model_in_the_same_file_is_another_controller(tmp_path):
    """A training that goes on writes its best model into the same file; its stored runs are those of another one."""
    model = tmp_path / "best_model.zip"
    spec = ControllerSpec(name="learned", kind=str(model))

    def keys():
        plan = JobPlan((ControllerSpec(name="dwb"), spec), WORLD)
        return [job.key for job in plan.jobs(map_sets(1)[0][0])]

    model.write_bytes(b"first")
    first = keys()
    assert keys() == first
    model.write_bytes(b"second")
    second = keys()
    assert first[0] == second[0]
    assert first[1] != second[1]


def test_other_code_of_the_same_name_is_another_controller(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    code = tmp_path / "changing_code.py"

    def keys(text, planner="navfn"):
        code.write_text(text)
        mine = ControllerSpec(name="mine", kind="changing_code:Mine")
        world = WORLD.replace(navigation=WORLD.navigation.replace(planner={"name": planner}))
        return [job.key for job in JobPlan((ControllerSpec(name="dwb"), mine), world).jobs(map_sets(1)[0][0])]

    planners = "from gym_mapbench.planners import PLANNERS\nours = PLANNERS.get('navfn')\n"
    first, second = keys(planners), keys(f"{planners}# mended\n")
    assert first == keys(planners)
    assert (first[0] == second[0], first[1] == second[1]) == (True, False)
    first, second = keys(planners, "changing_code:ours"), keys(f"{planners}# mended\n", "changing_code:ours")
    assert first[0] != second[0]


def test_wrong_metrics():
    with pytest.raises(ConfigError, match="unknown metric 'tmie'; did you mean 'time'"):
        plan_of("tmie")
    with pytest.raises(ConfigError, match="metric 'outcome': expected another name"):
        plan_of("outcome")
