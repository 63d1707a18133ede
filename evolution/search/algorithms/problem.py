"""The search as a pymoo problem over map sets, and the pymoo algorithms that solve it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from pymoo.algorithms.soo.nonconvex.ga import GA
from pymoo.core.evaluator import Evaluator as JudgeAgain
from pymoo.core.population import Population
from pymoo.core.problem import Problem

from evolution.driving import SetResults
from evolution.search.judging.fitness import Fitness, FitnessBreakdown
from evolution.search.operators.crossover import MapCrossover
from evolution.search.operators.duplicates import MapSetDuplicates
from evolution.search.operators.mutation import MapMutation
from evolution.search.operators.repair import MapRepair
from evolution.search.operators.sampling import Column, DrawMap, MapSampling, as_column
from evolution.search.settings import EvolveSettings
from gym_mapbench.generator import sample_map
from gym_mapbench.world.scenario import MapSet

EvaluateSets = Callable[[Sequence[MapSet]], list[SetResults]]


@dataclass(frozen=True)
class Evaluation:
    """A map set with the results of driving it and what they are worth."""

    map_set: MapSet
    results: SetResults
    fitness: FitnessBreakdown


class MapSetProblem(Problem):  # type: ignore[misc]
    """One objective, minimised, over one variable: a :class:`MapSet` in an object column.

    Individuals get their :class:`Evaluation` as pymoo data ``"evaluation"``.

    Args:
        evaluate_sets: Drives map sets and returns their results in the same order.
        fitness: Judges them. A cluster fitness without a scale is calibrated on the first sets evaluated.
    """

    def __init__(self, evaluate_sets: EvaluateSets, fitness: Fitness) -> None:
        super().__init__(n_var=1, n_obj=1)
        self.evaluate_sets = evaluate_sets
        self.fitness = fitness

    def _evaluate(self, X: Column, out: dict[str, Any], *_: Any, **__: Any) -> None:
        map_sets: list[MapSet] = list(X[:, 0])
        results = self.evaluate_sets(map_sets)
        self.fitness = self.fitness.calibrated(results)
        evaluations = np.empty(len(map_sets), dtype=object)
        for index, (map_set, of_set) in enumerate(zip(map_sets, results, strict=True)):
            evaluations[index] = Evaluation(map_set, of_set, self.fitness(of_set))
        out["F"] = np.array([[one.fitness.total] for one in evaluations])
        out["evaluation"] = evaluations


class RandomSearch(GA):  # type: ignore[misc]
    """A baseline: the GA without variation; every generation is sampled anew, and the best survive."""

    def _infill(self) -> Population:
        samples = self.initialization.sampling(self.problem, self.n_offsprings, random_state=self.random_state)
        return self.eliminate_duplicates.do(samples, self.pop)


def make_algorithm(
    settings: EvolveSettings,
    problem: MapSetProblem,
    rng: np.random.Generator,
    mutation: MapMutation,
    draw_map: DrawMap = sample_map,
) -> GA:
    """Build the algorithm, set up and ready to be asked.

    Binary tournament and elitist survival are pymoo's own; everything draws from ``rng``.

    Args:
        settings: Options of the search.
        problem: What is solved.
        rng: The search's only source of randomness.
        mutation: How offspring are changed.
        draw_map: How sampling draws one map.
    """
    algorithm = {"ga": GA, "random": RandomSearch}[settings.algorithm](
        pop_size=settings.pop_size,
        sampling=MapSampling(settings.maps_per_set, settings.shapes, draw_map),
        crossover=MapCrossover(settings.crossover, settings.crossover_probability),
        mutation=mutation,
        repair=MapRepair(settings.shapes),
        eliminate_duplicates=MapSetDuplicates(),
    )
    # pymoo hands its seed to numpy.random.default_rng, which gives a Generator back unchanged.
    return algorithm.setup(problem, termination=("n_eval", settings.evaluations), seed=rng)


def ask(algorithm: GA, most: int) -> Population | None:
    """Return the next individuals, no more than ``most``; None if there is nothing new."""
    if most < 1:
        return None
    algorithm.n_offsprings = min(algorithm.pop_size, most)
    asked = algorithm.ask()
    return asked if asked is not None and len(asked) else None  # random search may find nothing but duplicates


def rejudge(algorithm: GA, joining: Sequence[MapSet]) -> None:
    """Judge a population by all that is known by now, and let map sets join it; the worst have to leave.

    Args:
        algorithm: Has the population.
        joining: Driven sets; those that are in the population already are left out.
    """
    known = {individual.X[0].digest for individual in algorithm.pop}
    new = [map_set for map_set in joining if map_set.digest not in known]
    everyone = Population.merge(algorithm.pop, Population.new(X=as_column(new))) if new else algorithm.pop
    JudgeAgain(skip_already_evaluated=False).eval(algorithm.problem, everyone)
    algorithm.pop = algorithm.survival.do(
        algorithm.problem,
        everyone,
        n_survive=len(algorithm.pop),
        algorithm=algorithm,
        random_state=algorithm.random_state,
    )
