"""Patterns: what a fitness looks for in the maps of a set; each pattern has a file of its own."""

from __future__ import annotations

from typing import Any

from evolution.search.judging.patterns.base import Parts, Pattern, PatternSettings, Times, log_times
from evolution.search.judging.patterns.cluster import Cluster, pairwise_gaps
from evolution.search.judging.patterns.gini import Gini, gini
from evolution.search.judging.patterns.pairs import Pairs
from evolution.search.judging.patterns.pools import Pool, held_apart
from evolution.search.judging.patterns.regret import Regret
from evolution.search.judging.patterns.roles import Roles
from gym_mapbench.errors import ConfigError
from gym_mapbench.registry import Registry, must_be_subclass

__all__ = [
    "FITNESSES",
    "Parts",
    "Pattern",
    "PatternSettings",
    "Pool",
    "Times",
    "gini",
    "held_apart",
    "log_times",
    "pairwise_gaps",
]


def _must_be_pattern(entry: Any) -> type[Pattern]:
    """Accept a subclass of ``Pattern`` with names of objectives and constraints; raises ``ConfigError`` otherwise."""
    kind = must_be_subclass(Pattern)(entry)
    for what, fewest in (("objectives", 1), ("constraints", 0)):
        names: object = getattr(kind, what)
        listed = names if isinstance(names, tuple | list) else (None,)
        if len(listed) < fewest or not all(isinstance(name, str) for name in listed):
            raise ConfigError(f"{what}: expected a tuple of {fewest} names or more, got {names!r:.80}")
    return kind


FITNESSES: Registry[type[Pattern]] = Registry(
    "fitness",
    "fitnesses",
    {"gini": Gini, "cluster": Cluster, "roles": Roles, "pairs": Pairs, "regret": Regret},
    check=_must_be_pattern,
)
"""The fitnesses by name."""
