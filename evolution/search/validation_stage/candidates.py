"""Candidates of the validation stage: the maps of the sets with the best expected held-out fitness."""

from __future__ import annotations

from evolution.search.archive import Archive, best_by_exchange
from evolution.search.judging import Fitness, Names
from evolution.search.judging.expected_fitness import Estimate, estimates_of, expected_fitness


def best_expected(archive: Archive, fitness: Fitness, size: int, without: frozenset[str] = frozenset()) -> Names:
    """Return the set with the best expected held-out fitness; empty if there are too few solved maps.

    The search for it begins with the set of the best fitness and ends where no exchange of a single map improves it.
    Where the order of maps does not count, it is the set of the best fitness.

    Args:
        archive: Every evaluated map.
        fitness: Judges sets.
        size: Maps in a set.
        without: Maps to leave out, by digest.
    """
    names = archive.best(fitness, size, without)
    if not names or not fitness.kind.ordered:
        return names
    estimates = _estimates(archive, fitness, without)
    return best_by_exchange(names, estimates, lambda some: expected_fitness(some, estimates, fitness))


def largest_contribution(
    archive: Archive, fitness: Fitness, names: Names, without: frozenset[str] = frozenset()
) -> str:
    """Return the map of a set with the largest marginal contribution to the expected held-out fitness.

    It is the map without which the best remaining set has the worst expected held-out fitness.

    Args:
        archive: Every evaluated map.
        fitness: Judges sets.
        names: The set, by digest.
        without: Maps to leave out in any case.
    """
    estimates = _estimates(archive, fitness)

    def fitness_without(name: str) -> float:
        others = best_expected(archive, fitness, len(names), without | {name})
        if not others:
            return float("inf")
        if fitness.kind.ordered:
            return expected_fitness(others, estimates, fitness)
        return fitness(archive.results_of(archive.map_set(others))).fitness

    return max(names, key=fitness_without)


def _estimates(archive: Archive, fitness: Fitness, without: frozenset[str] = frozenset()) -> dict[str, Estimate]:
    """Return the estimates of all solved maps, except for some."""
    maps = archive.solved(without)
    return estimates_of(maps, {name: archive.judged(name, fitness) for name in maps}, fitness)
