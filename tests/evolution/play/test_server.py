"""The command: it serves one address, and leaves no process behind."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request
from contextlib import contextmanager

import pytest

from evolution.cli import main

COMMAND = [sys.executable, "-m", "evolution", "play", "--no-browser", "--controllers", "rpp", "--workers", "1"]


@contextmanager
def playing(*options):
    """Yield the process and the address of a playground."""
    with subprocess.Popen([*COMMAND, *options], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            yield process, process.stdout.readline().strip()
        finally:
            process.kill()


def children_of(pid):
    """Return the numbers of the processes that a process has started, and those of their children."""
    own = subprocess.run(["ps", "-o", "pid=", "--ppid", str(pid)], capture_output=True, text=True, check=False)
    pids = [int(one) for one in own.stdout.split()]
    return pids + [inner for one in pids for inner in children_of(one)]


def wait_for_end(pids):
    """Wait until processes have ended; returns those that have not."""
    for _ in range(100):
        left = [pid for pid in pids if os.path.exists(f"/proc/{pid}")]
        if not left:
            return []
        time.sleep(0.1)
    return left


@pytest.mark.slow
@pytest.mark.skipif(not os.path.exists("/proc"), reason="looks into /proc")
@pytest.mark.parametrize(
    ("how", "code"), [(signal.SIGINT, 0), (signal.SIGTERM, -signal.SIGTERM), (signal.SIGKILL, -signal.SIGKILL)]
)
def test_a_playground_that_ends_leaves_no_process(how, code):
    with playing() as (process, address):
        assert urllib.request.urlopen(f"{address}state", timeout=30).status == 200
        children = children_of(process.pid)
        process.send_signal(how)
        assert process.wait(20) == code
        assert children
        assert wait_for_end(children) == []


def test_the_server_answers_only_this_machine_and_only_with_the_token():
    with playing() as (_, address):
        assert address.startswith("http://127.0.0.1:")
        with pytest.raises(urllib.error.HTTPError, match="403"):
            urllib.request.urlopen(f"{address.rsplit('/', 2)[0]}/state", timeout=30)
        with pytest.raises(urllib.error.HTTPError, match="403"):
            urllib.request.urlopen(
                urllib.request.Request(f"{address}state", headers={"Host": "evil.example"}), timeout=30
            )


@pytest.fixture
def never_serves(monkeypatch):
    """A test fails, instead of waiting, if a server starts."""

    def serve(_server, sockets):
        raise AssertionError(f"serves on {sockets}")

    monkeypatch.setattr("uvicorn.Server.run", serve)


@pytest.mark.usefixtures("never_serves")
@pytest.mark.parametrize(
    ("options", "problem"),
    [
        (["--host", "no.such.host.invalid"], "--host no.such.host.invalid"),
        (["--port", "70000"], "--port: expected 0 to 65535"),
        (["nothing.yaml"], "nothing.yaml"),
        (["--controllers", "nobody"], "nobody"),
        (["--params", "thesys"], "thesys"),
    ],
)
def test_a_mistake_is_one_line(options, problem, capsys):
    assert main(["play", "--no-browser", *options]) == 2
    error = capsys.readouterr().err
    assert problem in error.splitlines()[-1]
    assert "Traceback" not in error


@pytest.mark.usefixtures("never_serves")
def test_a_port_in_use_is_one_line(capsys):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        assert main(["play", "--no-browser", "--port", str(taken.getsockname()[1])]) == 2
    assert "cannot be listened on" in capsys.readouterr().err


def test_runs_end_at_the_time_limit_of_the_command(monkeypatch):
    begun = []
    monkeypatch.setattr("evolution.commands.play.serve", lambda beginning, **_: begun.append(beginning))
    assert main(["play", "--no-browser", "--time-limit", "40"]) == 0
    assert begun[0].given.environment.time_limit == 40.0
