"""NSGA-II as an algorithm of the search, as a third party would write it."""

from __future__ import annotations

from pymoo.algorithms.moo.nsga2 import NSGA2

from evolution.search import Algorithm

ALGORITHM = Algorithm(NSGA2)
