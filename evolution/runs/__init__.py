"""Runs: the directory of one search.

In: the generations of a search; :class:`RunDir` records them in plain files. Out: the same search, read back
(:func:`load_run`) and checked file by file, or continued from its last checkpoint.
"""

from __future__ import annotations

from evolution.runs.directory import CONFIG, RUN, STORE, RunDir
from evolution.runs.documents import check_results
from evolution.runs.exclusive_store import filling
from evolution.runs.former_names import present_results
from evolution.runs.loading import LoadedRun, driven_maps, experiment_in, load_run, reached_maps
from evolution.runs.recorded_world import recorded_experiment
from evolution.runs.reevaluation import DrivenAgain, driven_again, fitness_of, judge
from evolution.runs.results import (
    chosen_by,
    errors_in,
    results_document,
    results_in,
    typical_repeat,
    validation_in,
    validation_sentence,
)

__all__ = [
    "CONFIG",
    "RUN",
    "STORE",
    "DrivenAgain",
    "LoadedRun",
    "RunDir",
    "check_results",
    "chosen_by",
    "driven_again",
    "driven_maps",
    "errors_in",
    "experiment_in",
    "filling",
    "fitness_of",
    "judge",
    "load_run",
    "present_results",
    "reached_maps",
    "recorded_experiment",
    "results_document",
    "results_in",
    "typical_repeat",
    "validation_in",
    "validation_sentence",
]
