"""Crossover: the maps of two parents are distributed to two offspring (thesis, section 4.1.4).

No map is changed, lost or duplicated: the two offspring together hold exactly the parents' maps.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeVar

import numpy as np
from pymoo.core.crossover import Crossover

from evolution.search.operators.sampling import Column
from gym_mapbench.world.scenario import MapSet, Scenario

T = TypeVar("T")
Pair = tuple[tuple[T, ...], tuple[T, ...]]


def pool_crossover(first: Sequence[T], second: Sequence[T], rng: np.random.Generator) -> Pair[T]:
    """Return a random half of all maps as the first offspring, the other half as the second."""
    pool = [*first, *second]
    order = rng.permutation(len(pool))
    shuffled = tuple(pool[index] for index in order)
    return shuffled[: len(first)], shuffled[len(first) :]


def position_crossover(first: Sequence[T], second: Sequence[T], rng: np.random.Generator) -> Pair[T]:
    """Return the parents with the maps at every position exchanged with probability 1/2."""
    swap = rng.random(len(first)) < 0.5
    pairs = [(b, a) if swapped else (a, b) for a, b, swapped in zip(first, second, swap, strict=True)]
    one, other = zip(*pairs, strict=True)
    return one, other


CROSSOVERS: dict[str, Callable[[Sequence[Scenario], Sequence[Scenario], np.random.Generator], Pair[Scenario]]] = {
    "pool": pool_crossover,
    "position": position_crossover,
}


class MapCrossover(Crossover):  # type: ignore[misc]
    """One of :data:`CROSSOVERS` as a pymoo operator.

    Args:
        kind: ``pool`` or ``position``.
        probability: Probability that two parents are crossed (p_c).
    """

    def __init__(self, kind: str, probability: float) -> None:
        super().__init__(n_parents=2, n_offsprings=2, prob=probability)
        self.cross = CROSSOVERS[kind]

    def _do(self, _problem: Any, X: Column, *_: Any, random_state: np.random.Generator, **__: Any) -> Column:
        """Cross ``X[parent, mating, 0]``; returns ``[offspring, mating, 0]``."""
        offspring = np.empty_like(X)
        for mating, (first, second) in enumerate(zip(X[0, :, 0], X[1, :, 0], strict=True)):
            one, other = self.cross(tuple(first), tuple(second), random_state)
            offspring[0, mating, 0], offspring[1, mating, 0] = MapSet(one), MapSet(other)
        return offspring
