"""Lists of the files in a directory of results, from the code that writes them."""

from __future__ import annotations

from importlib import import_module

from docs.generate.docstrings import block_of
from docs.generate.markdown import code

TEXTS = {"run": "evolution.runs.directory", "training": "evolution.training.directory"}
"""Modules whose ``README_TEXT`` is written into the directory itself."""
DOCSTRINGS = {
    "study": "evolution.studies.directory",
    "sweep": "evolution.studies.sweep.running",
    "benchmark": "evolution.benchmark.directory",
    "minimization": "evolution.minimizing.results",
    "map-atlas": "evolution.quality_diversity.results",
    "tuning": "evolution.tuning.results",
}
"""Modules that list the files in their docstring."""


def files_of(kind: str) -> str:
    """Return the list of files of a kind of directory."""
    if kind in TEXTS:
        return code(import_module(TEXTS[kind]).README_TEXT.rstrip())
    return code(block_of(import_module(DOCSTRINGS[kind])))
