"""A directory on a read-only disk: whatever would write there says so in one line, and what was there stays."""

from __future__ import annotations

import os
import shutil
import subprocess

import pytest

from evolution.cli import main
from tests.evolution.test_received import real_study, recorded

__all__ = ["real_study", "recorded"]

MAP = "image: m.pgm\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.25\n"


@pytest.fixture
def disk(recorded, real_study, tmp_path, monkeypatch):
    """A read-only directory with a run, a study and a map; root, whom no permission binds, needs a mount."""
    path = tmp_path / "disk"
    shutil.copytree(recorded, path / "run")
    shutil.copytree(real_study, path / "study")
    (path / "m.yaml").write_text(MAP)
    (path / "m.pgm").write_bytes(b"P5\n60 60\n255\n" + bytes([254]) * 3600)
    before = contents(path)
    monkeypatch.chdir(path)
    undo = make_read_only(path)
    monkeypatch.chdir(path)
    yield path
    assert contents(path) == before
    undo()


def contents(path):
    """Return every file with its bytes."""
    return {str(file.relative_to(path)): file.read_bytes() for file in sorted(path.rglob("*")) if file.is_file()}


def make_read_only(path):
    """Make a directory read-only; returns what makes it writable again."""
    if os.geteuid() == 0:
        if shutil.which("mount") is None or subprocess.run(["mount", "--bind", path, path], check=False).returncode:
            pytest.skip("neither permissions nor mounts can make a directory read-only here")
        subprocess.run(["mount", "-o", "remount,ro,bind", path], check=True)
        return lambda: (os.chdir("/"), subprocess.run(["umount", path], check=True))
    folders = [path, *(folder for folder in path.rglob("*") if folder.is_dir())]
    for folder in folders:
        folder.chmod(0o555)
    return lambda: [folder.chmod(0o755) for folder in folders]


TASK = "--start 0.5,0.5,0 --goal 2,2,0"
WRITING = {
    f"bench m.yaml --controllers rpp {TASK} --out b": "cannot be made",
    f"bench m.yaml --controllers rpp {TASK} --html page.html": "can be written",
    "evolve --preset quick --out e": "cannot be made",
    "evolve --resume run": "run/results.sqlite: cannot be opened for writing",
    "study quick --out s": "cannot be made",
    "study study --resume": "study/results.sqlite: cannot be opened for writing",
    "train --algo ppo --steps 100 --out t": "cannot be made",
    "maps convert m.yaml m.json": "cannot be written",
    "maps draw --family shapes --count 1 --out drawn": "cannot be made",
    "export m.yaml --format map_server --out x": "cannot be made",
    "report run": "run/report.html: expected a directory that can be written; --out names another",
    "report study": "study/report.html: expected a directory that can be written; --out names another",
    "report run --out page.html": "page.html: expected a directory that can be written",
    "report run --gif film.gif": "film.gif: expected a name in a directory that can be written",
}


@pytest.mark.parametrize("command", WRITING)
def test_nothing_is_written_and_one_line_says_why(disk, capsys, command):
    if command.startswith("train"):
        pytest.importorskip("stable_baselines3")
    assert main(command.split()) == 2
    said = capsys.readouterr().err.strip().splitlines()
    assert len(said) == 1
    assert WRITING[command] in said[0]
