"""Offspring of the archive: the best expected set with one map replaced by a mutated map of the archive.

An individual of the population is a set, but what the search keeps are maps: sets are made of the archive's maps at no
cost. So an offspring has one new map, made of a map that would be good in the same role, and the best other maps.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymoo.core.infill import InfillCriterion
from pymoo.core.population import Population

from evolution.search.expectations import Expectations
from evolution.search.operators import MapMutation, MapSampling, as_column
from gym_mapbench.world.scenario import MapSet

PARENTS = 8
"""Parents are selected among this many maps, the best in the role most often."""
FRESH = 0.1
"""Probability that the new map is sampled."""
EVENLY = 0.15
"""Share of the new maps that are made for all roles alike."""
MAX_TRIES = 20
"""Mutations until one is a map that was not evaluated before; then a map is sampled."""


class ArchiveMating(InfillCriterion):  # type: ignore[misc]
    """Makes offspring of the archive's maps.

    Args:
        expectations: Which maps are good in which role.
        mutation: Selects the operator by its credit, and mutates the map.
        sampling: Samples the maps that have no parent.
        options: ``repair`` and ``eliminate_duplicates`` of pymoo.
    """

    def __init__(
        self, expectations: Expectations, mutation: MapMutation, sampling: MapSampling, **options: Any
    ) -> None:
        super().__init__(**options)
        self.expectations = expectations
        self.mutation = mutation
        self.sampling = sampling

    def _do(
        self, _problem: Any, _pop: Population, n_offsprings: int, *_: Any, random_state: np.random.Generator, **__: Any
    ) -> Population:
        if not (best := self.expectations.best):
            return Population.new(X=as_column([self._first_set(random_state) for _ in range(n_offsprings)]))
        base = self.expectations.archive.map_set(best)
        parents, chances = [self._parents(role) for role in range(len(base))], self._chances()
        children = [self._child(base, parents, chances, random_state) for _ in range(n_offsprings)]
        return Population.new(X=as_column(children))

    def _first_set(self, rng: np.random.Generator) -> MapSet:
        """Return a set of solved maps and sampled ones, as long as there is no best expected set."""
        archive, size = self.expectations.archive, self.expectations.size
        known = [archive.scenarios[name] for name in archive.solved()][: size - 1]
        return MapSet((*known, *(self.sampling.draw(rng) for _ in range(size - len(known)))))

    def _parents(self, role: int) -> MapSet:
        """Return the best maps in a role, the best first."""
        return self.expectations.archive.map_set(self.expectations.ranked(role)[:PARENTS])

    def _chances(self) -> NDArray[np.float64]:
        """Return the probability that the new map is made for each role: mostly where the set can gain most."""
        gains = self.expectations.possible_gains()
        evenly = np.full(len(gains), 1.0 / len(gains))
        return EVENLY * evenly + (1.0 - EVENLY) * (gains / gains.sum() if gains.any() else evenly)

    def _child(
        self, base: MapSet, parents: list[MapSet], chances: NDArray[np.float64], rng: np.random.Generator
    ) -> MapSet:
        """Return a set with one new map."""
        role = int(rng.choice(len(base), p=chances))
        if rng.random() >= FRESH:
            for _ in range(MAX_TRIES):
                child = self._mutated(base, parents[role], role, rng)
                if child[role].world_digest not in self.expectations.archive.scenarios:
                    return child
        return base.with_map(role, self.sampling.draw(rng))

    def _mutated(self, base: MapSet, parents: MapSet, role: int, rng: np.random.Generator) -> MapSet:
        """Return the set with a mutated parent in a role."""
        parent = parents[min(int(rng.exponential(PARENTS / 3)), len(parents) - 1)]
        mates = [one.genome for one in parents if one.genome is not None]
        child = self.mutation.mutated_in(base.with_map(role, parent), role, role, rng, mates, before=base)
        self.expectations.add_parent(child[role], parent)
        return child
