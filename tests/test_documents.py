"""Every code block of the README runs: Python and shell blocks in one folder, in order, as a reader would.

The commands have small budgets: the options in ``REDUCED`` follow those of the reader, which stay and are parsed.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

from gym_mapbench.registry import Registry

ROOT = Path(__file__).resolve().parents[1]
DOCUMENT = "README.md"
INTERPRETERS = {"python": [sys.executable, "-W", "error::DeprecationWarning:__main__"], "bash": ["bash", "-e"]}
TINY = """
search:
  shapes: {size: 64, n_obstacles: [2, 4]}
  archive: {elite_seeds: 0}
  validation: {seeds: 2, candidates: 2, held_out_seeds: 2}
controllers: [dwb, rpp]
run: {environment: {time_limit: 60.0}}
"""
FEW = "--pop-size 2 --evaluations 2 --maps-per-set 2"
REDUCED = {
    "evolve": f"{FEW} --config tiny.yaml",
    "bench": "--repeats 1 --time-limit 20 --workers 1",
    "maps": "--count 3",
    "minimize": "--seeds 1 --held-out-seeds 1 --time-limit 10 --workers 1",
}
"""What is added to a command; of an option that is given twice, the last counts."""


def blocks_of(document: str) -> list[tuple[str, str]]:
    """Languages and texts of the blocks that run.

    Blocks marked ``<!-- ... command -->`` install; CI runs them whole, and so does everybody on a fresh clone.
    """
    text = (ROOT / document).read_text(encoding="utf-8")
    found = re.findall(r"(<!-- [a-z]+ command -->\n)?```(\w+)\n(.*?)```", text, flags=re.DOTALL)
    return [(language, block) for marker, language, block in found if not marker and language in INTERPRETERS]


def reduced(block: str) -> str:
    """Return a shell block whose commands have small budgets."""
    return re.sub(r"^(mapbench (\w+)[^#\n]*)", lambda line: f"{line[1]} {REDUCED.get(line[2], '')}", block, flags=re.M)


def name_of(block: str, position: int, language: str) -> str:
    """Where a block is saved: ``# NAME.py`` in its first line says so, for later blocks to import it."""
    named = re.match(r"# (\w+\.py)\n", block)
    return named[1] if named else f"block_{position}.{language}"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with the examples in it as in a clone; later blocks use what earlier ones wrote."""
    folder = tmp_path_factory.mktemp("reader")
    shutil.copytree(ROOT / "examples", folder / "examples")
    (folder / "tiny.yaml").write_text(TINY, encoding="utf-8")
    return folder


def test_there_is_something_to_run():
    assert {"python", "bash"} <= {language for language, _ in blocks_of(DOCUMENT)}


@pytest.mark.parametrize("position", range(len(blocks_of(DOCUMENT))))
def test_block_runs(position, folder):
    language, text = blocks_of(DOCUMENT)[position]
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    script = folder / name_of(text, position, language)
    script.write_text(reduced(text) if language == "bash" else text, encoding="utf-8")
    done = subprocess.run(
        [*INTERPRETERS[language], str(script)],
        cwd=folder,
        env={**os.environ, "PATH": path, "MPLBACKEND": "agg"},
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    assert done.returncode == 0, f"{text}\n{done.stdout}\n{done.stderr}"


def test_the_table_of_registries_is_true():
    text = (ROOT / "docs/extending.md").read_text(encoding="utf-8")
    rows = re.findall(r"`([\w.]+)\.([A-Z_]+)`, `(gym_mapbench\.\w+)` \|", text)
    assert len(rows) == 18
    for module, name, group in rows:
        registry = getattr(import_module(module), name)
        assert isinstance(registry, Registry)
        assert registry.group == group
