"""A run directory that is deleted or moved while it is being filled: nothing is lost."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys

import pytest

from evolution.driving import Evaluator
from evolution.files.locks import LOCKS
from evolution.runs import RUN, RunDir, exclusive_store
from evolution.search import evolve
from gym_mapbench.errors import RunError
from tests.evolution import fake_study
from tests.evolution.fake_runs import IN_PROCESS
from tests.evolution.fake_study import read_experiment

SEARCH = {"pop_size": 4, "evaluations": 16, "seed": 3}


def run(path, on_generation=None):
    """Begin or continue a search of fake runs; returns the number of driven runs."""
    experiment = read_experiment({"search": SEARCH})
    rundir = RunDir.open(path) if RUN.holds(path) else RunDir.create(path, experiment)
    with (
        exclusive_store(RUN, rundir.path, 0.0) as store,
        Evaluator(fake_study.run_job, store, executor=IN_PROCESS) as evaluator,
    ):
        evolve(experiment, evaluator, rundir, on_generation=on_generation)
        return evaluator.driven


def files_of(path):
    names = [one for one in sorted(path.rglob("*")) if one.is_file() and not one.name.startswith(("timing", "results"))]
    return {str(one.relative_to(path)): one.read_bytes() for one in names}


@pytest.mark.parametrize(
    "vanish",
    [shutil.rmtree, lambda path: path.rename(path.with_name("moved")), lambda path: (path / RUN.mark).unlink()],
    ids=["deleted", "moved", "config deleted"],
)
def test_a_search_whose_directory_vanishes_is_continued_elsewhere(tmp_path, vanish):
    whole = run(tmp_path / "whole")

    def on_generation(progress):
        if progress.row["generation"] == 2:
            vanish(tmp_path / "gone")

    with pytest.raises(RunError, match=r"gone: was deleted or moved .* results so far are in .*gone-rescued-\d+"):
        run(tmp_path / "gone", on_generation)
    assert not RUN.holds(tmp_path / "gone")
    (rescued,) = tmp_path.glob("gone-rescued-*")
    assert 0 < run(rescued) < whole
    assert files_of(rescued) == files_of(tmp_path / "whole")


def test_a_directory_that_has_vanished_by_the_end_is_continued_elsewhere(tmp_path):
    path = RunDir.create(tmp_path / "gone", read_experiment({"search": SEARCH})).path
    with pytest.raises(RunError, match=r"results so far are in .*gone-rescued-\d+"), exclusive_store(RUN, path, 0.0):
        shutil.rmtree(path)
    (rescued,) = tmp_path.glob("gone-rescued-*")
    assert run(rescued) == run(tmp_path / "whole")


def test_other_errors_pass(tmp_path):
    def fail(_):
        raise RunError("something else")

    with pytest.raises(RunError, match=r"^something else$"):
        run(tmp_path / "run", fail)
    assert [path.name for path in tmp_path.iterdir()] == ["run"]


def test_a_link_is_not_written_through(tmp_path):
    run(tmp_path / "run")
    (tmp_path / "outside").write_text("precious")
    checkpoint = tmp_path / "run" / "checkpoint.json"
    checkpoint.unlink()
    checkpoint.symlink_to(tmp_path / "outside")
    RunDir.open(tmp_path / "run").write_checkpoint({})
    assert (tmp_path / "outside").read_text() == "precious"
    assert not checkpoint.is_symlink()


HOLD = """
import sys
from pathlib import Path
from evolution.files import locked
with locked(Path(sys.argv[1]), 0.0):
    print("locked", flush=True)
    sys.stdin.read()
"""


def test_whoever_comes_second_is_told_who_fills_the_directory(tmp_path):
    run(tmp_path)
    before = files_of(tmp_path)
    command = [sys.executable, "-c", HOLD, str(tmp_path / RUN.mark)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        process.stdout.readline()
        who = rf"process {process.pid} \(" if LOCKS.is_file() else "another process"
        with pytest.raises(RunError, match=rf"is being filled by {who}.*; try again when it has ended$"):
            run(tmp_path)
        process.kill()
    assert run(tmp_path) == 0
    assert files_of(tmp_path) == before


def test_a_directory_that_is_continued_has_nothing_of_a_killed_writer(tmp_path):
    run(tmp_path / "run")
    left = tmp_path / "run" / "maps" / ".a.json.0123abcd.part"
    left.parent.mkdir(exist_ok=True)
    left.touch()
    os.utime(left, (0, 0))
    run(tmp_path / "run")
    assert not left.exists()
