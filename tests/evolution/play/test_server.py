"""The command: it serves one address, and leaves no process behind."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import urllib.error
import urllib.request
from contextlib import contextmanager

import pytest

from evolution.cli import main
from tests.evolution.processes import PATIENCE, children_of, is_gone

COMMAND = [sys.executable, "-m", "evolution", "play", "--no-browser", "--controllers", "rpp", "--workers", "1"]


@contextmanager
def playing(*options):
    """Yield the process and the address of a playground."""
    with subprocess.Popen([*COMMAND, *options], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            yield process, process.stdout.readline().strip()
        finally:
            process.kill()


@pytest.mark.slow
@pytest.mark.skipif(not os.path.exists("/proc"), reason="looks into /proc")
@pytest.mark.parametrize(
    ("how", "code"), [(signal.SIGINT, 0), (signal.SIGTERM, -signal.SIGTERM), (signal.SIGKILL, -signal.SIGKILL)]
)
def test_a_playground_that_ends_leaves_no_process(how, code):
    with playing() as (process, address):
        assert urllib.request.urlopen(f"{address}state", timeout=PATIENCE).status == 200
        children = children_of(process.pid)
        children += [inner for child in children for inner in children_of(child)]
        process.send_signal(how)
        assert process.wait(PATIENCE) == code
        assert children
        assert all(is_gone(child) for child in children)


def test_the_server_answers_only_this_machine_and_only_with_the_token():
    with playing() as (_, address):
        assert address.startswith("http://127.0.0.1:")
        with pytest.raises(urllib.error.HTTPError, match="403"):
            urllib.request.urlopen(f"{address.rsplit('/', 2)[0]}/state", timeout=PATIENCE)
        with pytest.raises(urllib.error.HTTPError, match="403"):
            urllib.request.urlopen(
                urllib.request.Request(f"{address}state", headers={"Host": "evil.example"}), timeout=PATIENCE
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
