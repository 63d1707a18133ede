"""The search loop: ask, evaluate, tell, record and write a checkpoint, generation by generation.

A search is a function of its experiment and of the results of its runs. A run that was
interrupted is therefore continued by *replaying* it: the finished runs come from the store, which
takes a fraction of a second per generation, and the checkpoint says what the replay must arrive
at. Nothing is unpickled, and results that were driven after the last checkpoint are not lost.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from pymoo.algorithms.soo.nonconvex.ga import GA
from pymoo.core.individual import Individual

from evolution.driving import Evaluator, OnRun
from evolution.files import Row
from evolution.search.algorithms.problem import Evaluation, MapSetProblem, ask, make_algorithm, rejudge
from evolution.search.archive import Archive
from evolution.search.budget import Budget
from evolution.search.elite import find_elite
from evolution.search.judging.fitness import Fitness
from evolution.search.operators.adaptive import Trial
from evolution.search.operators.mutation import MapMutation, Mutator
from evolution.search.operators.sampling import DrawMap
from evolution.search.record import Record, best_of
from evolution.search.settings import Experiment
from evolution.search.validation_stage import Confirmation, confirm
from gym_mapbench.errors import RunError
from gym_mapbench.generator import draw_map as draw_from_families
from gym_mapbench.generator import sample_map
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
        evaluate_seconds: How many of these were spent on driving.
        replayed: Whether a resumed run went through this generation again.
    """

    row: Row
    best: Evaluation
    driven: int
    reused: int
    seconds: float
    evaluate_seconds: float
    replayed: bool


class Recorder(Protocol):
    """Keeps a search, so that it can be read and continued; a run directory is one."""

    @property
    def path(self) -> Path:
        """Where it is kept; error messages begin with it."""
        ...

    @property
    def checkpoint(self) -> Mapping[str, Any] | None:
        """The checkpoint written last; None for a search that is only beginning."""
        ...

    def check_experiment(self, experiment: Experiment) -> None:
        """Raise ``ConfigError`` if another experiment was begun here."""
        ...

    def write_generation(
        self,
        record: Record,
        best: Evaluation,
        checkpoint: Mapping[str, Any],
        confirmation: Confirmation | None = None,
    ) -> None:
        """Write everything known after a generation, or after the confirmation."""
        ...

    def write_checkpoint(self, checkpoint: Mapping[str, Any]) -> None:
        """Replace the checkpoint."""
        ...

    def append_timing(self, row: Mapping[str, Any]) -> None:
        """Add the wall-clock seconds of a generation, or of the confirmation."""
        ...


@dataclass(frozen=True)
class EvolveResult:
    """Where a search ended.

    Args:
        best: The best map set, its results and its fitness.
        population: The last population, as selection left it.
        fitness: The fitness as used, with its cluster scale.
        record: All generations, individuals and runs.
        confirmation: What the best map set is worth on new seeds; None if that was not asked for, or too few maps were
            solved by all controllers.
    """

    best: Evaluation
    population: tuple[Evaluation, ...]
    fitness: Fitness
    record: Record
    confirmation: Confirmation | None = None


def evolve(
    experiment: Experiment,
    evaluator: Evaluator,
    recorder: Recorder | None = None,
    *,
    on_generation: Callable[[Progress], None] | None = None,
    on_run: OnRun | None = None,
    fitness: Fitness | None = None,
    draw_map: DrawMap | None = None,
) -> EvolveResult:
    """Search for the best map set.

    Args:
        experiment: Options of the search, controllers, world.
        evaluator: Drives the runs.
        recorder: Records the search, and continues one that was begun there; nothing is recorded if None.
        on_generation: Called after each generation.
        on_run: Called after each driven run (see :meth:`Evaluator.run`).
        fitness: Judges map sets; if None, the one that ``experiment`` names.
        draw_map: How sampling draws one map; if None, from the families of ``experiment``.

    Raises:
        ConfigError: If ``recorder`` was made for another experiment.
        RunError: If the cluster scale cannot be calibrated, no worker starts, or a replay differs from the checkpoint.
    """
    search = _Search(experiment, evaluator, recorder, on_run, fitness, draw_map)
    while search.step(on_generation):
        pass
    return search.result()


