"""Worker processes: whatever happens to one of them costs the run it drives, and leaves nothing behind."""

from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
import sys
import textwrap
import time
from functools import partial
from pathlib import Path

import pytest

from evolution.driving.evaluator import Evaluator
from evolution.driving.pool import Processes, WorkerDiedError, process_start
from evolution.one_thread import ONE_THREAD
from tests.evolution import fake_runs
from tests.evolution.driving.test_evaluator import jobs_of, plan_of
from tests.evolution.processes import PATIENCE, holds_soon, is_gone

ROOT = Path(__file__).resolve().parents[4]


def drive_with(name):
    """Drive a controller with a fault between two without; returns the three results."""
    plan = plan_of("good", name, "last")
    with Evaluator(fake_runs.misbehave, workers=1) as evaluator:
        results = evaluator.run(jobs_of(plan))
    assert [results[0], results[2]] == [like(fake_runs.drive(job), results) for job in jobs_of(plan)[::2]]
    return results[1]


def like(result, others):
    """Return a result with the wall-clock values of the one of the same seed."""
    (same,) = [one for one in others if one.seed == result.seed]
    return type(result)(**{**vars(result), "timings": same.timings})


@pytest.mark.parametrize(
    ("name", "code"), [("exits_at_once", "0"), ("overflows", "-11"), ("kills", "-9"), ("closes_all", "")]
)
def test_a_dead_worker_is_seen_at_once(name, code):
    result = drive_with(name)
    assert result.outcome == "error"
    assert f"the worker died (exit code {code}" in result.reason


@pytest.mark.parametrize("name", ["leaves_a_child", "returns_twice", "prints"])
def test_a_child_that_is_left_behind_holds_nothing_up(name):
    assert drive_with(name).outcome in ("goal", "timeout")


def test_what_a_run_started_ends_with_it(tmp_path):
    with Evaluator(fake_runs.misbehave) as evaluator:
        evaluator.run(jobs_of(plan_of("tells_its_child", mark=str(tmp_path / "child"))))
        assert is_gone(int((tmp_path / "child").read_text()))


def test_workers_killed_before_their_first_run_are_replaced(tmp_path):
    warm_up = partial(fake_runs.die_at_first, tmp_path / "starts")
    with Evaluator(fake_runs.drive, warm_up=warm_up) as evaluator:
        (result,) = evaluator.run(jobs_of(plan_of("any")))
    assert result.attempts == 1
    assert (tmp_path / "starts").read_text() == "xxxxx"


def test_workers_get_ready_before_there_is_a_job(tmp_path):
    ready = tmp_path / "ready"
    with Evaluator(fake_runs.drive, warm_up=ready.touch) as evaluator:
        evaluator.get_ready()
        assert holds_soon(ready.exists)


@pytest.mark.slow
@pytest.mark.parametrize("server", ["starts with the first worker", "is a copy"])
def test_a_killed_parent_takes_its_workers_along(server):
    """Also a worker that holds Python's lock, and one that has left a copy of itself behind."""
    script = f"""
        import time
        from tests.evolution.fake_runs import misbehave
        from tests.evolution.driving.test_evaluator import jobs_of, plan_of
        from evolution.driving.pool import Processes, copy_for_workers

        if {server == "is a copy"}:
            copy_for_workers()
        pool = Processes(3, 600.0, int)
        jobs = jobs_of(plan_of("hangs", "holds_the_lock", "leaves_a_child_and_hangs"))
        futures = [pool.submit(misbehave, job) for job in jobs]
        while not all(future.running() for future in futures) or len(pool._workers) < 3:
            time.sleep(0.01)
        print(*(worker.process.pid for worker in pool._workers), flush=True)
        futures[0].result()
    """
    parent = subprocess.Popen([sys.executable, "-c", textwrap.dedent(script)], stdout=subprocess.PIPE, text=True)
    with parent:
        assert parent.stdout is not None
        workers = [int(pid) for pid in parent.stdout.readline().split()]
        time.sleep(0.5)  # until they are inside their runs
        parent.kill()
    left = [worker for worker in workers if not is_gone(worker)]
    for worker in left:
        os.kill(worker, signal.SIGKILL)
    assert len(workers) == 3
    assert not left


