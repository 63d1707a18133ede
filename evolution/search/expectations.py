"""What a search expects of maps and sets in further trials: the knowledge that guides it from generation to generation.

The archive holds what runs measured. This module says what to make of it: which set is the best expected one, how good
that set would be with another map in one of its roles, and which maps might still improve it. The *role* of a map is
the rank of its score in the set.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from evolution.search.archive import Archive, best_by_exchange
from evolution.search.judging import Fitness, Names
from evolution.search.judging.expected_fitness import Estimate, estimates_of, expected_fitness
from gym_mapbench.world.scenario import Scenario


class Expectations:
    """Estimates of the maps of an archive, and the best expected set of them.

    Args:
        archive: Every evaluated map.
        fitness: Returns what judges sets.
        size: Maps in a set.

    Attributes:
        parents: For each map that mutation made, by digest, the map it was made of.
        estimates: Of every map without a failed run, by digest.
        best: The solved maps of the best expected set, in order of their scores; empty if there are too few.
    """

    def __init__(self, archive: Archive, fitness: Callable[[], Fitness], size: int) -> None:
        self.archive = archive
        self.size = size
        self.parents: dict[str, str] = {}
        self.estimates: dict[str, Estimate] = {}
        self.best: Names = ()
        self._fitness = fitness

    def add_parent(self, child: Scenario, parent: Scenario) -> None:
        """Note of which map a new map was made; a map that was evaluated before keeps what is known of it."""
        if child.world_digest not in self.archive.scenarios:
            self.parents[child.world_digest] = parent.world_digest

    def update(self) -> None:
        """Estimate all maps by all runs so far, and find the best expected set again."""
        self.estimates = estimates_of(self.archive.all_results(), self.parents, self._fitness())
        self.best = self._best()

    def _best(self) -> Names:
        """Return the set that no exchange of a single map improves, in a search from the set of the best fitness."""
        names = self.archive.best(self._fitness(), self.size)
        if not names:
            return ()
        best = best_by_exchange(names, self.archive.solved(), self.value_of)
        return tuple(sorted(best, key=lambda name: self.estimates[name].score))

    def value_of(self, names: Names) -> float:
        """Return the expected fitness of a set."""
        return expected_fitness(names, self.estimates, self._fitness())

    def value_in(self, role: int, name: str) -> float:
        """Return the expected fitness of the best set with a map in a role; infinite if another role has it."""
        return self._value_in(role, name, self.estimates)

    def ranked(self, role: int) -> list[str]:
        """Return the solved maps, the best in a role first."""
        return sorted(self.archive.solved(), key=lambda name: self.value_in(role, name))

    def potentials(self) -> dict[str, float]:
        """Return how good the best set would be with each solved map in its best role if the map were as hoped.

        A map with one repeat is hoped to be steady and never to fail. With ``n`` repeats the hope is ``1/n`` of that.
        """
        found = {}
        for name in self.archive.solved():
            one, doubt = self.estimates[name], 1.0 - 1.0 / self.archive.repeats_of(name)
            hoped = one._replace(deviation=doubt * one.deviation, success=1.0 - doubt * (1.0 - one.success))
            of_best = {other: self.estimates[other] for other in self.best}
            found[name] = min(self._value_in(role, name, {**of_best, name: hoped}) for role in range(self.size))
        return found

    def bars(self) -> list[float]:
        """Return for each role the expected fitness of the best set with the best other map in it."""
        others = [name for name in self.archive.solved() if name not in self.best]
        return [min((self.value_in(role, name) for name in others), default=np.inf) for role in range(self.size)]

    def slowest_first(self, top: float = 1 / 6) -> list[int]:
        """Return the places of the controllers: first the one whose values set the highest scores apart.

        Args:
            top: Share of the solved maps whose scores count as high.
        """
        known = sorted((self.estimates[name] for name in self.archive.solved()), key=lambda one: -one.score)
        values = np.array([one.values for one in known])
        excess = values[: max(1, round(top * len(values)))].mean(axis=0) - np.median(values, axis=0)
        return [int(place) for place in np.argsort(-excess, kind="stable")]

    def _value_in(self, role: int, name: str, estimates: Mapping[str, Estimate]) -> float:
        names = (*self.best[:role], name, *self.best[role + 1 :])
        return expected_fitness(names, estimates, self._fitness()) if len(set(names)) == len(names) else np.inf
