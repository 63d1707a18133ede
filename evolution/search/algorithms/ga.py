"""The genetic algorithm of the thesis (chapter 4): binary tournament, elitist survival, one objective."""

from __future__ import annotations

from typing import Any

from pymoo.algorithms.soo.nonconvex.ga import GA

from evolution.search.algorithms.base import Algorithm


def genetic_algorithm(**operators: Any) -> GA:
    """The genetic algorithm of the thesis: binary tournament and elitist survival, one objective."""
    return GA(**operators)


GENETIC = Algorithm(genetic_algorithm, objectives=1, elitist=True)
