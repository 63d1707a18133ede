"""Tuning: from a parameter file and maps to a parameter file whose values suit the maps better.

In: a controller, its parameters, a search space, training maps and test maps. Out: a directory with the tuned parameter
file, its comparison with the user's values on the test maps, and the history of the search. Optuna is needed for the
search alone and is imported when it begins.
"""

from __future__ import annotations

from evolution.tuning.objectives import OBJECTIVES
from evolution.tuning.parameter_text import ParameterText, text_of_file, text_of_settings, writable_space
from evolution.tuning.plan import TuningPlan
from evolution.tuning.replays import drive_test
from evolution.tuning.results import FIGURES, PARAMS, TRIALS, TUNING, Tuning, load_tuning
from evolution.tuning.running import run_tuning
from evolution.tuning.sampling import optuna
from evolution.tuning.search import OnTrial, Trial
from evolution.tuning.settings import AgainstSettings, TuneSettings
from evolution.tuning.space import (
    ParameterRange,
    SearchSpace,
    read_space,
    shipped_document,
    shipped_space,
    space_for,
    space_names,
)

__all__ = [
    "FIGURES",
    "OBJECTIVES",
    "PARAMS",
    "TRIALS",
    "TUNING",
    "AgainstSettings",
    "OnTrial",
    "ParameterRange",
    "ParameterText",
    "SearchSpace",
    "Trial",
    "TuneSettings",
    "Tuning",
    "TuningPlan",
    "drive_test",
    "load_tuning",
    "optuna",
    "read_space",
    "run_tuning",
    "shipped_document",
    "shipped_space",
    "space_for",
    "space_names",
    "text_of_file",
    "text_of_settings",
    "writable_space",
]
