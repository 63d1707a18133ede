"""Every code block of the README runs: Python and shell blocks in one folder, in order, as a reader would."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")

# The two blocks that install are run whole by CI (the test command) and by hand on a fresh clone.
BLOCKS = [
    (language, text)
    for marker, language, text in re.findall(r"(<!-- [a-z]+ command -->\n)?```(\w+)\n(.*?)```", README, flags=re.DOTALL)
    if not marker
]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """One folder for all blocks, with the examples in it as in a clone; later blocks use what earlier ones wrote."""
    folder = tmp_path_factory.mktemp("reader")
    shutil.copytree(ROOT / "examples", folder / "examples")
    return folder


def test_there_is_something_to_run():
    assert {"python", "bash"} <= {language for language, _ in BLOCKS}


@pytest.mark.xdist_group("readme")
@pytest.mark.parametrize("position", range(len(BLOCKS)))
def test_block_runs(position, folder):
    language, text = BLOCKS[position]
    interpreter = {"python": [sys.executable, "-W", "error::DeprecationWarning:__main__"], "bash": ["bash", "-e"]}
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    script = folder / f"block_{position}.{language}"
    script.write_text(text, encoding="utf-8")
    done = subprocess.run(
        [*interpreter[language], str(script)],
        cwd=folder,
        env={**os.environ, "PATH": path, "MPLBACKEND": "agg"},
        capture_output=True,
        text=True,
        timeout=240,
        check=False,
    )
    assert done.returncode == 0, f"{text}\n{done.stdout}\n{done.stderr}"
