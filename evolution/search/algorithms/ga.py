"""The genetic algorithm of the thesis (chapter 4): binary tournament, elitist survival, one objective."""

from __future__ import annotations

from pymoo.algorithms.soo.nonconvex.ga import GA

from evolution.search.algorithms.base import Algorithm

GENETIC = Algorithm(GA, objectives=1)
