"""Runs: the directory of one search.

In: the generations of a search; :class:`RunDir` records them in plain files. Out: the same search, read back
(:func:`load_run`) and checked file by file, or continued from its last checkpoint.
"""

from __future__ import annotations

from evolution.runs.directory import CONFIG, RUN, STORE, RunDir
from evolution.runs.documents import check_results
from evolution.runs.loading import LoadedRun, driven_maps, load_run, reached_maps
from evolution.runs.results import errors_in, results_document, results_in

__all__ = [
    "CONFIG",
    "RUN",
    "STORE",
    "LoadedRun",
    "RunDir",
    "check_results",
    "driven_maps",
    "errors_in",
    "load_run",
    "reached_maps",
    "results_document",
    "results_in",
]
