"""The record of a search: rows of tables, in an order that depends on nothing but the seed.

A record holds no wall-clock values and nothing about the store or the workers, so the same experiment gives the same
record.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np

from evolution.driving import RESULT_FIELDS, Job, JobPlan, RunResult
from evolution.files import Row
from evolution.search.algorithms import Evaluation
from evolution.search.judging import Judgement, best_of, missing_runs
from gym_mapbench.world.bodies import Body
from gym_mapbench.world.genome import Genome
from gym_mapbench.world.gridmap import GridMap

DrivenRun = tuple[Job, RunResult]


@dataclass
class Record:
    """Everything recorded so far.

    Args:
        plan: Which runs a scenario needs.
        objectives: Names of the objectives.
        constraints: Names of the constraints.
    """

    plan: JobPlan
    objectives: tuple[str, ...] = ("fitness",)
    constraints: tuple[str, ...] = ()
    generations: list[Row] = field(default_factory=list)
    individuals: list[Row] = field(default_factory=list)
    runs: dict[str, Row] = field(default_factory=dict)
    maps: dict[str, GridMap] = field(default_factory=dict)
    """Maps first seen in the last generation, by digest."""
    genomes: dict[str, Genome] = field(default_factory=dict)
    """Genomes of those of these maps that have one, by digest of the map."""
    bodies: dict[str, tuple[Body, ...]] = field(default_factory=dict)
    """Moving bodies of those of these maps that have some, by digest."""
    _known_maps: set[str] = field(default_factory=set)

    def add(
        self,
        generation: int,
        evaluated: Sequence[Evaluation],
        population: Sequence[Evaluation],
        runs: Iterable[DrivenRun],
    ) -> None:
        """Record one generation: the individuals evaluated, the population after selection, and the runs."""
        start = len(self.individuals)
        self.individuals += [
            individual_row(generation, start + i, one) | self._further(one.judgement) for i, one in enumerate(evaluated)
        ]
        row = generation_row(generation, len(self.individuals), population)
        further = self._further(best_of(population).judgement)
        self.generations.append(row | {f"best_{name}": value for name, value in further.items()})
        scenarios = {scenario.world_digest: scenario for one in evaluated for scenario in one.map_set}
        new = {digest: scenario for digest, scenario in scenarios.items() if digest not in self._known_maps}
        self.maps = {digest: scenario.map for digest, scenario in new.items()}
        self.genomes = {digest: scenario.genome for digest, scenario in new.items() if scenario.genome is not None}
        self.bodies = {digest: scenario.bodies for digest, scenario in new.items() if scenario.bodies}
        self._known_maps |= set(new)
        self.add_runs(generation, runs)

    def add_runs(self, generation: int, runs: Iterable[DrivenRun]) -> None:
        """Record runs, each at its first use."""
        for job, result in runs:
            self.runs.setdefault(job.key, run_row(generation, job, result))

    def _further(self, judgement: Judgement) -> Row:
        """Return the objectives after the first, which is the fitness, the constraints, and their violation."""
        values = (*judgement.objectives[1:], *judgement.constraints)
        row = dict(zip((*self.objectives[1:], *self.constraints), values, strict=True))
        return row | {"violation": judgement.rank_key[0]} if self.constraints else row


def generation_row(generation: int, evaluations: int, population: Sequence[Evaluation]) -> Row:
    """Return a line of ``generations.csv``: the fitness in the population after selection; smaller is better."""
    fitness = np.array([one.judgement.fitness for one in population])
    best = best_of(population)
    return {
        "generation": generation,
        "evaluations": evaluations,
        "best": best.judgement.fitness,
        "mean": float(fitness.mean()),
        "median": float(np.median(fitness)),
        "std": float(fitness.std()),
        "worst": float(fitness.max()),
        "mean_success_rate": float(np.mean([one.judgement.success_rate for one in population])),
        "best_map_set": best.map_set.digest,
    }


def individual_row(generation: int, individual: int, evaluation: Evaluation) -> Row:
    """Return a line of ``individuals.csv``: an evaluated map set, its fitness and the parts of it.

    Runs that were not driven count as failed in these values; the set could not survive with any result of them.
    """
    judgement = evaluation.judgement
    row: Row = {
        "generation": generation,
        "individual": individual,
        "map_set": evaluation.map_set.digest,
        "fitness": judgement.fitness,
        "success_rate": judgement.success_rate,
        "timeouts": judgement.timeouts,
        "pattern": judgement.pattern,
        "not_driven": missing_runs(evaluation.results),
    }
    for number, (scenario, score) in enumerate(zip(evaluation.map_set, judgement.scores, strict=True), start=1):
        row |= {f"map_{number}": scenario.world_digest, f"score_{number}": score}
    return row


def run_row(generation: int, job: Job, result: RunResult) -> Row:
    """Return a line of ``runs.csv``: a run, at its first use."""
    return {
        "generation": generation,
        "map": job.scenario.world_digest,
        "controller": job.controller.name,
        "repeat": job.repeat,
        "seed": job.seed,
        "noise_seed": job.noise_seed,
        **result_fields(result),
        **{name: value for name, value in result.metrics.items() if name not in RESULT_FIELDS},
    }


def result_fields(result: RunResult) -> Row:
    """Return the reproducible fields of a result, without metrics and seed."""
    return {name: getattr(result, name) for name in RESULT_FIELDS}