def _drawer(experiment: Experiment) -> DrawMap:
    """Return the function that draws maps for a search: random shapes, or maps of its families for its robot."""
    families = experiment.search.families
    return partial(draw_from_families, families=families, robot=experiment.run.robot) if families else sample_map


class _Search:
    """A running search and its record."""

    def __init__(
        self,
        experiment: Experiment,
        evaluator: Evaluator,
        recorder: Recorder | None,
        on_run: OnRun | None,
        fitness: Fitness | None,
        draw_map: DrawMap | None,
    ) -> None:
        if recorder is not None:
            recorder.check_experiment(experiment)
        self.settings = experiment.search
        self.evaluator = evaluator
        self.recorder = recorder
        self.expected = None if recorder is None else recorder.checkpoint
        if self.expected is None:
            evaluator.get_ready()
        self.archive = Archive(evaluator, experiment.plan, experiment.search.drive_last, on_run)
        self.budget = Budget(experiment.search, self.archive)
        self.problem = MapSetProblem(
            self.archive.evaluate, fitness or Fitness.of(experiment.search, experiment.run.time_limit)
        )
        self.rng = np.random.default_rng(experiment.search.seed)
        self.mutation = MapMutation(
            Mutator(self.settings.shapes, self.settings.mutation, self.settings.families, experiment.run.robot),
            self._role_of if self.settings.mutation.adaptive else None,
        )
        self.algorithm: GA = make_algorithm(
            experiment.search, self.problem, self.rng, self.mutation, draw_map or _drawer(experiment)
        )
        self.record = Record(experiment.plan)
        self.generation = 0
        self.confirmed: Evaluation | None = None
        self.confirmation: Confirmation | None = None

    def step(self, on_generation: Callable[[Progress], None] | None) -> bool:
        """Go through one generation; False if there is nothing left to do."""
        began, driven, reused = time.perf_counter(), self.evaluator.driven, self.evaluator.reused
        most = self.budget.sets(self.algorithm.evaluator.n_eval, first=self.generation == 0)
        if not self.algorithm.has_next() or (offspring := ask(self.algorithm, most)) is None:
            self._finish()
            if self.settings.confirmation is not None and not (self.expected and self.expected["finished"]):
                seconds = time.perf_counter() - began
                self._note_time(seconds, seconds, self.evaluator.driven - driven, self.evaluator.reused - reused)
            return False
        asked = time.perf_counter()
        self.algorithm.evaluator.eval(self.problem, offspring)
        self.algorithm.tell(infills=offspring)
        self.mutation.judge(partial(self._gain, {one.X[0].digest: one for one in self.algorithm.pop}))
        if self.settings.archive:
            elite = find_elite(self.archive, self.problem.fitness, self.settings, self.budget)
            rejudge(self.algorithm, [self.archive.map_set(elite)] if elite else [])
        evaluated = time.perf_counter()
        self.generation += 1
        self.record.add(self.generation, offspring.get("evaluation"), self.population, self.archive.take_new())
        replayed = self._save()
        progress = Progress(
            row=self.record.generations[-1],
            best=best_of(self.population),
            driven=self.evaluator.driven - driven,
            reused=self.evaluator.reused - reused,
            seconds=time.perf_counter() - began,
            evaluate_seconds=evaluated - asked,
            replayed=replayed,
        )
        if not replayed:
            self._note_time(progress.seconds, progress.evaluate_seconds, progress.driven, progress.reused)
        if on_generation is not None:
            on_generation(progress)
        return True

    def result(self) -> EvolveResult:
        return EvolveResult(self.best, self.population, self.problem.fitness, self.record, self.confirmation)

    @property
    def population(self) -> tuple[Evaluation, ...]:
        return tuple(self.algorithm.pop.get("evaluation"))

    @property
    def best(self) -> Evaluation:
        """The confirmed set once there is one, else the fittest of the population."""
        return self.confirmed or best_of(self.population)

    def _gain(self, population: Mapping[str, Individual], trial: Trial) -> float:
        """Return by how much a mutation made its set fitter, by what is known now; a whole pattern at most."""
        after = population.get(trial.after)
        if after is None:  # duplicates are not evaluated, and the worst offspring do not survive
            return 0.0
        before = self.problem.fitness(self.archive.results_of(trial.before))
        return min(before.total - float(after.get("evaluation").fitness.total), self.settings.pattern_weight)

    def _role_of(self, map_set: MapSet, place: int) -> int:
        """Return the rank of a map's reading in its set; maps without one come last."""
        found = [self.archive.judged(one.map.digest, self.problem.fitness).reading for one in map_set]
        readings = [np.inf if reading is None else reading for reading in found]
        return sorted(range(len(readings)), key=readings.__getitem__).index(place)

    def _save(self) -> bool:
        """Write the generation; in a replay, check it against the checkpoint instead and return True."""
        if self.recorder is None:
            return False
        if self.expected is not None and self.generation <= self.expected["generation"]:
            if self.generation == self.expected["generation"]:
                self._check_replay(self.expected)
            return True
        self.recorder.write_generation(self.record, self.best, self._checkpoint(finished=False))
        return False

    def _checkpoint(self, finished: bool) -> dict[str, Any]:
        return {
            "generation": self.generation,
            "evaluations": len(self.record.individuals),
            "finished": finished,
            "cluster_scale": self.problem.fitness.cluster_scale,
            "best": best_of(self.population).map_set.digest,
            "best_fitness": best_of(self.population).fitness.total,
            "population": [one.map_set.digest for one in self.population],
            "rng": self.rng.bit_generator.state,
        }

    def _check_replay(self, expected: Mapping[str, Any]) -> None:
        reached = self._checkpoint(finished=bool(expected["finished"]))
        astray = [name for name in reached if reached[name] != expected.get(name)]
        if astray:
            where = self.recorder.path if self.recorder else ""
            raise RunError(
                f"{where}: generation {self.generation} cannot be repeated ({astray[0]} differs): "
                "the code, its libraries or the result store have changed since"
            )

    def _finish(self) -> None:
        """Confirm the best set, if that is asked for, and write what there is."""
        if self.settings.confirmation is not None:
            self._confirm()
            self.record.add_runs(self.generation, self.archive.take_new())
            if self.recorder is not None:
                checkpoint = self._checkpoint(finished=True)
                self.recorder.write_generation(self.record, self.best, checkpoint, self.confirmation)
        elif self.recorder is not None:
            self.recorder.write_checkpoint(self._checkpoint(finished=True))

    def _confirm(self) -> None:
        """Let new seeds decide which set is the best, and what it is worth."""
        fitness = self.problem.fitness
        found = confirm(self.archive, fitness, self.settings, self.budget)
        if found is not None:
            results = self.archive.results_of(found.map_set)
            # Readings are those that the set was chosen by: one failure with a later seed does not make a map unread.
            judged = replace(fitness(results), readings=found.judged.readings, values=found.judged.values)
            self.confirmed = Evaluation(found.map_set, results, judged)
            self.confirmation = found.claim

    def _note_time(self, seconds: float, evaluate_seconds: float, driven: int, reused: int) -> None:
        """Add a line about a generation, or about the confirmation, which counts with the last one."""
        if self.recorder is None:
            return
        self.recorder.append_timing(
            {
                "generation": self.generation,
                "seconds": seconds,
                "evaluate_seconds": evaluate_seconds,
                "driven": driven,
                "reused": reused,
                "workers": self.evaluator.workers,
            }
        )
