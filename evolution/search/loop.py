"""The search loop: ask, evaluate, tell, record and write a checkpoint, generation by generation.

A search is a function of its experiment and of the results of its runs. An interrupted search is continued by
*replaying* it: the store answers the finished runs, which takes a fraction of a second per generation, and the
checkpoint says what the replay must arrive at. Nothing is unpickled, and results after the last checkpoint are not
lost.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from pymoo.algorithms.base.genetic import GeneticAlgorithm
from pymoo.core.individual import Individual

from evolution.driving import Evaluator, SetResults
from evolution.files import Row
from evolution.search.algorithms import Evaluation, MapSetProblem, ask, judge_again, make_algorithm, tell
from evolution.search.archive import Archive
from evolution.search.budget import Budget
from evolution.search.elite import give_further_seeds, race
from evolution.search.expectations import Expectations
from evolution.search.experiment import Experiment
from evolution.search.judging import Fitness, Judgement, Objectives, best_of
from evolution.search.judging.expected_fitness import RELIABILITY
from evolution.search.operators import MapMutation, Trial
from evolution.search.record import Record
from evolution.search.recorder import Journal, Recorder, checkpoint_of
from evolution.search.sections import ValidationSettings
from evolution.search.staging import contenders, stages_of
from evolution.search.surrogate import Surrogate
from evolution.search.validation_stage import FrontPoint, ValidationResult, front_of, reevaluate, validate
from gym_mapbench.world.scenario import MapSet


@dataclass(frozen=True)
class Progress:
    """What :func:`evolve` reports after each generation.

    Args:
        row: The generation's line of ``generations.csv``.
        best: The best map set so far.
        driven: Runs driven in this generation.
        reused: Runs answered by the store.
        seconds: Wall-clock seconds of the generation.
        evaluate_seconds: Seconds of these spent on evaluation.
        replayed: Whether the generation was replayed.
    """

    row: Row
    best: Evaluation
    driven: int
    reused: int
    seconds: float
    evaluate_seconds: float
    replayed: bool


OnGeneration = Callable[[Progress], None]


@dataclass(frozen=True)
class EvolveResult:
    """Where a search ended.

    Args:
        best: The best map set, its results and its judgement.
        population: The last population after selection.
        fitness: The fitness as used, with its cluster scale.
        record: All generations, individuals and runs.
        front: With several objectives the Pareto front, by fitness.
        validation: Held-out fitness of the best map set; None without a validation stage, or if too few maps were
            solved by all controllers.
    """

    best: Evaluation
    population: tuple[Evaluation, ...]
    fitness: Fitness
    record: Record
    validation: ValidationResult | None = None
    front: tuple[FrontPoint, ...] = ()


def evolve(
    experiment: Experiment,
    evaluator: Evaluator,
    recorder: Recorder | None = None,
    *,
    on_generation: OnGeneration | None = None,
    fitness: Fitness | None = None,
) -> EvolveResult:
    """Search for the best map set.

    Args:
        experiment: Options of the search, controllers, world.
        evaluator: Drives the runs.
        recorder: Records the search, and continues one that was begun there; nothing is recorded if None.
        on_generation: Called after each generation.
        fitness: Judges map sets; if None, the fitness that ``experiment`` names.

    Raises:
        ConfigError: If ``recorder`` was made for another experiment.
        RunError: If the cluster scale cannot be calibrated, no worker starts, or a replay differs from the checkpoint.
    """
    journal = Journal(recorder, experiment)
    if journal.is_new:
        evaluator.get_ready()
    search = _Search(experiment, evaluator, journal, fitness)
    while search.step(on_generation):
        pass
    return search.result()


class _Clock:
    """Wall-clock seconds and runs since it was made."""

    def __init__(self, evaluator: Evaluator) -> None:
        self.evaluator = evaluator
        self.began = time.perf_counter()
        self.driven, self.reused = evaluator.driven, evaluator.reused

    def row(self, generation: int, evaluate_seconds: float | None = None) -> dict[str, Any]:
        """Return a line of ``timing.jsonl``; all seconds are those of evaluation if there are no others."""
        seconds = time.perf_counter() - self.began
        return {
            "generation": generation,
            "seconds": seconds,
            "evaluate_seconds": seconds if evaluate_seconds is None else evaluate_seconds,
            "driven": self.evaluator.driven - self.driven,
            "reused": self.evaluator.reused - self.reused,
            "workers": self.evaluator.workers,
        }


class _Search:
    """A running search and its record."""

    def __init__(self, experiment: Experiment, evaluator: Evaluator, journal: Journal, fitness: Fitness | None) -> None:
        self.settings = settings = experiment.search
        self.evaluator = evaluator
        self.journal = journal
        fitness = fitness or experiment.fitness
        self.staged = settings.archive.staged and not fitness.reads_failures
        stages = stages_of(experiment.plan) if self.staged else None
        self.archive = Archive(evaluator, experiment.plan, stages)
        self.budget = Budget(settings, self.archive)
        self.problem = MapSetProblem(self._results_of, Objectives(fitness))
        surrogate = Surrogate() if settings.archive.surrogate else None
        reliability = settings.validation.reliability if settings.validation else RELIABILITY
        self.expectations = Expectations(
            self.archive, lambda: self.problem.fitness, settings.maps_per_set, surrogate, reliability
        )
        self.rng = np.random.default_rng(settings.seed)
        self.mutation = MapMutation(experiment.mutator, self._role_of if settings.ga.mutation.adaptive else None)
        self.algorithm: GeneticAlgorithm = make_algorithm(
            settings.ga,
            self.problem,
            experiment.sampling,
            self.mutation,
            self.rng,
            settings.evaluations,
            self.expectations if self._of_archive else None,
        )
        self.record = Record(experiment.plan, self.problem.objectives.names, self.problem.objectives.constraints)
        self.generation = 0
        self.validated: Evaluation | None = None
        self.validation: ValidationResult | None = None
        self.front: tuple[FrontPoint, ...] = ()

    def step(self, on_generation: OnGeneration | None) -> bool:
        """Run one generation; False if there is nothing left to do."""
        clock = _Clock(self.evaluator)
        most = self.budget.sets(self.algorithm.evaluator.n_eval, first=self.generation == 0)
        if (offspring := ask(self.algorithm, self.settings.ga.algorithm, most)) is None:
            self._finish(clock)
            return False
        asked = time.perf_counter()
        self._evaluate(offspring)
        evaluated = time.perf_counter()
        self.generation += 1
        self.record.add(self.generation, offspring.get("evaluation"), self.population, self.archive.take_new())
        replayed = self.journal.write(self.record, self.best, self._checkpoint(finished=False))
        timing = clock.row(self.generation, evaluated - asked)
        if not replayed:
            self.journal.write_timing(timing)
        if on_generation is not None:
            times = {name: timing[name] for name in ("driven", "reused", "seconds", "evaluate_seconds")}
            on_generation(Progress(self.record.generations[-1], best_of(self.population), replayed=replayed, **times))
        return True

    def result(self) -> EvolveResult:
        return EvolveResult(self.best, self.population, self.problem.fitness, self.record, self.validation, self.front)

    @property
    def population(self) -> tuple[Evaluation, ...]:
        return tuple(self.algorithm.pop.get("evaluation"))

    @property
    def best(self) -> Evaluation:
        """The validated set if there is one, else the best of the population."""
        return self.validated or best_of(self.population)

    def _results_of(self, map_sets: Sequence[MapSet]) -> list[SetResults]:
        """Drive the runs of some sets, and the runs that stages left out of those that may survive."""
        if self._of_archive:
            self.archive.evaluate(map_sets, self._going_on if self.staged and self.generation else None)
        else:
            self._complete(map_sets, self.archive.evaluate(map_sets))
        return [self.archive.results_of(map_set) for map_set in map_sets]

    def _complete(self, map_sets: Sequence[MapSet], results: Sequence[SetResults]) -> None:
        """Drive the runs that stages left out of those sets that may survive."""
        if self.generation == 0 or not self.settings.ga.kind.elitist:
            self.archive.complete(map_sets)
            return
        again = {one.digest for one in map_sets}
        rivals = [one.judgement.fitness for one in self.population if one.map_set.digest not in again]
        places = contenders(results, self.problem.fitness, rivals, self.settings.ga.pop_size)
        self.archive.complete(map_sets[place] for place in places)

    def _evaluate(self, offspring: Any) -> None:
        """Evaluate the offspring, select the next population, and let the best set of the archive join it."""
        self.algorithm.evaluator.eval(self.problem, offspring)
        tell(self.algorithm, self.settings.ga.algorithm, offspring)
        if self.settings.archive.elite:
            self.expectations.update()
        self.mutation.credit_trials(self._expected_gain if self._of_archive else self._gain_in_population())
        if self.settings.archive.elite and self.problem.objectives.are_several:
            give_further_seeds(front_of(self.population), self.budget)
            judge_again(self.algorithm)
        elif self.settings.archive.elite:
            race(self.expectations, self.budget)
            elite = self.expectations.best
            judge_again(self.algorithm, [self.archive.map_set(elite)] if elite else [])
            if self._of_archive and self.staged and elite:
                self.archive.stages = tuple((place,) for place in self.expectations.most_different_first())

    @property
    def _of_archive(self) -> bool:
        """Whether offspring are made of the archive's maps."""
        return self.settings.archive.elite and self.settings.archive.parents and not self.problem.objectives.are_several

    def _going_on(self, names: Sequence[str]) -> list[str]:
        """Return the maps that may join the best set, by the runs so far."""
        self.expectations.update()
        if not names or not self.expectations.best:
            return list(names)
        bars = self.expectations.bars(self.expectations.known)
        return [name for name in names if self.expectations.may_join(name, bars)]

    def _expected_gain(self, trial: Trial) -> float:
        """Return by how much a mutated map might improve the best expected set; at most the weight of a pattern."""
        name = trial.after[trial.role].world_digest
        if self.problem.fitness.policy.excludes and not self.archive.is_solved(name):
            return 0.0
        gain = self.expectations.value_of(self.expectations.best) - self.expectations.potential(name)
        return min(gain, self.settings.judging.pattern_weight)

    def _gain_in_population(self) -> Callable[[Trial], float]:
        return partial(self._gain, {one.X[0].digest: one for one in self.algorithm.pop})

    def _gain(self, population: Mapping[str, Individual], trial: Trial) -> float:
        """Return by how much a mutation improved its set, by all results so far; at most the weight of a pattern."""
        after = population.get(trial.after.digest)
        if after is None:  # duplicates are not evaluated, and the worst offspring do not survive
            return 0.0
        before = self.problem.fitness(self.archive.results_of(trial.before))
        judgement: Judgement = after.get("evaluation").judgement
        return min(judgement.gain_over(before), self.settings.judging.pattern_weight)

    def _role_of(self, map_set: MapSet, place: int) -> int:
        """Return the rank of a map's score in its set; maps without a score come last."""
        found = [self.archive.judged(one.world_digest, self.problem.fitness).score for one in map_set]
        scores = [np.inf if score is None else score for score in found]
        return sorted(range(len(scores)), key=scores.__getitem__).index(place)

    def _checkpoint(self, finished: bool) -> dict[str, Any]:
        evaluations, scale = len(self.record.individuals), self.problem.fitness.cluster_scale
        checkpoint = checkpoint_of(self.generation, evaluations, self.population, scale)
        return {**checkpoint, "finished": finished, "rng": self.rng.bit_generator.state}

    def _finish(self, clock: _Clock) -> None:
        """Run the validation stage, if there is one, and write the end of the search."""
        stage = self.settings.validation
        if self.problem.objectives.are_several:
            self._end_on_front(stage)
        elif stage:
            self._validate(stage)
        if stage:
            self.record.add_runs(self.generation, self.archive.take_new())
        self.journal.write_end(self.record, self.best, self._checkpoint(finished=True), self.validation, bool(stage))
        if stage and not self.journal.was_finished:
            self.journal.write_timing(clock.row(self.generation))

    def _end_on_front(self, stage: ValidationSettings | None) -> None:
        """Write the Pareto front, re-evaluated if there is a validation stage; its first set is the best one."""
        front, objectives = front_of(self.population), self.problem.objectives
        if stage is None:
            self.front = tuple(map(FrontPoint, front))
        else:
            self.front = tuple(reevaluate(front, objectives, stage.held_out_seeds, self.budget))
            best = self.front[0].evaluation
            self.validated = replace(best, results=self.archive.results_of(best.map_set))
            self.validation = self.front[0].held_out
        self.journal.write_front(self.front, ("fitness", *objectives.names[1:]))

    def _validate(self, stage: ValidationSettings) -> None:
        """Let held-out seeds select the best set, and measure its held-out fitness."""
        fitness = self.problem.fitness
        found = validate(self.expectations, fitness, stage, self.budget)
        if found is not None:
            results = self.archive.results_of(found.map_set)
            # Scores are those of the selection: one failure on a later seed does not remove the score of a map.
            judged = replace(fitness(results), scores=found.judged.scores, values=found.judged.values)
            self.validated = Evaluation(found.map_set, results, judged)
            self.validation = found.result
