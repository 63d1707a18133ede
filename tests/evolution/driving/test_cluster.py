"""Runs on a Dask cluster: a real scheduler and worker processes on this machine."""

from __future__ import annotations

import contextlib
import json
import os
import queue
import signal
import subprocess
import sys
from concurrent.futures import Future
from pathlib import Path

import pytest

from evolution.driving.evaluator import Evaluator
from evolution.driving.executors import EXECUTORS
from evolution.files import software
from gym_mapbench.errors import ConfigError, RunError
from tests.evolution import fake_runs
from tests.evolution.driving.test_evaluator import jobs_of, plan_of
from tests.evolution.processes import PATIENCE, holds_soon
from tests.evolution.search.test_loop import reproducible_files, run

pytest.importorskip("distributed")

from distributed import Client

from evolution.driving.cluster import Call, batches, check_workers, chunk_size

ROOT = Path(__file__).resolve().parents[3]
SCHEDULER = ("-m", "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard")
WORKER = ("-m", "distributed.cli.dask_worker", "--nthreads", "1", "--no-dashboard")
OTHER_VERSION = (
    "-c",
    "import evolution.files.versions; evolution.files.versions.PACKAGE_VERSION = '0.0.0'; "
    "from distributed.cli.dask_worker import main; main()",
    "--nthreads=1",
    "--no-dashboard",
)


class Machines:
    """A scheduler and its workers, each a process with a log."""

    def __init__(self, path):
        self.path = path
        self.file = path / "scheduler.json"
        self.processes = {}
        self.start("scheduler", *SCHEDULER)
        assert holds_soon(self.has_scheduler), self.log("scheduler")

    def has_scheduler(self):
        """Whether the file that tells where the scheduler is was written to its end."""
        with contextlib.suppress(OSError, ValueError):
            return bool(json.loads(self.file.read_text()))
        return False

    def start(self, name, *command):
        with (self.path / f"{name}.log").open("w") as log:
            self.processes[name] = subprocess.Popen(
                [sys.executable, *command, "--scheduler-file", str(self.file)],
                stdout=log,
                stderr=log,
                cwd=self.path,
                env={**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), *sys.path])},
                start_new_session=True,
            )

    def add(self, name, *options):
        self.start(name, *WORKER, "--name", name, *options)

    def kill(self, name):
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self.processes[name].pid, signal.SIGKILL)
        self.processes[name].wait()

    def log(self, name):
        return (self.path / f"{name}.log").read_text()


@pytest.fixture(scope="module")
def machines(tmp_path_factory):
    """A scheduler and two workers: one with a nanny, as workers have by default, and one without."""
    found = Machines(tmp_path_factory.mktemp("machines"))
    found.add("with_nanny")
    found.add("alone", "--no-nanny")
    yield found
    for name in found.processes:
        found.kill(name)


@pytest.fixture(scope="module")
def client(machines):
    """Look at the cluster while others use it."""
    with Client(scheduler_file=str(machines.file), set_as_default=False) as client:
        client.wait_for_workers(2, timeout=PATIENCE)
        yield client


def executed(client):
    """Return how many chunks each worker has run, by name; one that was killed may not be forgotten yet."""
    found = client.run(lambda dask_worker: (dask_worker.name, dask_worker.state.executed_count), on_error="ignore")
    return dict(found.values())


@pytest.mark.slow
def test_the_same_files_though_a_worker_is_killed_and_another_comes(tmp_path, machines, client):
    run(tmp_path / "processes", executor="processes")
    seen = []

    def kill_and_add(job, _result, _left):
        seen.append(job.key)
        if len(seen) == 40:
            machines.kill("alone")
            machines.add("late")
            assert holds_soon(lambda: set(executed(client)) == {"with_nanny", "late"})

    address = client.scheduler.address
    run(
        tmp_path / "cluster",
        run_job=fake_runs.drive_slowly,
        executor=f"dask={address}",
        on_run=kill_and_add,
    )
    assert reproducible_files(tmp_path / "cluster") == reproducible_files(tmp_path / "processes")
    assert len(seen) == len(set(seen)) > 200
    assert all(executed(client).values())


