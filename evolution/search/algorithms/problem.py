"""The search as a pymoo problem over map sets, and the steps of a pymoo algorithm that solves it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from pymoo.algorithms.base.genetic import GeneticAlgorithm
from pymoo.core.evaluator import Evaluator as PymooEvaluator
from pymoo.core.population import Population
from pymoo.core.problem import Problem

from evolution.driving import SetResults
from evolution.search.algorithms.archive_mating import ArchiveMating
from evolution.search.algorithms.registry import ALGORITHMS
from evolution.search.algorithms.settings import GaSettings
from evolution.search.expectations import Expectations
from evolution.search.judging import Fitness, Judgement, Objectives
from evolution.search.operators import (
    Column,
    MapCrossover,
    MapMutation,
    MapRepair,
    MapSampling,
    MapSetDuplicates,
    as_column,
)
from gym_mapbench.errors import PluginError
from gym_mapbench.world.scenario import MapSet

EvaluateSets = Callable[[Sequence[MapSet]], list[SetResults]]


@dataclass(frozen=True)
class Evaluation:
    """A map set with its results and their judgement."""

    map_set: MapSet
    results: SetResults
    judgement: Judgement


class MapSetProblem(Problem):  # type: ignore[misc]
    """One variable: a :class:`MapSet` in an object column; objectives and constraints are those of the judgement.

    Individuals get their :class:`Evaluation` as pymoo data ``"evaluation"``.

    Args:
        evaluate_sets: Evaluates map sets and returns their results in the same order.
        objectives: Judge them. A cluster fitness without a scale is calibrated on the first sets evaluated.
    """

    def __init__(self, evaluate_sets: EvaluateSets, objectives: Objectives) -> None:
        super().__init__(n_var=1, n_obj=len(objectives.names), n_ieq_constr=len(objectives.constraints))
        self.evaluate_sets = evaluate_sets
        self.objectives = objectives

    @property
    def fitness(self) -> Fitness:
        """The fitness, which gives the first objective."""
        return self.objectives.fitness

    def _evaluate(self, X: Column, out: dict[str, Any], *_: Any, **__: Any) -> None:
        map_sets: list[MapSet] = list(X[:, 0])
        results = self.evaluate_sets(map_sets)
        self.objectives = self.objectives.calibrated(results)
        evaluations = np.empty(len(map_sets), dtype=object)
        for index, (map_set, of_set) in enumerate(zip(map_sets, results, strict=True)):
            evaluations[index] = Evaluation(map_set, of_set, self.objectives(map_set, of_set))
        out["F"] = np.array([one.judgement.objectives for one in evaluations])
        out["G"] = np.array([one.judgement.constraints for one in evaluations])
        out["evaluation"] = evaluations


def make_algorithm(
    settings: GaSettings,
    problem: MapSetProblem,
    sampling: MapSampling,
    mutation: MapMutation,
    rng: np.random.Generator,
    evaluations: int,
    expectations: Expectations | None = None,
) -> GeneticAlgorithm:
    """Return the algorithm, set up and ready to be asked; selection and survival are its own.

    Args:
        settings: Options of the algorithm.
        problem: The problem to solve.
        sampling: Samples new map sets.
        mutation: Changes offspring.
        rng: The search's only source of randomness.
        evaluations: Map sets evaluated in total.
        expectations: Which maps of the archive are parents; None if sets of the population are.

    Raises:
        PluginError: If a third-party algorithm fails, or is none.
    """
    with ALGORITHMS.blamed(settings.algorithm):
        algorithm = settings.kind.make(
            pop_size=settings.pop_size,
            sampling=sampling,
            crossover=MapCrossover(settings.crossover, settings.crossover_probability),
            mutation=mutation,
            repair=MapRepair(sampling.shapes),
            eliminate_duplicates=MapSetDuplicates(),
        )
        if not isinstance(algorithm, GeneticAlgorithm):
            raise PluginError(
                f"search algorithm {settings.algorithm!r}: expected a GeneticAlgorithm of pymoo, got {algorithm!r:.80}"
            )
        if expectations is not None:
            options = {"repair": algorithm.repair, "eliminate_duplicates": algorithm.eliminate_duplicates}
            algorithm.mating = ArchiveMating(expectations, mutation, sampling, **options)
        # pymoo hands its seed to numpy.random.default_rng, which gives a Generator back unchanged.
        return algorithm.setup(problem, termination=("n_eval", evaluations), seed=rng)


def ask(algorithm: GeneticAlgorithm, name: str, most: int) -> Population | None:
    """Return the next individuals, no more than ``most``; None if there is nothing new.

    Args:
        algorithm: What :func:`make_algorithm` returned.
        name: Its name.
        most: Map sets that may still be evaluated.

    Raises:
        PluginError: If a third-party algorithm fails, or returns anything but individuals that are map sets.
    """
    if most < 1:
        return None
    with ALGORITHMS.blamed(name):
        algorithm.n_offsprings = min(algorithm.pop_size, most)
        asked = algorithm.ask() if algorithm.has_next() else None
    if asked is None or (isinstance(asked, Population) and not len(asked)):
        return None  # random search may sample nothing but duplicates
    if not isinstance(asked, Population) or not all(isinstance(one.X[0], MapSet) for one in asked):
        raise PluginError(f"search algorithm {name!r}: expected a Population of map sets, got {asked!r:.80}")
    return asked


def tell(algorithm: GeneticAlgorithm, name: str, offspring: Population) -> None:
    """Let an algorithm select its next population from the last one and its evaluated offspring.

    Raises:
        PluginError: If a third-party algorithm fails, or selects nothing or an individual without an evaluation.
    """
    with ALGORITHMS.blamed(name):
        algorithm.tell(infills=offspring)
        selected = [isinstance(one.get("evaluation"), Evaluation) for one in algorithm.pop]
    if not selected or not all(selected):
        got = f"{sum(selected)} of {len(selected)}"
        raise PluginError(f"search algorithm {name!r}: expected a population of evaluated map sets, got {got}")


def judge_again(algorithm: GeneticAlgorithm, joining: Sequence[MapSet] = ()) -> None:
    """Judge a population by all results so far, and let map sets join it; the worst sets leave.

    Args:
        algorithm: Has the population.
        joining: Evaluated sets; sets that are in the population already are left out.
    """
    known = {individual.X[0].digest for individual in algorithm.pop}
    new = [map_set for map_set in joining if map_set.digest not in known]
    everyone = Population.merge(algorithm.pop, Population.new(X=as_column(new))) if new else algorithm.pop
    PymooEvaluator(skip_already_evaluated=False).eval(algorithm.problem, everyone)
    algorithm.pop = algorithm.survival.do(
        algorithm.problem,
        everyone,
        n_survive=len(algorithm.pop),
        algorithm=algorithm,
        random_state=algorithm.random_state,
    )
