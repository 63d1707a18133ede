"""The store of results: locked by others, and copied after its file was deleted."""

from __future__ import annotations

import json
import os
import sqlite3
import subprocess
import sys
import threading
import time
from contextlib import closing

import numpy as np
import pytest

from evolution.driving import WAIT_SECONDS, ResultStore, RunResult
from evolution.files.locks import LOCKS
from gym_mapbench.errors import RunError
from tests.evolution.processes import PATIENCE

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
    who = f"process {holder.pid} \\(" if LOCKS.is_file() else "another process"
    began = time.monotonic()
    with pytest.raises(RunError, match=f"results.sqlite: locked by {who}.* wait longer than 0.2 s with --wait"):
        ResultStore(tmp_path / "results.sqlite", wait_s=0.2)
    assert time.monotonic() - began < WAIT_SECONDS


def test_a_store_that_is_locked_for_a_while_is_waited_for(holder, tmp_path):
    assert holder.stdin is not None
    threading.Timer(1.0, holder.stdin.close).start()
    with ResultStore(tmp_path / "results.sqlite", wait_s=PATIENCE) as store:
        store.put("other", RunResult("goal", 1.0, 2.0))
        assert len(store) == 2


RESULT = RunResult("goal", 1.5, 2.0, metrics={"min_clearance": 0.2}, timings={"controller_ms": 0.1}, seed=7)


def with_row(path, text, key="key"):
    """Write a row as somebody else may have."""
    with ResultStore(path):
        pass
    with closing(sqlite3.connect(path)) as database, database:
        database.execute("INSERT OR REPLACE INTO results VALUES (?, ?)", (key, text))


def row_of(path):
    with closing(sqlite3.connect(path)) as database:
        return database.execute("SELECT result FROM results").fetchone()[0]


def test_no_bit_of_a_row_can_change_unnoticed(tmp_path):
    with ResultStore(tmp_path / "a") as store:
        store.put("key", RESULT)
        assert store.get("key") == RESULT
    text = row_of(tmp_path / "a").encode()
    with_row(tmp_path / "b", "")
    with ResultStore(tmp_path / "b") as store, closing(sqlite3.connect(tmp_path / "b")) as database:
        database.execute("PRAGMA synchronous = OFF")
        for bit in np.random.default_rng(0).choice(8 * len(text), 150, replace=False):
            flipped = bytearray(text)
            flipped[bit // 8] ^= 1 << bit % 8
            with database:
                database.execute("UPDATE results SET result = ?", (flipped.decode(errors="replace"),))
            with pytest.raises(RunError, match="row 'key': expected a run's result"):
                store.get("key")


def test_a_row_that_was_moved_to_another_key_is_noticed(tmp_path):
    with ResultStore(tmp_path / "a") as store:
        store.put("key", RESULT)
    with_row(tmp_path / "a", row_of(tmp_path / "a"), "other")
    with ResultStore(tmp_path / "a") as store, pytest.raises(RunError, match="its checksum is wrong"):
        store.get("other")


def test_rows_of_earlier_versions_are_read(tmp_path):
    with_row(tmp_path / "a", RESULT.to_json())
    with ResultStore(tmp_path / "a") as store:
        assert store.get("key") == RESULT


@pytest.mark.parametrize(
    "values",
    [
        {"outcome": 1},
        {"outcome": "won"},
        {"time_s": "long"},
        {"time_s": None},
        {"metrics": [1]},
        {"metrics": {"a": "b"}},
        {"timings": 3},
        {"seed": 1.5},
        {"reason": ["x"]},
        {"unknown": 1},
    ],
)
def test_wrong_types_in_a_row_are_named(tmp_path, values):
    with_row(tmp_path / "a", json.dumps({**vars(RESULT), **values}))
    with ResultStore(tmp_path / "a") as store, pytest.raises(RunError, match=next(iter(values))) as caught:
        store.get("key")
    assert str(caught.value).isprintable()


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


def test_a_full_disk_is_no_fault_of_the_file(tmp_path):
    program = (
        "import resource, signal, sys; from pathlib import Path; from evolution.driving import ResultStore\n"
        "signal.signal(signal.SIGXFSZ, signal.SIG_IGN); resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))\n"
        "ResultStore(Path(sys.argv[1]))"
    )
    command = [sys.executable, "-c", program, str(tmp_path / "results.sqlite")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert "results.sqlite: cannot be read or written (disk I/O error)" in done.stderr


def test_runs_that_ended_in_an_error_are_found(tmp_path):
    with ResultStore(tmp_path / "results.sqlite") as store:
        for number, outcome in enumerate(["goal", "error", "timeout", "error"]):
            store.put(f"key_{number}", RunResult(outcome, 0.0, 0.0, reason=f"reason {number}"))
        assert store.errors() == ["reason 1", "reason 3"]
        known = len(store)
        store.forget_errors()
        assert (store.errors(), len(store)) == ([], known - 2)


def test_an_error_is_one_of_the_outcome_however_the_row_is_written(tmp_path):
    with ResultStore(tmp_path / "results.sqlite") as store:
        store.put("goal", RunResult("goal", 0.0, 0.0, reason='"error"', metrics={"error": 1.0}))
    with closing(sqlite3.connect(tmp_path / "results.sqlite", isolation_level=None)) as database:
        row = {"reason": "the worker died", "path_length_m": 0.0, "time_s": 0.0, "outcome": "error"}
        database.execute("INSERT INTO results VALUES (?, ?)", ["other", json.dumps(row)])
    with ResultStore(tmp_path / "results.sqlite") as store:
        assert store.errors() == ["the worker died"]
