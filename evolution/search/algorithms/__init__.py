"""Algorithms of the search: ``ga`` and ``random``, and whatever pymoo or a third party brings.

An algorithm is a subclass of pymoo's ``GeneticAlgorithm``, which gets the operators of map sets; NSGA-II is named
``pymoo.algorithms.moo.nsga2:NSGA2``. Its objectives and constraints come from :mod:`evolution.search.judging`.
"""

from __future__ import annotations

from evolution.search.algorithms.base import Algorithm
from evolution.search.algorithms.problem import Evaluation, MapSetProblem, ask, judge_again, make_algorithm
from evolution.search.algorithms.registry import ALGORITHMS
from evolution.search.algorithms.settings import GaSettings

__all__ = [
    "ALGORITHMS",
    "Algorithm",
    "Evaluation",
    "GaSettings",
    "MapSetProblem",
    "ask",
    "judge_again",
    "make_algorithm",
]
