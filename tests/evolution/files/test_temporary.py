"""Temporary files: removed at the end, or by the next process after a kill."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time

import pytest

from evolution.files import temporary_directory

SCRIPT = """
import sys
from evolution.files import temporary_directory
print(temporary_directory(), flush=True)
sys.stdin.read()
"""


@pytest.fixture
def other(tmp_path):
    """Another process with a directory of its own, in which it left a file."""
    environment = {**os.environ, "TMPDIR": str(tmp_path)}
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen([sys.executable, "-c", SCRIPT], **pipes, text=True, env=environment) as process:
        directory = process.stdout.readline().strip()
        (tmp_path / directory / "left").write_text("over")
        os.utime(directory, (0, time.time() - 3600))
        yield process
        process.kill()


def start_in(folder, monkeypatch):
    """Do what a new process does."""
    monkeypatch.setattr("tempfile.tempdir", str(folder))
    temporary_directory.cache_clear()
    temporary_directory()
    temporary_directory.cache_clear()


@pytest.mark.skipif(os.name != "posix", reason="locks of POSIX")
def test_what_a_killed_process_left_is_removed_by_the_next(other, tmp_path, monkeypatch):
    start_in(tmp_path, monkeypatch)
    assert len(list(tmp_path.glob("*/left"))) == 1
    other.send_signal(signal.SIGKILL)
    other.wait()
    (tmp_path / "mapbench-mine.tmp").write_text("a file is nobody's directory")
    start_in(tmp_path, monkeypatch)
    assert (tmp_path / "mapbench-mine.tmp").is_file()
    assert not list(tmp_path.glob("*/left"))


def test_a_process_that_ends_leaves_nothing(other, tmp_path):
    other.communicate("")
    assert not list(tmp_path.iterdir())