@pytest.mark.slow
def test_a_worker_of_another_version_is_turned_away(machines, client):
    """One that comes during a search leaves; one that is there before it begins is named."""
    with Evaluator(fake_runs.drive, executor=f"dask={client.scheduler.address}") as evaluator:
        evaluator.run(jobs_of(plan_of("any")))
        machines.start("stranger", *OTHER_VERSION, "--no-nanny")
        machines.processes["stranger"].wait(PATIENCE)
        evaluator.run(jobs_of(plan_of("other")))
    line = f"refused: expected mapbench {software()['mapbench']}, got 0.0.0; install the same versions on all workers"
    assert line in machines.log("stranger")
    with pytest.raises(RunError, match=r"^worker tcp://a:1: expected numpy .*, got None; install the same"):
        check_workers({"tcp://a:1": {"mapbench": software()["mapbench"]}})
    with pytest.raises(RunError, match=r"^worker tcp://a:1: mapbench cannot be used there \(No module named 'x'\)"):
        check_workers({"tcp://a:1": ModuleNotFoundError("No module named 'x'")})


@pytest.mark.slow
def test_a_faulty_controller_costs_its_own_runs_on_a_cluster_of_this_machine():
    plan = plan_of("good", "raises", "kills", "leaves_a_child")
    reasons = []
    for executor in ("processes", "dask"):
        with Evaluator(fake_runs.misbehave, workers=2, retries=0, executor=executor) as evaluator:
            reasons.append([result.reason for result in evaluator.run(jobs_of(plan))])
    assert reasons[0] == reasons[1]
    assert reasons[1][1].startswith("ValueError: the costmap is upside down, fake_runs.py line ")
    assert reasons[1][2] == "the worker died (exit code -9)"
    with Evaluator(fake_runs.misbehave, timeout_s=1.0, retries=0, executor="dask") as evaluator:
        (result,) = evaluator.run(jobs_of(plan_of("hangs")))
    assert result.reason == "no answer within 1 s (--run-timeout)"


def test_workers_that_cannot_start_end_a_search_on_a_cluster():
    broken = Evaluator(fake_runs.drive, warm_up=fake_runs.broken_warm_up, executor="dask")
    with broken as evaluator, pytest.raises(RunError, match="workers cannot start: ImportError: no LLVM here"):
        evaluator.run(jobs_of(plan_of("any")))


@pytest.mark.parametrize(
    ("executor", "error", "message"),
    [
        ("dask=tcp://127.0.0.1:1", RunError, "tcp://127.0.0.1:1: no Dask scheduler answers there"),
        ("dask=here", ConfigError, "scheduler: expected tcp://HOST:PORT, got 'here'"),
        ("processes=tcp://127.0.0.1:1", ConfigError, "executor 'processes': takes no scheduler"),
    ],
)
def test_a_scheduler_that_is_none(executor, error, message, monkeypatch):
    monkeypatch.setattr("evolution.driving.cluster.CONNECT_SECONDS", 0.2)
    with Evaluator(fake_runs.drive, executor=executor) as evaluator, pytest.raises(error, match=message):
        evaluator.run(jobs_of(plan_of("any")))


def test_what_to_install_is_said(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    assert "dask" in EXECUTORS
    with (
        Evaluator(fake_runs.drive, executor="dask") as evaluator,
        pytest.raises(ConfigError, match=r"pip install 'gym-mapbench\[distributed\]'"),
    ):
        evaluator.run(jobs_of(plan_of("any")))


def test_chunks_take_half_a_second_but_leave_work_for_all():
    assert chunk_size(1000, 2, seconds_per_call=0.15) == 4
    assert chunk_size(1000, 2, seconds_per_call=3.0) == 1
    assert chunk_size(8, 2, seconds_per_call=0.001) == 1
    assert chunk_size(80, 2, seconds_per_call=0.001) == 10
    assert chunk_size(7, 0, seconds_per_call=0.15) == 2


def test_calls_that_come_together_are_one_batch():
    calls = queue.SimpleQueue()
    for _ in range(3):
        calls.put(Call(int, Future()))
    found = batches(calls)
    assert len(next(found)) == 3
    calls.put(Call(int, Future()))
    calls.put(None)
    assert [len(batch) for batch in found] == [1]
