"""Judging: how good a map set is. In: results of its maps. Out: a :class:`Judgement`.

=====================  =================================================================================================
``patterns``           what a fitness looks for in the scores of the maps: gini, cluster, roles, pairs, regret
``failures``           what a failed run counts: exclude, censor, par2
``equation``           the fitness of the thesis (Eq. 4.5)
``fitness``            judges a map set: pattern, failures and equation together
``objectives``         the fitness and what is minimised besides
``judgement``          the answer: objectives and constraints, and how two answers compare
``exact``              the exact best set of many maps
``expected_fitness``   the expected fitness of a further trial
=====================  =================================================================================================
"""

from __future__ import annotations

from evolution.search.judging.exact import MAX_MAPS, Names, best_of_judged, best_set, check_sizes
from evolution.search.judging.failures import FAILURES, FailurePolicy
from evolution.search.judging.fitness import Fitness, calibrate_scale, scores_of
from evolution.search.judging.judgement import JudgedMap, Judgement, best_of, order_kept, order_of, values_in_order
from evolution.search.judging.map_results import (
    MapResults,
    is_solved,
    is_untouched,
    missing_runs,
    repeats_of,
    singles_of,
    success_share,
)
from evolution.search.judging.objectives import Objectives
from evolution.search.judging.patterns import FITNESSES, Parts, Pattern, gini
from evolution.search.judging.settings import MAP_MEASURES, FitnessName, JudgingSettings

__all__ = [
    "FAILURES",
    "FITNESSES",
    "MAP_MEASURES",
    "MAX_MAPS",
    "FailurePolicy",
    "Fitness",
    "FitnessName",
    "JudgedMap",
    "Judgement",
    "JudgingSettings",
    "MapResults",
    "Names",
    "Objectives",
    "Parts",
    "Pattern",
    "best_of",
    "best_of_judged",
    "best_set",
    "calibrate_scale",
    "check_sizes",
    "gini",
    "is_solved",
    "is_untouched",
    "missing_runs",
    "order_kept",
    "order_of",
    "repeats_of",
    "scores_of",
    "singles_of",
    "success_share",
    "values_in_order",
]
