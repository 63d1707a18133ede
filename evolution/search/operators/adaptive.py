"""Adaptive operator selection: operators are selected in proportion to the gain of their earlier uses.

The credit of an operator is the mean gain in fitness of its mutations, those without gain included. Credit is kept by
role, the rank of the mutated map's score in its set, and within a role by operator: an edit that makes an easy map
easier does not make a hard map harder. A role is selected in proportion to its credit, an operator in proportion to
its credit times its configured probability. A role or operator without a trial has the mean gain of all mutations.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Mapping
from dataclasses import dataclass, field

from gym_mapbench.world.scenario import MapSet


@dataclass(frozen=True)
class Trial:
    """A mutation whose gain is not known yet.

    Args:
        before: The map set before the mutation.
        after: The mutated set.
        role: Rank of the mutated map's score in the set.
        operators: Operators that changed the map.
    """

    before: MapSet
    after: MapSet
    role: int
    operators: tuple[str, ...]


@dataclass
class Credit:
    """Number of trials and sum of gains of each role, and of each operator within a role."""

    tried: Counter[tuple[int, str]] = field(default_factory=Counter)
    gained: dict[tuple[int, str], float] = field(default_factory=lambda: defaultdict(float))

    def add(self, trial: Trial, gain: float) -> None:
        """Add one mutation; a loss counts as gain 0."""
        for name in {"", *trial.operators}:
            self.tried[trial.role, name] += 1
            self.gained[trial.role, name] += max(gain, 0.0)

    def of(self, role: int, operator: str = "") -> float:
        """Return the mean gain of an operator in a role, or of all operators in it; never 0."""
        key = role, operator
        return (self._overall + self.gained.get(key, 0.0)) / (1 + self.tried[key])

    def chances(self, configured: Mapping[str, float], role: int) -> dict[str, float]:
        """Return the probabilities of the operators in a role.

        Args:
            configured: Their configured probabilities, whose sum is 1.
            role: Rank of the map's score in its set.
        """
        weights = {name: chance * self.of(role, name) for name, chance in configured.items()}
        total = sum(weights.values())
        return {name: weight / total for name, weight in weights.items()}

    @property
    def _overall(self) -> float:
        """Mean gain of all mutations; 1 before the first gain."""
        tried = sum(count for (_, name), count in self.tried.items() if not name)
        gained = sum(gain for (_, name), gain in self.gained.items() if not name)
        return gained / tried if gained else 1.0
