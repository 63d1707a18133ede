"""Commands with a user's controller that fails: one line says what and where, and --verbose shows the traceback."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from evolution.cli import main
from tests.evolution.commands.test_cli import OFFICE

CONTROLLERS = """
class Ahead:
    observation_keys = ("goal",)

    def reset(self, context):
        pass

    def act(self, observation):
        return 0.2, 0.0


class Raises(Ahead):
    def act(self, observation):
        raise RuntimeError("no luck")


class Leaves(Ahead):
    def act(self, observation):
        raise SystemExit(3)


class Hides(Ahead):
    @property
    def observation_keys(self):
        raise KeyError("keys")


class Unfit(Ahead):
    def fit(self, config):
        raise KeyError("fit")
"""
DRIVE = ["drive", OFFICE, "--time-limit", "1", "--controller"]


@pytest.fixture
def controllers(tmp_path, monkeypatch):
    (tmp_path / "failing_controllers.py").write_text(CONTROLLERS)
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    yield "failing_controllers"
    sys.modules.pop("failing_controllers", None)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("Raises", "RuntimeError: no luck, failing_controllers.py line 14"),
        ("Leaves", "SystemExit: 3, failing_controllers.py line 19"),
        ("Hides", "KeyError: 'keys', failing_controllers.py line 25"),
        ("Unfit", "KeyError: 'fit', failing_controllers.py line 30"),
    ],
)
def test_a_controller_that_fails_in_this_process_is_one_line(name, expected, controllers, capsys):
    assert main([*DRIVE, f"{controllers}:{name}"]) == 2
    assert capsys.readouterr().err == f"mapbench drive: controller '{controllers}:{name}': {expected}\n"


def test_verbose_shows_the_traceback_in_this_process(controllers, capsys):
    assert main([*DRIVE, f"{controllers}:Raises", "--verbose"]) == 2
    said = capsys.readouterr().err
    assert "Traceback (most recent call last)" in said
    assert 'failing_controllers.py", line 14, in act\n    raise RuntimeError("no luck")' in said


def test_a_mended_controller_costs_a_benchmark_its_own_runs_only(controllers, capsys):
    argv = ["bench", OFFICE, "--controllers", f"rpp,mine={controllers}:Raises", "--time-limit", "1", "--workers", "1"]
    assert main([*argv, "--out", "kept"]) == 0
    assert "1 of 2 runs ended in an error" in capsys.readouterr().err
    Path("failing_controllers.py").write_text(CONTROLLERS.replace('raise RuntimeError("no luck")', "return 0.1, 0.0"))
    assert main([*argv, "--out", "kept", "--resume", "--verbose"]) == 0
    said = capsys.readouterr().err
    assert "kept: the code of failing_controllers has changed: its runs" in said
    assert "2 runs, of which 1 are to be driven" in said
    assert "ended in an error" not in said.replace("that ended in an error, are repeated", "")


@pytest.mark.parametrize("verbose", [False, True])
def test_verbose_shows_the_traceback_of_a_worker(verbose, controllers):
    argv = ["bench", OFFICE, "--controllers", f"{controllers}:Raises", "--time-limit", "1", "--workers", "1"]
    code = f"import sys; from evolution.cli import main; sys.exit(main({argv + ['--verbose'] * verbose}))"
    paths = [str(Path(__file__).parents[3]), os.environ.get("PYTHONPATH", "")]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(paths)}
    said = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=False)
    assert said.returncode == 2
    assert ('failing_controllers.py", line 14, in act' in said.stderr) == verbose
    assert "RuntimeError: no luck, failing_controllers.py line 14" in said.stderr
