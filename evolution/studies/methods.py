"""The methods of a study: each writes a finished run directory with a best map set and its runs."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path

from evolution.driving import Evaluator, Job, JobPlan, RunResult
from evolution.runs import CONFIG, LoadedRun, RunDir, chosen_by, driven_maps, load_run, results_in, validation_in
from evolution.search import (
    Evaluation,
    Experiment,
    Progress,
    Record,
    ValidationResult,
    best_set,
    checkpoint_of,
    evolve,
    scenario_on,
)
from evolution.studies.directory import StudyDir
from evolution.studies.path_length import PathLengthFitness, planned
from evolution.studies.tasks import Task
from gym_mapbench.world.scenario import MapSet

OnGeneration = Callable[[Progress], None]


def run_task(task: Task, directory: StudyDir, evaluator: Evaluator, on_generation: OnGeneration) -> None:
    """Run one task to its end; a finished task is left as it is.

    Args:
        task: The task.
        directory: Directory of the study; earlier runs are looked up there.
        evaluator: Evaluates jobs: runs, or planned paths.
        on_generation: Called after each generation of a search.

    Raises:
        ConfigError: If the run directory was made for another experiment.
        RunError: If a replay differs from the recorded run, or no worker starts.
    """
    configuration = task.configuration
    rundir = opened(directory.run_path(configuration.name, task.seed), task.experiment)
    if rundir.finished:
        return
    if configuration.method == "best_triple":
        choose_best_triple(task.experiment, rundir, load_run(directory.run_path(str(configuration.of), task.seed)))
    elif configuration.method == "again":
        take_best(task.experiment, rundir, load_run(directory.run_path(str(configuration.of), task.seed)))
    elif configuration.method == "path_length":
        path = directory.search_path(configuration.name, task.seed)
        search_by_path_length(task.experiment, rundir, path, evaluator, on_generation)
    else:
        evolve(task.experiment, evaluator, rundir, on_generation=on_generation)


def choose_best_triple(experiment: Experiment, rundir: RunDir, parent: LoadedRun) -> None:
    """Record, for each generation of another run, the exact best set of all its maps so far."""
    results = driven_maps(parent)
    first = driven_maps(parent, until=1)
    fitness = experiment.fitness.calibrated([(one,) for one in first.values()])
    chosen = []
    for row in parent.generations:
        names = best_set(driven_maps(parent, until=row["generation"]), fitness, experiment.search.maps_per_set)
        sets = tuple(results[name] for name in names)
        chosen.append((row["evaluations"], Evaluation(_map_set(names, parent, experiment), sets, fitness(sets))))
    record_sets(rundir, experiment, chosen, fitness.cluster_scale)


def take_best(experiment: Experiment, rundir: RunDir, parent: LoadedRun) -> None:
    """Record the best set of another run, with its held-out fitness if the fitness is the same."""
    scale = parent.checkpoint["cluster_scale"]
    results = results_in(parent.best_results, parent.controllers)
    judged = replace(experiment.fitness, cluster_scale=scale)(results)
    validation = validation_in(parent.best_results) if experiment.search.validation else None
    if validation is not None:
        judged = replace(judged, objectives=(validation.fitness,), **chosen_by(parent.best_results, parent.controllers))
    best = Evaluation(parent.best, results, judged)
    record_sets(rundir, experiment, [(parent.checkpoint["evaluations"], best)], scale, validation)


def search_by_path_length(
    experiment: Experiment, rundir: RunDir, path: Path, evaluator: Evaluator, on_generation: OnGeneration
) -> None:
    """Search for long paths in a directory of its own, then run all controllers on the best set."""
    without = planned(experiment)
    fitness = PathLengthFitness.of(without.search.judging, without.run.time_limit)
    searched = opened(path, without)
    if not searched.finished:
        evolve(without, evaluator, searched, on_generation=on_generation, fitness=fitness)
    found = load_run(path)
    (results,) = evaluator.evaluate([found.best], experiment.plan)
    judge = experiment.fitness
    chosen = [(found.checkpoint["evaluations"], Evaluation(found.best, results, judge(results)))]
    record_sets(rundir, experiment, chosen, judge.cluster_scale)


def opened(path: Path, experiment: Experiment) -> RunDir:
    """Open a run directory to continue it, or make a new one.

    Raises:
        ConfigError: If it was made for another experiment.
        RunError: If another version of this package wrote it.
    """
    if not (path / CONFIG).is_file():
        return RunDir.create(path, experiment)
    rundir = RunDir.open(path)
    rundir.check_experiment(experiment)
    return rundir


def record_sets(
    rundir: RunDir,
    experiment: Experiment,
    chosen: Iterable[tuple[int, Evaluation]],
    cluster_scale: float | None,
    validation: ValidationResult | None = None,
) -> None:
    """Write a run directory of map sets that were not found by a search, one per generation.

    Args:
        rundir: The run directory.
        experiment: The experiment of the sets.
        chosen: For each generation, the number of map sets evaluated by then and the best set.
        cluster_scale: Scale of their fitness; None if it has none.
        validation: Held-out fitness of the only set.
    """
    record = Record(experiment.plan)
    for generation, (evaluations, best) in enumerate(chosen, start=1):
        record.add(generation, [best], [best], _runs_on(experiment.plan, best))
        record.generations[-1]["evaluations"] = evaluations
        checkpoint = checkpoint_of(generation, evaluations, [best], cluster_scale)
        rundir.write_generation(record, best, checkpoint, validation)
    rundir.write_checkpoint({**checkpoint, "finished": True})


def _map_set(names: Iterable[str], run: LoadedRun, experiment: Experiment) -> MapSet:
    """Return the map set of some maps of a recorded run, named by digest."""
    shapes = experiment.search.shapes
    found = ((scenario_on(run.maps[name].occupancy, shapes), run.bodies.get(name, ())) for name in names)
    return MapSet(tuple(replace(scenario, bodies=bodies) for scenario, bodies in found))


def _runs_on(plan: JobPlan, evaluation: Evaluation) -> list[tuple[Job, RunResult]]:
    """Return the runs by which a map set was judged."""
    return [
        (plan.job(scenario, number, repeat), result)
        for scenario, of_map in zip(evaluation.map_set, evaluation.results, strict=True)
        for number, results in enumerate(of_map)
        for repeat, result in enumerate(results)
    ]
