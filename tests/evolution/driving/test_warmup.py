"""What a worker loads before its first job: all that the run needs, and no drill that another worker is doing."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import threading
from pathlib import Path

import pytest

from evolution.driving import ControllerSpec, DriveSettings, JobPlan, preparation_of, warmup
from tests.evolution.processes import PATIENCE

ROOT = Path(__file__).resolve().parents[3]

LOADED = """
import gc, sys
from numba.core.dispatcher import Dispatcher
from evolution.driving import ControllerSpec, DriveSettings, JobPlan, run_job, warm_up
from gym_mapbench.mapio import load_scenarios

def loaded():
    kernels = [one for one in gc.get_objects() if isinstance(one, Dispatcher)]
    return {(one.py_func.__module__, one.py_func.__name__, str(types)) for one in kernels for types in one.signatures}

warm_up((sys.argv[1],), sys.argv[2])
before = loaded()
settings = DriveSettings(environment={"noise": "nominal"}, navigation=sys.argv[3])
(scenario, *_) = load_scenarios("examples/hall.yaml")
print(run_job(JobPlan((ControllerSpec(name=sys.argv[1]),), settings).jobs(scenario)[0]).outcome, loaded() - before)
"""


@pytest.mark.parametrize(
    ("kind", "release", "preset"),
    [("rpp", "humble", "fair"), ("dwb", "humble", "thesis"), ("mppi", "humble", "thesis")],
)
def test_a_run_needs_no_kernel_that_was_not_loaded_before(kind, release, preset):
    command = [sys.executable, "-c", LOADED, kind, release, preset]
    done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=ROOT)
    assert done.stdout.split(maxsplit=1) == ["goal", "set()\n"]


def test_only_what_the_controllers_need_is_loaded():
    settings = DriveSettings(navigation="jazzy")
    specs = [ControllerSpec(name=name) for name in ("slow", "shim_rpp", "rpp", "model.zip")]
    specs[0] = ControllerSpec(name="slow", kind="rpp")
    assert preparation_of([JobPlan(specs, settings)]).args == (((("rpp", "shim_rpp"), "jazzy"),),)


def test_several_worlds_are_prepared_for_together():
    """By names alone two controllers of the name ``mine`` would be one."""
    plans = [
        JobPlan(
            [ControllerSpec(name="mine", kind="rpp"), ControllerSpec(name="mppi")], DriveSettings(navigation="thesis")
        ),
        JobPlan([ControllerSpec(name="mine", kind="dwb")], DriveSettings(navigation="fair")),
        JobPlan([ControllerSpec(name="graceful")], DriveSettings(navigation="lyrical")),
    ]
    assert preparation_of(plans).args == (((("dwb", "mppi", "rpp"), "humble"), (("graceful",), "lyrical")),)


def test_a_drill_that_another_worker_does_is_done_later(monkeypatch, tmp_path):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    done, first_is_done = [], threading.Event()

    def drills():
        return {"slow": lambda: done.append("slow"), "quick": lambda: (done.append("quick"), first_is_done.set())}

    with warmup._claim("slow") as ours:
        assert ours
        other = threading.Thread(target=warmup._share, args=(drills(),))
        other.start()
        assert first_is_done.wait(PATIENCE)
        assert done == ["quick"]
    other.join()
    assert done == ["quick", "slow"]


def test_where_nothing_can_be_locked_every_drill_is_done(monkeypatch, tmp_path):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "nowhere"))
    done = []
    warmup._share({"one": lambda: done.append("one")})
    assert done == ["one"]
