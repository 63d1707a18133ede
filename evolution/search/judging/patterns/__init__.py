"""Patterns: what a fitness looks for in the maps of a set; each pattern has a file of its own."""

from __future__ import annotations

from evolution.search.judging.patterns.base import Parts, Pattern, PatternSettings, Times, log_times
from evolution.search.judging.patterns.cluster import Cluster, pairwise_gaps
from evolution.search.judging.patterns.gini import Gini, gini
from evolution.search.judging.patterns.pairs import Pairs
from evolution.search.judging.patterns.pools import Pool, held_apart
from evolution.search.judging.patterns.regret import Regret
from evolution.search.judging.patterns.roles import Roles
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

FITNESSES: Registry[type[Pattern]] = Registry(
    "fitness",
    "fitnesses",
    {"gini": Gini, "cluster": Cluster, "roles": Roles, "pairs": Pairs, "regret": Regret},
    check=must_be_subclass(Pattern),
)
"""The fitnesses by name."""
