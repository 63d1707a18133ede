"""NSGA-II (Deb et al., 2002): non-dominated sorting and crowding distance, any number of objectives."""

from __future__ import annotations

from typing import Any

from pymoo.algorithms.base.genetic import GeneticAlgorithm

from evolution.search.algorithms.base import Algorithm


def nsga2(**operators: Any) -> GeneticAlgorithm:
    """NSGA-II: non-dominated sorting and crowding distance, several objectives."""
    from pymoo.algorithms.moo.nsga2 import NSGA2

    return NSGA2(**operators)


SORTING = Algorithm(nsga2)
