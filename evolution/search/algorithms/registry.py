"""The algorithms by name; each algorithm has a file of its own."""

from __future__ import annotations

from evolution.search.algorithms.base import Algorithm, as_algorithm
from evolution.search.algorithms.ga import GENETIC
from evolution.search.algorithms.nsga2 import SORTING
from evolution.search.algorithms.random_search import RANDOM
from gym_mapbench.registry import Registry

ALGORITHMS: Registry[Algorithm] = Registry(
    "search algorithm", "search_algorithms", {"ga": GENETIC, "random": RANDOM, "nsga2": SORTING}, check=as_algorithm
)
"""The algorithms by name."""
