"""Runs: the directory of one search.

In: the generations of a search; :class:`RunDir` records them in plain files. Out: the same search, read back
(:func:`load_run`) and checked file by file, or continued from its last checkpoint.
"""

from __future__ import annotations

from evolution.runs.directory import CONFIG, RUN, STORE, RunDir
from evolution.runs.documents import check_results
from evolution.runs.exclusive import exclusive_evaluator, exclusive_store
from evolution.runs.former_names import present_results
from evolution.runs.front import HELD_OUT, feasible, hypervolumes, objectives_in
from evolution.runs.loading import LoadedRun, driven_maps, experiment_in, front_lines, load_run, reached_maps
from evolution.runs.map_summary import OUTLIER, ControllerTimes, MapSummary, summary_of_map
from evolution.runs.recorded_experiment import RecordedExperiment
from evolution.runs.reevaluation import Reevaluation, judge, reevaluation_of
from evolution.runs.results import (
    GOOD_SET,
    chosen_by,
    contact_sentence,
    errors_in,
    failing_controller_sentence,
    results_document,
    results_in,
    slow_everywhere_sentence,
    table_sentence,
    typical_repeat,
    validation_in,
    validation_sentence,
)

__all__ = [
    "CONFIG",
    "GOOD_SET",
    "HELD_OUT",
    "OUTLIER",
    "RUN",
    "STORE",
    "ControllerTimes",
    "LoadedRun",
    "MapSummary",
    "RecordedExperiment",
    "Reevaluation",
    "RunDir",
    "check_results",
    "chosen_by",
    "contact_sentence",
    "driven_maps",
    "errors_in",
    "exclusive_evaluator",
    "exclusive_store",
    "experiment_in",
    "failing_controller_sentence",
    "feasible",
    "front_lines",
    "hypervolumes",
    "judge",
    "load_run",
    "objectives_in",
    "present_results",
    "reached_maps",
    "reevaluation_of",
    "results_document",
    "results_in",
    "slow_everywhere_sentence",
    "summary_of_map",
    "table_sentence",
    "typical_repeat",
    "validation_in",
    "validation_sentence",
]
