"""Search: finds the best map set for an experiment.

In: an :class:`Experiment` (options, controllers, world) and an evaluator that drives map sets. Out: an
:class:`EvolveResult`, and every generation to a :class:`Recorder`, if there is one.
"""

from __future__ import annotations

from evolution.search.algorithms.problem import Evaluation
from evolution.search.experiments import (
    DEFAULT_CONTROLLERS,
    DEFAULT_PRESET,
    SECTIONS,
    check_experiment,
    check_several,
    controllers_from,
    experiment_of,
    load_preset,
    preset_names,
    read_document,
)
from evolution.search.judging.exact import MAX_MAPS, best_set
from evolution.search.judging.fitness import Fitness, FitnessBreakdown, MapResults, calibrate_scale, order_of
from evolution.search.judging.patterns import FITNESSES, Pattern, gini
from evolution.search.loop import EvolveResult, Progress, Recorder, evolve
from evolution.search.operators.changes import OPERATORS
from evolution.search.operators.edits import Edit, Operator
from evolution.search.operators.sampling import scenario_on
from evolution.search.record import Record, result_fields, runs_on
from evolution.search.settings import METRIC_NAMES, EvolveSettings, Experiment, FitnessName, MutationSettings
from evolution.search.validation_stage import Confirmation

__all__ = [
    "DEFAULT_CONTROLLERS",
    "DEFAULT_PRESET",
    "FITNESSES",
    "MAX_MAPS",
    "METRIC_NAMES",
    "OPERATORS",
    "SECTIONS",
    "Confirmation",
    "Edit",
    "Evaluation",
    "EvolveResult",
    "EvolveSettings",
    "Experiment",
    "Fitness",
    "FitnessBreakdown",
    "FitnessName",
    "MapResults",
    "MutationSettings",
    "Operator",
    "Pattern",
    "Progress",
    "Record",
    "Recorder",
    "best_set",
    "calibrate_scale",
    "check_experiment",
    "check_several",
    "controllers_from",
    "evolve",
    "experiment_of",
    "gini",
    "load_preset",
    "order_of",
    "preset_names",
    "read_document",
    "result_fields",
    "runs_on",
    "scenario_on",
]
