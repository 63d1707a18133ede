"""Algorithms of the search: ``ga``, ``random`` and ``nsga2``, and whatever pymoo or a third party brings.

An algorithm is a subclass of pymoo's ``GeneticAlgorithm``, which gets the operators of map sets; NSGA-III would be
named by a function that makes it. Its objectives and constraints come from :mod:`evolution.search.judging`.
"""

from __future__ import annotations

from evolution.search.algorithms.problem import Evaluation, MapSetProblem, ask, judge_again, make_algorithm, tell
from evolution.search.algorithms.registry import ALGORITHMS, Algorithm
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
    "tell",
]
