"""Search: finds the best map set for an experiment.

In: an :class:`Experiment` (options, controllers, world) and an evaluator that drives map sets. Out: an
:class:`EvolveResult`, and every generation to a :class:`Recorder`, if there is one.

====================  ==========================================================================
``judging``           how good a map set is: patterns, failure policies, Eq. 4.5
``algorithms``        how map sets are searched: ga, random, nsga2
``operators``         how new map sets are made: sampling, crossover, mutation
``loop``              the search itself; ``archive``, ``elite`` and ``budget`` serve it
``validation_stage``  the best maps, or the Pareto front, on held-out seeds
``settings``          the options; ``option_names`` lists short and former names
====================  ==========================================================================
"""

from __future__ import annotations

from evolution.search.algorithms import ALGORITHMS, Algorithm, Evaluation, GaSettings
from evolution.search.archive import Archive
from evolution.search.experiment import Experiment
from evolution.search.experiments import (
    DEFAULT_CONTROLLERS,
    DEFAULT_PRESET,
    SECTIONS,
    check_experiment,
    check_sections,
    check_several,
    controllers_from,
    experiment_of,
    load_preset,
    preset_names,
    read_document,
)
from evolution.search.judging import (
    FAILURES,
    FITNESSES,
    MAP_MEASURES,
    MAX_MAPS,
    FailurePolicy,
    Fitness,
    FitnessName,
    Judgement,
    JudgingSettings,
    MapResults,
    Parts,
    Pattern,
    best_set,
    calibrate_scale,
    check_sizes,
    gini,
    is_solved,
    order_kept,
    order_of,
    values_in_order,
)
from evolution.search.loop import EvolveResult, Progress, evolve
from evolution.search.operators import (
    GENE_OPERATORS,
    OPERATORS,
    Edit,
    GeneEdit,
    MutationSettings,
    Operator,
    change_near_way,
    scenario_on,
)
from evolution.search.option_names import nested, nested_document, short_names
from evolution.search.record import Record, result_fields
from evolution.search.recorder import Recorder, checkpoint_of
from evolution.search.sections import ArchiveSettings, ValidationSettings
from evolution.search.settings import METRIC_NAMES, EvolveSettings
from evolution.search.staging import stages_of
from evolution.search.validation_stage import FrontPoint, ValidationResult

__all__ = [
    "ALGORITHMS",
    "DEFAULT_CONTROLLERS",
    "DEFAULT_PRESET",
    "FAILURES",
    "FITNESSES",
    "GENE_OPERATORS",
    "MAP_MEASURES",
    "MAX_MAPS",
    "METRIC_NAMES",
    "OPERATORS",
    "SECTIONS",
    "Algorithm",
    "Archive",
    "ArchiveSettings",
    "Edit",
    "Evaluation",
    "EvolveResult",
    "EvolveSettings",
    "Experiment",
    "FailurePolicy",
    "Fitness",
    "FitnessName",
    "FrontPoint",
    "GaSettings",
    "GeneEdit",
    "Judgement",
    "JudgingSettings",
    "MapResults",
    "MutationSettings",
    "Operator",
    "Parts",
    "Pattern",
    "Progress",
    "Record",
    "Recorder",
    "ValidationResult",
    "ValidationSettings",
    "best_set",
    "calibrate_scale",
    "change_near_way",
    "check_experiment",
    "check_sections",
    "check_several",
    "check_sizes",
    "checkpoint_of",
    "controllers_from",
    "evolve",
    "experiment_of",
    "gini",
    "is_solved",
    "load_preset",
    "nested",
    "nested_document",
    "order_kept",
    "order_of",
    "preset_names",
    "read_document",
    "result_fields",
    "scenario_on",
    "short_names",
    "stages_of",
    "values_in_order",
]
