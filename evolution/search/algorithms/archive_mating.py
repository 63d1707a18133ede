"""Offspring of the archive: the best expected set with one map replaced by a mutated or a sampled map.

An individual of the population is a set, but what the search keeps are maps: sets are made of the archive's maps at no
cost. So an offspring has one new map, made of a map that would be good in the same role, and the best other maps.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from pymoo.core.infill import InfillCriterion
from pymoo.core.population import Population

from evolution.search.expectations import Expectations
from evolution.search.operators import MapMutation, MapSampling, Trial, as_column
from gym_mapbench.world.scenario import MapSet, Scenario

PARENTS = 8
"""Parents are selected among this many maps, the best in the role most often."""
FRESH = 0.1
"""Probability that the new map is a sampled one, whatever is expected of it."""
MUTATED, SAMPLED = 12, 12
"""Mutated and sampled maps among which the surrogate selects the map that is evaluated; one map without surrogate."""
MAX_TRIES = 30
"""Mutations at most until these are maps that were not evaluated before. If none is, a map is sampled."""


class ArchiveMating(InfillCriterion):  # type: ignore[misc]
    """Makes offspring of the archive's maps.

    Args:
        expectations: Which maps are good in which role.
        mutation: Selects the role and the operator by their credit, and mutates the map.
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
        base, shares = self.expectations.archive.map_set(best), self.expectations.shares_of_roles()
        parents = [self._parents(role) for role in range(len(base))]
        roles = [int(role) for role in random_state.choice(len(base), n_offsprings, p=shares)]
        return Population.new(X=as_column([self._child(base, role, parents[role], random_state) for role in roles]))

    def _first_set(self, rng: np.random.Generator) -> MapSet:
        """Return a set of solved maps and sampled ones, as long as there is no best expected set."""
        archive, size = self.expectations.archive, self.expectations.size
        known = [archive.scenarios[name] for name in archive.solved()][: size - 1]
        return MapSet((*known, *(self.sampling.draw(rng) for _ in range(size - len(known)))))

    def _parents(self, role: int) -> MapSet:
        """Return the best maps in a role, the best first."""
        return self.expectations.archive.map_set(self.expectations.ranked(role)[:PARENTS])

    def _child(self, base: MapSet, role: int, parents: MapSet, rng: np.random.Generator) -> MapSet:
        """Return the set with another map in a role: the most promising of some mutated and sampled maps."""
        mutated, sampled = (MUTATED, SAMPLED) if self.expectations.predicts else (1, 0)
        trials = self._trials(base, role, parents, mutated, rng) if rng.random() >= FRESH else []
        new = [self.sampling.draw(rng) for _ in range(sampled if trials else 1)]
        children = [*(trial.after for trial, _ in trials), *(base.with_map(role, one) for one in new)]
        chosen = self.expectations.most_promising([child[role] for child in children], role, rng)
        if chosen < len(trials):
            trial, parent = trials[chosen]
            self.expectations.add_parent(trial.after[role], parent)
            self.mutation.note(trial)
        return children[chosen]

    def _trials(
        self, base: MapSet, role: int, parents: MapSet, count: int, rng: np.random.Generator
    ) -> list[tuple[Trial, Scenario]]:
        """Return at most ``count`` mutations of parents to maps that were not evaluated, each with its parent."""
        mates = [one.genome for one in parents if one.genome is not None]
        found: list[tuple[Trial, Scenario]] = []
        for _ in range(MAX_TRIES):
            parent = parents[min(int(rng.exponential(PARENTS / 3)), len(parents) - 1)]
            trial = self.mutation.mutated_in(base.with_map(role, parent), role, role, rng, mates, before=base)
            if trial.after[role].world_digest not in self.expectations.archive.scenarios:
                found.append((trial, parent))
            if len(found) == count:
                break
        return found
