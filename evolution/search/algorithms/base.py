"""What an algorithm is: a pymoo algorithm over map sets, and what the search must know about it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from pymoo.algorithms.base.genetic import GeneticAlgorithm

from gym_mapbench.registry import must_be_callable

Make = Callable[..., GeneticAlgorithm]
"""Takes ``pop_size``, ``sampling``, ``crossover``, ``mutation``, ``repair`` and ``eliminate_duplicates`` by keyword."""


@dataclass(frozen=True)
class Algorithm:
    """An algorithm of the search.

    Args:
        make: A subclass of pymoo's ``GeneticAlgorithm``, or a function that makes one.
        objectives: Largest number of objectives it can minimise; None for any number.
        elitist: Whether exactly the sets with the best fitness, of the population and its offspring, survive.
        varies: Whether offspring are crossed and mutated sets of the population; if not, every set is sampled.
    """

    make: Make
    objectives: int | None = None
    varies: bool = True
    elitist: bool = False


def as_algorithm(entry: Any) -> Algorithm:
    """Return an algorithm for an algorithm or what makes one; raises ``ConfigError`` for anything else."""
    return entry if isinstance(entry, Algorithm) else Algorithm(must_be_callable(entry))
