"""Patterns: what a fitness looks for in the maps of a set; each pattern has a file of its own."""

from __future__ import annotations

from evolution.search.judging.patterns.base import Parts, Pattern, PatternSettings, Times, log_times
from evolution.search.judging.patterns.cluster import (
    Cluster,
    cluster_score,
    pairwise_gaps,
    partial_pattern_score,
    pattern_score,
)
from evolution.search.judging.patterns.gini import NO_PATTERN, Gini, gini, gini_fitness
from evolution.search.judging.patterns.pairs import Pairs, pair_scores
from evolution.search.judging.patterns.pools import Found, Pool, Scores, held_apart
from evolution.search.judging.patterns.regret import Regret
from evolution.search.judging.patterns.roles import Roles, groups, role_scores
from gym_mapbench.registry import Registry, must_be_subclass

__all__ = [
    "FITNESSES",
    "NO_PATTERN",
    "Cluster",
    "Found",
    "Gini",
    "Pairs",
    "Parts",
    "Pattern",
    "PatternSettings",
    "Pool",
    "Regret",
    "Roles",
    "Scores",
    "Times",
    "cluster_score",
    "gini",
    "gini_fitness",
    "groups",
    "held_apart",
    "log_times",
    "pair_scores",
    "pairwise_gaps",
    "partial_pattern_score",
    "pattern_score",
    "role_scores",
]

FITNESSES: Registry[type[Pattern]] = Registry(
    "fitness",
    "fitnesses",
    {"gini": Gini, "cluster": Cluster, "roles": Roles, "pairs": Pairs, "regret": Regret},
    check=must_be_subclass(Pattern),
)
"""The fitnesses by name."""
