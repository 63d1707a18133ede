"""What a search expects of maps and sets in further trials: the knowledge that guides it from generation to generation.

The archive holds what runs measured. This module says what to make of it: which set is the best expected one, how good
that set would be with another map in one of its roles, and which maps might still improve it. The *role* of a map is
the rank of its score in the set.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from evolution.search.archive import Archive, best_by_exchange
from evolution.search.judging import Fitness, Names
from evolution.search.judging.expected_fitness import RELIABILITY, Estimate, estimates_of, expected_fitness
from evolution.search.surrogate import Forecast, Surrogate
from gym_mapbench.world.scenario import Scenario

EVEN = 0.1
"""Share of new maps and further seeds that is distributed evenly over the roles."""


class Expectations:
    """Estimates of the maps of an archive, and the best expected set of them.

    Args:
        archive: Every evaluated map.
        fitness: Returns what judges sets.
        size: Maps in a set.
        surrogate: Estimates maps of motifs by the runs on similar ones; None for estimates by parents alone.
        reliability: Chance that no run of a trial fails, below which a set is expected to cost more.

    Attributes:
        parents: For each map that mutation made, by digest, the map it was made of.
        estimates: Of every map whose first runs reached the goal, or count if they fail, by digest.
        known: The maps that may be in a set: those on which every controller has reached the goal, maybe with rare
            failures; or all, if failed runs have a value.
        best: The known maps of the best expected set, in order of their scores; empty if there are too few.
    """

    def __init__(
        self,
        archive: Archive,
        fitness: Callable[[], Fitness],
        size: int,
        surrogate: Surrogate | None = None,
        reliability: float = RELIABILITY,
    ) -> None:
        self.archive = archive
        self.size = size
        self.parents: dict[str, str] = {}
        self.estimates: dict[str, Estimate] = {}
        self.known: Names = ()
        self.best: Names = ()
        self._fitness = fitness
        self._surrogate = surrogate
        self._reliability = reliability
        self._forecasts: dict[str, Forecast] = {}

    def add_parent(self, child: Scenario, parent: Scenario) -> None:
        """Note of which map a new map was made; a map that was evaluated before keeps what is known of it."""
        if child.world_digest not in self.archive.scenarios:
            self.parents[child.world_digest] = parent.world_digest

    def update(self) -> None:
        """Estimate all maps by all runs so far, and find the best expected set again."""
        results, scenarios = self.archive.all_results(), self.archive.scenarios
        self.estimates = estimates_of(results, self.parents, self._fitness())
        if self._surrogate is not None:
            self._surrogate.update(scenarios, results, self._fitness())
            self._forecasts = self._surrogate.forecasts({name: scenarios[name] for name in self.estimates})
            self.estimates |= {name: forecast.estimate(self._fitness()) for name, forecast in self._forecasts.items()}
        fitness = self._fitness()
        counted = ((name, fitness.counted(results[name])) for name in self.estimates)
        self.known = tuple(name for name, of_map in counted if fitness.values_of(of_map) is not None)
        self.best = self._best()

    def _best(self) -> Names:
        """Return the set that no exchange of a single map improves, in a search from the set of the best fitness."""
        names = self.archive.best(self._fitness(), self.size) or self.known[: self.size]
        if len(names) < self.size:
            return ()
        best = best_by_exchange(names, self.known, self.value_of)
        return tuple(sorted(best, key=lambda name: self.estimates[name].score))

    def value_of(self, names: Names) -> float:
        """Return the expected fitness of a set."""
        return self._expected(names, self.estimates)

    def value_in(self, role: int, name: str) -> float:
        """Return the expected fitness of the best set with a map in a role; infinite if another role has it."""
        return self._value_in(role, name, self.estimates)

    @property
    def predicts(self) -> bool:
        """Whether the surrogate has runs on maps of motifs, by which it predicts new ones."""
        return bool(self._forecasts)

    def may_join(self, name: str, bars: Iterable[float]) -> bool:
        """Return whether a map may reach the expected fitness of one role, within a deviation of its forecast."""
        forecast = self._forecasts.get(name)
        shifts = [forecast.estimate_at(self._fitness(), shift) for shift in (-1.0, 1.0)] if forecast else []
        return any(
            self._value_in(role, name, self._with(name, one)) <= bar
            for role, bar in enumerate(bars)
            for one in (self.estimates[name], *shifts)
        )

    def most_promising(self, scenarios: Sequence[Scenario], role: int, rng: np.random.Generator) -> int:
        """Return the place of the most promising of some new maps, by Thompson sampling.

        A standard normal number is sampled, and all forecasts are shifted by this number of standard deviations. One
        sample for all maps treats the errors of their forecasts as perfectly correlated, so many similar maps do not
        crowd out a different one. A map that is not built of motifs has no forecast; if no map has one, the first is
        selected.

        Args:
            scenarios: Maps without runs.
            role: The rank that the map would have in the best set.
            rng: Source of the sample.
        """
        new, shift = {one.world_digest: one for one in scenarios}, float(rng.normal())
        forecasts = self._surrogate.forecasts(new) if self._surrogate else {}
        values = [np.inf] * len(scenarios)
        for number, name in enumerate(one.world_digest for one in scenarios):
            if forecast := forecasts.get(name):
                estimate = forecast.estimate_at(self._fitness(), shift)
                values[number] = self._value_in(role, name, self._with(name, estimate))
        return int(np.argmin(values))

    def ranked(self, role: int) -> list[str]:
        """Return the known maps, the best in a role first."""
        return sorted(self.known, key=lambda name: self.value_in(role, name))

    def turn(self, name: str) -> tuple[int, ...]:
        """Return the number of further runs of each controller on a map when its turn comes.

        One run of the controller with which the variance of the mean logarithm falls most; if the surrogate does not
        know their noise, one run of each controller.
        """
        runs = self.archive.runs_of(name)
        if (forecast := self._forecasts.get(name)) is None:
            return tuple(1 for _ in runs)
        falls = [one.noise**2 / (count * (count + 1)) for one, count in zip(forecast.logarithms, runs, strict=True)]
        return tuple(int(place == np.argmax(falls)) for place in range(len(runs)))

    def potentials(self) -> dict[str, float]:
        """Return the potential of every known map."""
        return {name: self.potential(name) for name in self.known}

    def potential(self, name: str) -> float:
        """Return how good the best set would be with a known map in its best role if the map were as hoped.

        A map with one repeat is hoped to be steady and never to fail. With ``n`` repeats the hope is ``1/n`` of that.
        """
        doubt = 1.0 - 1.0 / self.archive.repeats_of(name)
        return min(self._value_as_hoped(role, name, doubt) for role in range(self.size))

    def shares_of_roles(self) -> NDArray[np.float64]:
        """Return what share of new maps and further seeds each role gets: in proportion to its possible gain."""
        gains = np.maximum(self._possible_gains(), 0.0)
        even = np.full(self.size, 1.0 / self.size)
        return (1.0 - EVEN) * gains / gains.sum() + EVEN * even if gains.any() else even

    def candidates(self, count: int, among: Collection[str] | None = None) -> list[str]:
        """Return the maps of the best set, and further ones that are good in a role, by the shares of the roles.

        Args:
            count: Number of maps; fewer if fewer are known.
            among: Digests of the maps that may be taken besides those of the best set; None for all known maps.
        """
        known = [name for name in self.known if name not in self.best and (among is None or name in among)]
        chosen, shares, taken = list(self.best), self.shares_of_roles(), np.ones(self.size)
        ranked = [iter(sorted(known, key=partial(self.value_in, role))) for role in range(self.size)]
        while len(chosen) < min(count, len(self.best) + len(known)):
            role = int(np.argmax(shares / (1.0 + taken)))
            chosen.append(next(name for name in ranked[role] if name not in chosen))
            taken[role] += 1
        return chosen

    def _possible_gains(self) -> list[float]:
        """Return for each role by how much the best set might be better with another map of the same rank in it.

        The gain is that of the known map that would be best there if it were steady and never failed.
        """
        value, bounds = self.value_of(self.best), [-np.inf, *(self.estimates[name].score for name in self.best), np.inf]
        gains = []
        for role in range(self.size):
            of_rank = [name for name in self.known if bounds[role] <= self.estimates[name].score <= bounds[role + 2]]
            gains.append(value - min(self._value_as_hoped(role, name, 0.0) for name in of_rank))
        return gains

    def _value_as_hoped(self, role: int, name: str, doubt: float) -> float:
        """Return the expected fitness of the best set with a map in a role, of whose faults a share is left."""
        one = self.estimates[name]
        hoped = one._replace(deviation=doubt * one.deviation, success=1.0 - doubt * (1.0 - one.success))
        return self._value_in(role, name, self._with(name, hoped))

    def _with(self, name: str, estimate: Estimate) -> dict[str, Estimate]:
        """Return the estimates of the best set and of one more map."""
        return {**{other: self.estimates[other] for other in self.best}, name: estimate}

    def bars(self, names: Iterable[str]) -> list[float]:
        """Return for each role the expected fitness of the best set with the best of some other maps in it."""
        others = [name for name in names if name not in self.best]
        return [min((self.value_in(role, name) for name in others), default=np.inf) for role in range(self.size)]

    def most_different_first(self) -> list[int]:
        """Return the places of the controllers: first the one whose values differ most between maps.

        The middle 80 % of the known maps count. The difference is relative to the sum of smallest and largest value.
        """
        values = np.array([self.estimates[name].values for name in self.known])
        low, high = np.quantile(values, [0.1, 0.9], axis=0)
        sums = np.abs(high) + np.abs(low)
        return [int(place) for place in np.argsort((low - high) / np.where(sums > 0.0, sums, 1.0), kind="stable")]

    def _value_in(self, role: int, name: str, estimates: Mapping[str, Estimate]) -> float:
        names = (*self.best[:role], name, *self.best[role + 1 :])
        return self._expected(names, estimates) if len(set(names)) == len(names) else np.inf

    def _expected(self, names: Names, estimates: Mapping[str, Estimate]) -> float:
        return expected_fitness(names, estimates, self._fitness(), self._reliability)
