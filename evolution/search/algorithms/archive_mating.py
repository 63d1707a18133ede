"""Offspring of the archive: the best expected set with one map replaced by a mutated map of the archive.

An individual of the population is a set, but what the search keeps are maps: sets are made of the archive's maps at no
cost. So an offspring has one new map, made of a map that would be good in the same role, and the best other maps.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Hashable, Mapping
from typing import Any

import numpy as np
from pymoo.core.infill import InfillCriterion
from pymoo.core.population import Population

from evolution.search.expectations import Expectations
from evolution.search.operators import MapMutation, MapSampling, Trial, as_column
from gym_mapbench.world.scenario import MapSet, Scenario

PARENTS = 8
"""Parents are selected among this many maps, the best in the role most often."""
FRESH = 0.25
"""Probability that the new map is sampled."""
BEST_SAMPLED = 16
"""A sampled map succeeded if it is among this many best sampled maps in a role."""
SCREENED = 16
"""New maps that mutation makes for one that is evaluated; the surrogate selects it."""
MAX_TRIES = 40
"""Mutations for them at most. A map is sampled if all of these maps were evaluated before."""


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
        chances = [self._chances_of_families(role) for role in range(len(base))]
        children: list[MapSet] = []
        while len(children) < n_offsprings:
            role = int(random_state.choice(len(base), p=shares))
            child = self._child(base, role, parents[role], random_state)
            children.append(child or base.with_map(role, self._sampled(chances[role], random_state)))
        return Population.new(X=as_column(children))

    def _first_set(self, rng: np.random.Generator) -> MapSet:
        """Return a set of solved maps and sampled ones, as long as there is no best expected set."""
        archive, size = self.expectations.archive, self.expectations.size
        known = [archive.scenarios[name] for name in archive.solved()][: size - 1]
        return MapSet((*known, *(self.sampling.draw(rng) for _ in range(size - len(known)))))

    def _parents(self, role: int) -> MapSet:
        """Return the best maps in a role, the best first."""
        return self.expectations.archive.map_set(self.expectations.ranked(role)[:PARENTS])

    def _chances_of_families(self, role: int) -> dict[Hashable, float]:
        """Return for each family the share of its sampled maps that succeeded in a role, relative to the largest share.

        A family counts as if one further map had succeeded, of as many as there are families.
        """
        expectations = self.expectations
        scenarios = expectations.archive.scenarios
        sampled = [name for name in scenarios if name not in expectations.parents]
        best = [name for name in expectations.ranked(role) if name not in expectations.parents][:BEST_SAMPLED]
        tried, good = (Counter(family_of(scenarios[name]) for name in some) for some in (sampled, best))
        shares = {family: (1 + good[family]) / (len(tried) + count) for family, count in tried.items()}
        return {family: share / max(shares.values()) for family, share in shares.items()}

    def _sampled(self, chances: Mapping[Hashable, float], rng: np.random.Generator) -> Scenario:
        """Return a sampled map; those of families that succeeded more often are more likely."""
        for _ in range(MAX_TRIES):
            drawn = self.sampling.draw(rng)
            if rng.random() < chances.get(family_of(drawn), 1.0):
                break
        return drawn

    def _child(self, base: MapSet, role: int, parents: MapSet, rng: np.random.Generator) -> MapSet | None:
        """Return the set with a mutated parent in a role; None if the new map shall be sampled."""
        if rng.random() < FRESH or not (trials := self._trials(base, role, parents, rng)):
            return None
        children = [trial.after[role] for trial, _ in trials]
        trial, parent = trials[self.expectations.most_promising(children, role, rng)]
        self.expectations.add_parent(trial.after[role], parent)
        return self.mutation.note(trial)

    def _trials(
        self, base: MapSet, role: int, parents: MapSet, rng: np.random.Generator
    ) -> list[tuple[Trial, Scenario]]:
        """Return mutations of parents to maps that were not evaluated before, each with its parent."""
        mates = [one.genome for one in parents if one.genome is not None]
        found: list[tuple[Trial, Scenario]] = []
        for _ in range(MAX_TRIES):
            parent = parents[min(int(rng.exponential(PARENTS / 3)), len(parents) - 1)]
            trial = self.mutation.mutated_in(base.with_map(role, parent), role, role, rng, mates, before=base)
            if trial.after[role].world_digest not in self.expectations.archive.scenarios:
                found.append((trial, parent))
            if len(found) == SCREENED:
                break
        return found


def family_of(scenario: Scenario) -> Hashable:
    """Return what tells the family of a map, with its options, from others; None for a map without a genome."""
    genome = scenario.genome
    return None if genome is None else (genome.family, repr(genome.options))
