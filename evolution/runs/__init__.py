"""Runs: the directory of one search.

In: the generations of a search; :class:`RunDir` records them in plain files. Out: the same search, read back
(:func:`load_run`) and checked file by file, or continued from its last checkpoint.
"""

from __future__ import annotations

from evolution.runs.directory import CONFIG, RUN, STORE, RunDir
from evolution.runs.documents import check_results
from evolution.runs.exclusive_store import filling
from evolution.runs.loading import LoadedRun, driven_maps, experiment_in, load_run, reached_maps
from evolution.runs.map_summary import OUTLIER, ControllerTimes, MapSummary, summary_of_map
from evolution.runs.recorded_world import recorded_experiment
from evolution.runs.reevaluation import DrivenAgain, driven_again, fitness_of, judge
from evolution.runs.results import (
    chosen_by,
    confirmation_in,
    confirmed_sentence,
    errors_in,
    results_document,
    results_in,
    typical_repeat,
)

__all__ = [
    "CONFIG",
    "OUTLIER",
    "RUN",
    "STORE",
    "ControllerTimes",
    "DrivenAgain",
    "LoadedRun",
    "MapSummary",
    "RunDir",
    "check_results",
    "chosen_by",
    "confirmation_in",
    "confirmed_sentence",
    "driven_again",
    "driven_maps",
    "errors_in",
    "experiment_in",
    "filling",
    "fitness_of",
    "judge",
    "load_run",
    "reached_maps",
    "recorded_experiment",
    "results_document",
    "results_in",
    "summary_of_map",
    "typical_repeat",
]
