"""Credit: operators of mutation that improve map sets are used more (adaptive operator selection).

Every operator has a success rate of its own in every role, the rank of the mutated map's reading in its set: what makes
an easy map easier is not what makes a hard one harder. It is used in proportion to its configured probability times
that rate, (1 + improved) / (2 + tried), as after a uniform prior.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from gym_mapbench.scenario import MapSet


@dataclass(frozen=True)
class Trial:
    """A mutation whose result is not known yet.

    Args:
        before: The map set as it was.
        after: Digest of the mutated set.
        role: Rank of the mutated map's reading in the set.
        operators: What changed the map.
    """

    before: MapSet
    after: str
    role: int
    operators: tuple[str, ...]


@dataclass
class Credit:
    """How often operators were tried and improved a set, by role and name."""

    tried: Counter[tuple[int, str]] = field(default_factory=Counter)
    improved: Counter[tuple[int, str]] = field(default_factory=Counter)

    def add(self, trial: Trial, improved: bool) -> None:
        """Count one mutation."""
        for name in set(trial.operators):
            self.tried[trial.role, name] += 1
            self.improved[trial.role, name] += improved

    def chances(self, configured: Mapping[str, float], role: int) -> dict[str, float]:
        """Return the probabilities of the operators in a role.

        Args:
            configured: Their configured probabilities, whose sum is 1.
            role: Rank of the map's reading in its set.
        """
        weights = {
            name: chance * (1 + self.improved[role, name]) / (2 + self.tried[role, name])
            for name, chance in configured.items()
        }
        total = sum(weights.values())
        return {name: weight / total for name, weight in weights.items()}

    def rows(self) -> Sequence[Mapping[str, object]]:
        """Return what was counted, a row for each role and operator."""
        return [
            {"role": role, "operator": name, "tried": count, "improved": self.improved[role, name]}
            for (role, name), count in sorted(self.tried.items())
        ]
