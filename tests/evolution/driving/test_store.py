"""The store of results: locked by others, and copied after its file was deleted."""

from __future__ import annotations

import os
import sqlite3
import subprocess
import sys
import threading
import time

import pytest

from evolution.driving import ResultStore, RunResult
from evolution.driving.locks import LOCKS
from gym_mapbench.errors import RunError

HOLD = """
import sqlite3, sys
database = sqlite3.connect(sys.argv[1], isolation_level=None)
database.execute("BEGIN EXCLUSIVE")
print("locked", flush=True)
sys.stdin.read()
"""


@pytest.fixture
def holder(tmp_path):
    """Another process that holds a store until its input is closed."""
    with ResultStore(tmp_path / "results.sqlite") as store:
        store.put("key", RunResult("goal", 1.0, 2.0))
    command = [sys.executable, "-c", HOLD, str(tmp_path / "results.sqlite")]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        process.stdout.readline()
        yield process
        process.kill()


def test_a_locked_store_says_who_holds_it_as_soon_as_told(holder, tmp_path):
    who = f"process {holder.pid} \\(.*sqlite" if LOCKS.is_file() else "another process"
    began = time.monotonic()
    with pytest.raises(RunError, match=f"results.sqlite: locked by {who}.* for 0.2 s; .*--wait"):
        ResultStore(tmp_path / "results.sqlite", wait_s=0.2)
    assert time.monotonic() - began < 5


def test_a_store_that_is_locked_for_a_while_is_waited_for(holder, tmp_path):
    assert holder.stdin is not None
    threading.Timer(1.0, holder.stdin.close).start()
    with ResultStore(tmp_path / "results.sqlite", wait_s=60) as store:
        store.put("other", RunResult("goal", 1.0, 2.0))
        assert len(store) == 2


def test_results_outlive_the_file(tmp_path):
    with ResultStore(tmp_path / "results.sqlite") as store:
        store.put("before", RunResult("goal", 1.0, 2.0))
        for path in tmp_path.iterdir():
            os.unlink(path)
        store.put("after", RunResult("timeout", 1.0, 2.0))
        store.copy_to(tmp_path / "copy.sqlite")
    with ResultStore(tmp_path / "copy.sqlite") as copy:
        assert [copy.get(name).outcome for name in ("before", "after")] == ["goal", "timeout"]


def test_other_errors_of_the_database_stay_what_they_are(tmp_path):
    (tmp_path / "a.sqlite").write_bytes(b"no database at all, but long enough for a header " * 20)
    with pytest.raises(RunError, match="not a result store"):
        ResultStore(tmp_path / "a.sqlite")
    with ResultStore(tmp_path / "b.sqlite") as store:
        sqlite3.connect(tmp_path / "b.sqlite").execute("DROP TABLE results")
        with pytest.raises(RunError, match=r"cannot be read \(no such table"):
            store.get("key")
