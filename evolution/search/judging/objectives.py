"""The objectives of a search: the fitness of a map set, and what ``judging.objectives`` names besides.

All objectives are minimised. A metric of runs stands for the fitness in that metric: sets on which the controllers
differ in it the way the fitness wants. A measure of maps is its mean over the maps of a set.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from statistics import fmean

from evolution.driving import SetResults
from evolution.search.judging.fitness import Fitness
from evolution.search.judging.judgement import Judgement
from evolution.search.judging.settings import MAP_MEASURES
from gym_mapbench.world.scenario import MapSet

CONSTRAINTS = ("failed_share", "fitness_limit")
"""Constraints of a search with several objectives: every run reaches the goal, and the fitness is at most 0."""


@dataclass(frozen=True)
class Objectives:
    """Judges map sets by all objectives of a search: a function from a set and its results to its Judgement.

    Args:
        fitness: Gives the first objective.

    Attributes:
        names: Names of the objectives.
        constraints: Names of the constraints.
    """

    fitness: Fitness

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the objectives."""
        return (*self.fitness.objectives, *self.further)

    @property
    def constraints(self) -> tuple[str, ...]:
        """Names of the constraints."""
        return (*self.fitness.constraints, *(CONSTRAINTS if self.further else ()))

    @property
    def are_several(self) -> bool:
        """Whether there are several, so that the best sets form a Pareto front."""
        return len(self.names) > 1

    @property
    def further(self) -> tuple[str, ...]:
        """Names of the objectives that are not the fitness's own."""
        return self.fitness.settings.objectives

    def calibrated(self, results: Sequence[SetResults]) -> Objectives:
        """Return the same with a calibrated fitness; itself if it needs no scale."""
        fitness = self.fitness.calibrated(results)
        return self if fitness is self.fitness else replace(self, fitness=fitness)

    def __call__(self, map_set: MapSet, results: SetResults) -> Judgement:
        """Judge one map set.

        Args:
            map_set: Its maps.
            results: ``results[map][controller][repeat]``.
        """
        judged = self.fitness(results)
        if not self.further:
            return judged
        objectives = (*judged.objectives, *(value(map_set, results) for value in self._values))
        constraints = (*judged.constraints, 1.0 - judged.success_rate, judged.fitness)
        return replace(judged, objectives=objectives, constraints=constraints)

    @cached_property
    def _values(self) -> tuple[Callable[[MapSet, SetResults], float], ...]:
        return tuple(_measure(name) if name in MAP_MEASURES else self._in_metric(name) for name in self.further)

    def _in_metric(self, name: str) -> Callable[[MapSet, SetResults], float]:
        """Return the fitness in another metric."""
        settings = self.fitness.settings.replace(metric=name, objectives=())
        fitness = replace(self.fitness, settings=settings)
        return lambda _, results: fitness(results).fitness


def _measure(name: str) -> Callable[[MapSet, SetResults], float]:
    """Return the mean of a measure over the maps of a set."""
    measure = MAP_MEASURES[name]
    return lambda map_set, _: fmean(measure(scenario.map) for scenario in map_set)
