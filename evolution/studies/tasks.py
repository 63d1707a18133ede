"""Tasks: a task is one run of one configuration, with its complete experiment."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import fmean
from typing import Any

from evolution.driving import try_controllers
from evolution.files import counted
from evolution.runs import RunDir, driven_maps, experiment_in, load_run
from evolution.search import MAX_MAPS, Experiment, calibrate_scale, check_several, experiment_of
from evolution.studies.directory import StudyDir
from evolution.studies.settings import MAX_SEED, Configuration, StudySettings
from gym_mapbench.errors import ConfigError, RunError
from gym_mapbench.ros_params import overlay
from gym_mapbench.world.noise import read_noise


@dataclass(frozen=True)
class Task:
    """One run of a study.

    Args:
        configuration: The configuration that is run.
        seed: Seed of the run.
        experiment: Search, controllers and world.
        fresh: Controllers and world of the re-evaluation, with seeds of its own; None if there is none.
    """

    configuration: Configuration
    seed: int
    experiment: Experiment
    fresh: Experiment | None


def make_task(
    settings: StudySettings, configuration: Configuration, seed: int, taken: Mapping[str, dict[str, Any]]
) -> Task:
    """Build one run's experiment.

    Args:
        settings: The study.
        configuration: One of its configurations.
        seed: Seed of the run.
        taken: By configuration, the options of its search that were taken from earlier ones.

    Raises:
        ConfigError: If an option cannot be used, naming the configuration.
    """
    where = _where(settings, configuration)
    experiment = experiment_of(settings.document(configuration, seed, taken), where)
    _check(configuration, experiment, where)
    return Task(configuration, seed, experiment, _fresh(settings, configuration, experiment, where))


def check_study(settings: StudySettings) -> list[Task]:
    """Build every experiment once, so that errors are reported before the first run.

    Returns:
        The first task of every configuration; one that takes its population size from others has that of their first.

    Raises:
        ConfigError: If an option cannot be used, naming the configuration.
    """
    tasks: list[Task] = []
    taken: dict[str, dict[str, Any]] = {}
    for configuration in settings.configurations:
        if configuration.pop_size_from:
            (first,) = [one for one in tasks if one.configuration.name == configuration.pop_size_from[0]]
            taken[configuration.name] = {"pop_size": first.experiment.search.ga.pop_size}
        tasks.append(make_task(settings, configuration, settings.first_seed, taken))
        try:
            try_controllers(tasks[-1].experiment.controllers, tasks[-1].experiment.run)
            check_several(tasks[-1].experiment)
        except ConfigError as error:
            raise ConfigError(f"{_where(settings, configuration)}: {error}") from None
    return tasks


def _where(settings: StudySettings, configuration: Configuration) -> str:
    """Return the beginning of the error messages about a configuration."""
    return f"{settings.name}: {configuration.name}"


def _check(configuration: Configuration, experiment: Experiment, where: str) -> None:
    """Refuse options that a method cannot work with."""
    search = experiment.search
    if configuration.method == "best_triple" and search.maps_per_set > MAX_MAPS:
        raise ConfigError(f"{where}: best_triple: expected maps_per_set up to {MAX_MAPS}, got {search.maps_per_set}")
    pattern = search.judging.pattern
    if configuration.method == "best_triple" and not pattern.exact:
        raise ConfigError(
            f"{where}: best_triple: how to find the exact best set of {search.judging.fitness} is not known"
        )
    unscaled = pattern.needs_scale and search.judging.cluster_scale is None and not configuration.cluster_scale_from
    if configuration.method == "path_length" and unscaled:
        raise ConfigError(f"{where}: path_length has no runs to calibrate from; expected cluster_scale_from")


def _fresh(
    settings: StudySettings, configuration: Configuration, experiment: Experiment, where: str
) -> Experiment | None:
    """Return the experiment of the re-evaluation: its noise, and seeds that no search used, the same for all runs."""
    options, noise = settings.reevaluation, settings.reevaluation_noise(configuration)
    if options.seeds == 0:
        return None
    document = experiment.document()
    if noise is not None:
        document = overlay(document, {"run": {"environment": {"noise": _complete(noise, where)}}})
    fresh = experiment_of(document, f"{where}: reevaluation")
    every_run = {
        "staged": False,
        "archive": False,
        "elite_seeds": 0,
        "parents": False,
        "validation": None,
        "runs": None,
    }
    return replace(fresh, search=fresh.search.replace(seed=MAX_SEED, repeats=options.seeds, **every_run))


def _complete(noise: str | dict[str, Any], where: str) -> str | dict[str, Any]:
    """Return a level's name, or all noise settings, so that nothing remains of the noise of the search."""
    if isinstance(noise, str):
        return noise
    return read_noise(noise, f"{where}: reevaluation.noise").model_dump(mode="json")


def take_from_earlier(configuration: Configuration, directory: StudyDir, seeds: Sequence[int]) -> None:
    """Record in a study's directory, once, which options of its search a configuration takes from earlier ones.

    Raises:
        RunError: If runs it builds on are unfinished or damaged, or do not give a scale.
    """
    if configuration.name not in directory.read_resolved():
        _need_finished(configuration, directory, seeds)
        taken = {"search": _taken(configuration, directory, seeds), "seeds": list(seeds)}
        directory.write_resolved(configuration.name, taken)


def _need_finished(configuration: Configuration, directory: StudyDir, seeds: Sequence[int]) -> None:
    for name in configuration.needs:
        missing = [seed for seed in seeds if not directory.is_finished(name, seed)]
        if missing:
            which = f"{len(missing)} of {counted(len(seeds), 'run')}"
            raise RunError(f"builds on {name}, which has not finished {which}")


def _taken(configuration: Configuration, directory: StudyDir, seeds: Sequence[int]) -> dict[str, Any]:
    taken: dict[str, Any] = {}
    if configuration.pop_size_from:
        best = min(configuration.pop_size_from, key=lambda name: _mean_fitness(directory, name, seeds))
        taken["pop_size"] = load_run(directory.run_path(best, seeds[0])).config["search"]["ga"]["pop_size"]
    if configuration.cluster_scale_from:
        paths = [directory.run_path(name, seed) for name in configuration.cluster_scale_from for seed in seeds]
        taken["cluster_scale"] = calibrate_scale([times for path in paths for times in _times(path)])
    return taken


def _mean_fitness(directory: StudyDir, name: str, seeds: Sequence[int]) -> float:
    runs = [RunDir.open(directory.run_path(name, seed)) for seed in seeds]
    return fmean(run.read_best_results()["fitness"] for run in runs)


def _times(path: Path) -> list[tuple[float, ...]]:
    """Return the values of all controllers on each map of a run that has values."""
    run = load_run(path)
    fitness = experiment_in(run).fitness
    values = [fitness.values_of(results) for results in driven_maps(run).values()]
    return [times for times in values if times is not None]
