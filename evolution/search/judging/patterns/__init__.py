"""Patterns: what a fitness looks for in the driven maps of a set; each pattern has a file of its own."""

from __future__ import annotations

from typing import Any

from evolution.search.judging.patterns.base import Pattern, Times
from evolution.search.judging.patterns.cluster import (
    Cluster,
    cluster_score,
    pairwise_gaps,
    partial_pattern_score,
    pattern_score,
)
from evolution.search.judging.patterns.gini import NO_PATTERN, Gini, gini, gini_fitness
from evolution.search.judging.patterns.pairs import Pairs, pair_scores
from evolution.search.judging.patterns.pools import Found, Pool, Readings, held_apart
from evolution.search.judging.patterns.roles import Roles, groups, role_scores
from gym_mapbench.errors import ConfigError
from gym_mapbench.registry import Registry

__all__ = [
    "FITNESSES",
    "NO_PATTERN",
    "Cluster",
    "Found",
    "Gini",
    "Pairs",
    "Pattern",
    "Pool",
    "Readings",
    "Roles",
    "Times",
    "cluster_score",
    "gini",
    "gini_fitness",
    "groups",
    "held_apart",
    "pair_scores",
    "pairwise_gaps",
    "partial_pattern_score",
    "pattern_score",
    "role_scores",
]


def _pattern(entry: Any) -> type[Pattern]:
    """Accept a pattern's class."""
    if isinstance(entry, type) and issubclass(entry, Pattern):
        return entry
    raise ConfigError(f"expected a subclass of {Pattern.__module__}.Pattern, got {entry!r:.80}")


FITNESSES: Registry[type[Pattern]] = Registry(
    "fitness", "fitnesses", {"gini": Gini, "cluster": Cluster, "roles": Roles, "pairs": Pairs}, check=_pattern
)
"""The fitnesses by name."""