@pytest.mark.skipif(not os.path.exists("/proc"), reason="looks into /proc")
def test_a_fork_server_keeps_no_disk_from_being_unmounted(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    with Processes(1, 60.0, int) as pool:
        server = pool.submit(os.getppid).result()
        assert os.readlink(f"/proc/{server}/cwd") == "/"
        assert pool.submit(os.getcwd).result() == os.getcwd() != "/"


def test_a_fork_server_that_dies_is_replaced():
    with Processes(1, 60.0, int) as pool:
        server = pool.submit(os.getppid).result()
        os.kill(server, signal.SIGKILL)
        with pytest.raises(WorkerDiedError):
            pool.submit(time.sleep, 600).result()
        assert pool.submit(os.getppid).result() != server


@pytest.mark.slow
def test_workers_are_copies_of_a_command_as_it_was_at_its_start():
    """Until the fork server, itself a copy, dies; the next one is a new process."""
    script = """
        import os, signal, time
        from evolution.driving.pool import Processes, WorkerDiedError, copy_for_workers

        def seen():
            return pool.submit(os.getppid).result(), pool.submit(os.getenv, "STATE").result()

        os.environ["STATE"] = "as it was"
        copy_for_workers()
        os.environ["STATE"] = "changed"
        copy_for_workers()
        with Processes(1, 60.0, int) as pool:
            server, state = seen()
            print(os.getpgid(server) == server, state)
            os.kill(server, signal.SIGKILL)
            try:
                pool.submit(time.sleep, 600).result()
            except WorkerDiedError:
                print(seen()[0] == server, seen()[1])
        """
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(script)], capture_output=True, text=True, timeout=PATIENCE, check=False
    )
    assert done.stdout == "True as it was\nFalse changed\n", done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("given", [{}, {"OMP_NUM_THREADS": "3"}])
def test_a_worker_has_one_thread_unless_the_user_says_otherwise(given):
    script = """
        import os
        from threadpoolctl import threadpool_info
        from evolution.driving.pool import Processes

        with Processes(1, 60.0, int) as pool:
            blas = {one["num_threads"] for one in pool.submit(threadpool_info).result() if one["user_api"] == "blas"}
            print(pool.submit(os.getenv, "OMP_NUM_THREADS").result(), blas)
        """
    environment = {name: value for name, value in os.environ.items() if name not in ONE_THREAD}
    command = [sys.executable, "-c", textwrap.dedent(script)]
    printed = subprocess.check_output(command, env={**environment, **given}, text=True, timeout=PATIENCE)
    assert printed == f"{given.get('OMP_NUM_THREADS', '1')} {{1}}\n"


def test_a_copy_of_the_parent_has_a_fork_server_of_its_own():
    with Processes(1, 60.0, int) as pool:
        server = pool.submit(os.getppid).result()
        copy = multiprocessing.get_context("fork").Process(target=use_another_server, args=(server,))
        copy.start()
        copy.join()
        assert copy.exitcode == 0
        assert pool.submit(os.getppid).result() == server


def use_another_server(server):
    with Processes(1, 60.0, int) as pool:
        assert pool.submit(os.getppid).result() != server


def test_workers_where_no_process_can_copy_itself(monkeypatch):
    monkeypatch.setattr(process_start, "_start", process_start.start_interpreter)
    with Processes(1, 60.0, int) as pool:
        assert pool.submit(abs, -1).result() == 1
        assert pool.submit(os.getppid).result() == os.getpid()
        with pytest.raises(WorkerDiedError, match=r"exit code 7"):
            pool.submit(os._exit, 7).result()


@pytest.mark.slow
def test_workers_drive_with_the_modules_of_their_parent(tmp_path):
    """Whatever the current directory holds, as a clone of this repository does where another version is installed."""
    (tmp_path / "here" / "evolution").mkdir(parents=True)
    (tmp_path / "here" / "evolution" / "__init__.py").touch()
    script = tmp_path / "script.py"
    script.write_text(f"""
import sys
sys.path.insert(0, {str(ROOT)!r})
from evolution.driving.pool import Processes
from tests.evolution import fake_runs

with Processes(1, 60.0, int) as workers:
    print(workers.submit(fake_runs.file_of, "evolution").result())
""")
    command = [sys.executable, str(script)]
    done = subprocess.run(command, cwd=tmp_path / "here", capture_output=True, text=True, timeout=PATIENCE, check=False)
    assert done.stdout.strip() == str(ROOT / "evolution" / "__init__.py"), done.stderr
