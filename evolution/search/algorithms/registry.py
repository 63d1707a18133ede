"""The algorithms by name: a pymoo algorithm over map sets, and what the search must know about it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from pymoo.algorithms.base.genetic import GeneticAlgorithm
from pymoo.algorithms.soo.nonconvex.ga import GA
from pymoo.core.population import Population

from gym_mapbench.registry import Registry, must_be_callable

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


def genetic_algorithm(**operators: Any) -> GA:
    """The genetic algorithm of the thesis: binary tournament and elitist survival, one objective."""
    return GA(**operators)


class RandomSearch(GA):  # type: ignore[misc]
    """A baseline without variation: every generation is sampled, and the best sets survive; one objective."""

    def _infill(self) -> Population:
        samples = self.initialization.sampling(self.problem, self.n_offsprings, random_state=self.random_state)
        return self.eliminate_duplicates.do(samples, self.pop)


def nsga2(**operators: Any) -> GeneticAlgorithm:
    """NSGA-II: non-dominated sorting and crowding distance, several objectives.

    Source: Deb et al., 2002.
    """
    from pymoo.algorithms.moo.nsga2 import NSGA2

    return NSGA2(**operators)


ALGORITHMS: Registry[Algorithm] = Registry(
    "search algorithm",
    "search_algorithms",
    {
        "ga": Algorithm(genetic_algorithm, objectives=1, elitist=True),
        "random": Algorithm(RandomSearch, objectives=1, varies=False, elitist=True),
        "nsga2": Algorithm(nsga2),
    },
    check=as_algorithm,
)
"""The algorithms by name."""
