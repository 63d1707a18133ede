"""The interface for Python: the commands as functions that return tables.

::

    from evolution import atlas, bench, compare, evolve, load, study, train, tune

Work happens in worker processes, so these functions may be called from a script, with or without a ``__main__`` guard,
and from a notebook.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from controllers.nav2_params import Nav2Params
from controllers.nav2_params.presets import overlay
from evolution.benchmark import (
    BENCHMARK,
    Benchmark,
    Configuration,
    ParameterComparison,
    barn_settings,
    begin_benchmark,
    benchmark_document,
    check_configurations,
    configurations_document,
    parameter_rows,
    reevaluation_in,
    run_configurations,
)
from evolution.benchmark import bench as run_all
from evolution.driving import (
    DEFAULT_RESOURCES,
    DriveSettings,
    Evaluator,
    JobPlan,
    OnRun,
    ParameterFile,
    Resources,
    ResultStore,
    check_room,
    preparation_of,
    run_job,
    try_controllers,
)
from evolution.inputs import (
    Controllers,
    Maps,
    barn_source,
    check_alone,
    chosen,
    items_of,
    levels_of,
    listed,
    load_all,
    own_controllers,
    read_parameters,
    run_of,
    specs_of,
    tuning_of,
    world_from,
)
from evolution.minimizing import Minimized, MinimizeSettings, read_verdict, run_minimizing
from evolution.pictures import write_run_figures
from evolution.quality_diversity import Atlas, AtlasSettings, ribs_archives, run_atlas
from evolution.results import load
from evolution.runs import RUN, LoadedRun, RunDir, exclusive_store, experiment_in, load_run
from evolution.search import (
    DEFAULT_PRESET,
    Experiment,
    Progress,
    check_experiment,
    experiment_of,
    load_preset,
    nested,
    nested_document,
    preset_names,
    read_document,
)
from evolution.search import evolve as search_on
from evolution.studies import (
    AnyStudy,
    StudyProgress,
    StudyResults,
    SweepResults,
    SweepSettings,
    run_study,
    run_sweep,
    study_in,
)
from evolution.training import (
    Training,
    TrainingDir,
    TrainProgress,
    begin_training,
    learn,
    train_settings,
)
from evolution.tuning import (
    OnTrial,
    TuneSettings,
    Tuning,
    optuna,
    run_tuning,
)
from gym_mapbench.errors import ConfigError
from gym_mapbench.mapio import PoseLike

__all__ = [
    "atlas",
    "bench",
    "compare",
    "compose",
    "configuration_of",
    "evolve",
    "load",
    "minimize",
    "study",
    "train",
    "tune",
]

DEFAULT_ATLAS = AtlasSettings()
LOG = logging.getLogger(__name__)


def bench(
    maps: Maps | Sequence[Maps],
    controllers: Controllers | None = None,
    *,
    params: str | Nav2Params | None = None,
    settings: DriveSettings | None = None,
    start: PoseLike | None = None,
    goal: PoseLike | None = None,
    unknown_map: bool = False,
    repeats: int = 1,
    seed: int | None = None,
    metrics: Sequence[str] = (),
    out: str | Path | None = None,
    resume: bool = False,
    on_run: OnRun | None = None,
    resources: Resources = DEFAULT_RESOURCES,
    **options: Any,
) -> Benchmark:
    """Run every controller on every map and compare.

    Args:
        maps: One or several; ``barn:DIR`` must be the only one and has the rules of BARN.
        controllers: The controllers; if None, those of the parameter file, else those of the run whose maps are
            used, else DWB, MPPI and RPP.
        params: Nav2's parameters: a preset's name, a ``nav2_params.yaml`` (which also describes the robot), or what
            ``read_nav2_params`` returned for one; if None, those of the run whose maps are used, else ``thesis``.
            The world is that of such a run, too, apart from ``options``.
        settings: World and navigation in one value, instead of ``params`` and fields of the env.
        start: Start pose ``(x, y, yaw)`` in m and rad, instead of the one in the files.
        goal: The same for the goal.
        unknown_map: Whether Nav2's costmaps hold only the cells that the sensors have observed.
        repeats: Runs of each controller on each map, each with a seed of its own.
        seed: Root of all randomness; if None, 0, or for the maps of a run the seed of its search plus 1.
        metrics: Names of further metrics, besides the project's own.
        out: New directory for every result as it comes, and for ``bench.json`` and ``bench.csv`` at the end; nothing is
            written if None.
        resume: Whether to continue the benchmark in ``out``; the results equal those without interruption.
        on_run: Called after each run with its job, its result, and the number of remaining runs.
        resources: Workers, executor and time limits; the results do not depend on it.
        options: Fields of :class:`gym_mapbench.env.config.EnvConfig`, e.g. ``robot="jackal", noise="nominal"``, and of
            :class:`evolution.driving.Resources`, e.g. ``workers=2``.

    Returns:
        One row per run; a notebook shows the summary.

    Raises:
        ConfigError: If an argument cannot be used, or ``out`` holds another benchmark; then nothing is run.
        MapFormatError: If a file is no map.
        RunError: If no worker starts, nothing can be written, or ``out`` holds no benchmark to continue.
    """
    if resume and out is None:
        raise ConfigError("resume: expected the directory of a benchmark in 'out', got none")
    resources, environment = resources.taking(options)
    items = items_of(maps)
    scenarios = load_all(items, start, goal)
    read, run = read_parameters(params), run_of(items)
    check_alone(settings, {"params": params, **environment})
    settings = settings or world_from(params, read, environment, run)
    settings = settings.replace(unknown_map=unknown_map or settings.unknown_map)
    settings = barn_settings(settings) if barn_source(items) else settings
    check_room(scenarios, settings)
    specs = specs_of(own_controllers(read, run) if controllers is None else controllers)
    try_controllers(specs, settings)
    root = (0 if run is None else run.config["search"]["seed"] + 1) if seed is None else seed
    plan = JobPlan(specs, settings, root, repeats, tuple(metrics))
    LOG.info("seed %d%s; controllers: %s", root, "" if seed is not None else " (not given)", ", ".join(plan.names))
    kept = None if out is None else begin_benchmark(Path(out), benchmark_document(scenarios, plan), resume=resume)
    with _benchmark_evaluator(kept, resources, [plan]) as evaluator:
        result = run_all(scenarios, plan, evaluator, on_run)
        result = result if run is None else replace(result, reevaluation=reevaluation_in(result.rows, run))
        if kept is not None:
            result.save(kept)
    return result


def compare(
    maps: Maps | Sequence[Maps],
    configurations: Sequence[Configuration],
    *,
    start: PoseLike | None = None,
    goal: PoseLike | None = None,
    against_first: bool = False,
    out: str | Path | None = None,
    resume: bool = False,
    on_run: OnRun | None = None,
    resources: Resources = DEFAULT_RESOURCES,
    **options: Any,
) -> ParameterComparison:
    """Run every configuration on every map with the same seeds and noise, and compare in pairs.

    Args:
        maps: One or several.
        configurations: Labels with controllers and parameters; :func:`configuration_of` makes one from a file, and
            :func:`evolution.benchmark.sweep` makes those of a sweep.
        start: Start pose ``(x, y, yaw)`` in m and rad, instead of the one in the files.
        goal: The same for the goal.
        against_first: Whether to compare each configuration with the first only; else all pairs are compared.
        out: New directory for every result as it comes, and for ``bench.json`` and ``bench.csv`` at the end.
        resume: Whether to continue the comparison in ``out``; the results equal those without interruption.
        on_run: Called after each run with its job, its result, and the number of remaining runs.
        resources: Workers, executor and time limits; the results do not depend on it.
        options: Fields of :class:`evolution.driving.Resources`, e.g. ``workers=2``.

    Returns:
        One row per run; a notebook shows the scores of the configurations.

    Raises:
        ConfigError: If an argument cannot be used, or ``out`` holds another benchmark; then nothing is run.
        MapFormatError: If a file is no map.
        RunError: If no worker starts, nothing can be written, or ``out`` holds no benchmark to continue.
    """
    if resume and out is None:
        raise ConfigError("resume: expected the directory of a benchmark in 'out', got none")
    resources = resources.replace(**options)
    check_configurations(configurations)
    scenarios = load_all(items_of(maps), start, goal)
    for one in configurations:
        check_room(scenarios, one.plan.settings)
        try_controllers(one.plan.controllers, one.plan.settings)
    document = configurations_document(scenarios, configurations)
    kept = None if out is None else begin_benchmark(Path(out), document, resume=resume)
    with _benchmark_evaluator(kept, resources, [one.plan for one in configurations]) as evaluator:
        rows = run_configurations(scenarios, configurations, evaluator, on_run)
    parameters = parameter_rows(configurations)
    result = ParameterComparison(rows, parameters, against_first, tuple(configurations), tuple(scenarios))
    if kept is not None:
        result.save(kept)
    return result


def minimize(
    maps: Maps,
    keep: str,
    controllers: Controllers | None = None,
    *,
    out: str | Path,
    settings: DriveSettings | None = None,
    map_name: str | None = None,
    start: PoseLike | None = None,
    goal: PoseLike | None = None,
    seed: int = 0,
    tolerance: float = 0.1,
    seeds: int = 3,
    held_out_seeds: int = 10,
    resume: bool = False,
    on_step: Callable[[str], object] = lambda _: None,
    on_run: OnRun | None = None,
    resources: Resources = DEFAULT_RESOURCES,
    **options: Any,
) -> tuple[Minimized, JobPlan]:
    """Remove and shrink the obstacles of a map while a verdict holds.

    Args:
        maps: A map, or the best maps of a run.
        keep: The verdict: ``"mppi fails"``, ``"mppi fails and rpp succeeds"``, ``"order"`` or ``"ratio"``.
        controllers: The controllers; if None, those of the run, else DWB, MPPI and RPP. Only those that ``keep`` names
            are run, if it names any.
        out: New directory of the result.
        settings: World and navigation; if None, those of the run, else of the thesis, with ``options``.
        map_name: Name of the map, if there are several.
        start: Start pose ``(x, y, yaw)`` in m and rad, instead of the one in the file.
        goal: The same for the goal.
        seed: Root of all randomness.
        tolerance: Largest relative difference from the ratio of times.
        seeds: Seeds on which the verdict must hold.
        held_out_seeds: Further seeds of the final check of both maps.
        resume: Whether to continue the minimisation in ``out``; the result equals that without interruption.
        on_step: Called with a line about each smaller map.
        on_run: Called after each run with its job, its result, and the number of remaining runs of its batch.
        resources: Workers, executor and time limits; the result does not depend on it.
        options: Fields of :class:`gym_mapbench.env.config.EnvConfig`, and of :class:`evolution.driving.Resources`.

    Returns:
        The map before and after, and the plan of its runs.

    Raises:
        ConfigError: If an argument cannot be used, or the verdict does not hold on the map.
        MapFormatError: If the file is no map.
        RunError: If no worker starts, or nothing can be written.
    """
    resources, environment = resources.taking(options)
    run = run_of([maps])
    check_alone(settings, environment)
    world = settings or world_from(None, None, environment, run)
    scenario = chosen(load_all([maps], start, goal), map_name)
    specs = specs_of(own_controllers(None, run) if controllers is None else controllers)
    verdict = read_verdict(keep, [one.name for one in specs], tolerance)
    specs = tuple(one for one in specs if not verdict.outcomes or one.name in verdict.outcomes)
    check_room([scenario], world)
    try_controllers(specs, world)
    plan = JobPlan(specs, world, seed)
    wanted = MinimizeSettings(seeds=seeds, held_out_seeds=held_out_seeds)
    result = run_minimizing(
        scenario, plan, verdict, wanted, Path(out), resume=resume, resources=resources, on_step=on_step, on_run=on_run
    )
    return result, plan


def configuration_of(
    label: str,
    params: str | Nav2Params,
    controllers: Controllers | None = None,
    *,
    repeats: int = 1,
    seed: int = 0,
    **environment: Any,
) -> Configuration:
    """Return a configuration for :func:`compare`.

    Args:
        label: Its name in tables.
        params: A preset's name, a ``nav2_params.yaml``, or what ``read_nav2_params`` returned for one.
        controllers: The controllers; if None, those of the file.
        repeats: Runs of each controller on each map.
        seed: Root of all randomness; the same for all configurations of a comparison.
        environment: Fields of :class:`gym_mapbench.env.config.EnvConfig`.
    """
    read = read_parameters(params)
    settings = world_from(params, read, environment, None)
    specs = specs_of(own_controllers(read, None) if controllers is None else controllers)
    return Configuration(label, JobPlan(specs, settings, seed, repeats))


@contextmanager
def _benchmark_evaluator(kept: Path | None, resources: Resources, plans: Sequence[JobPlan]) -> Iterator[Evaluator]:
    """Yield an evaluator whose results are kept in the directory of a benchmark, or in memory if it is None."""
    prepare = preparation_of((plan.controllers, plan.settings) for plan in plans)
    with (
        ResultStore() if kept is None else exclusive_store(BENCHMARK, kept, resources.wait_s) as store,
        resources.evaluator(run_job, store, prepare) as evaluator,
    ):
        yield evaluator


def _evaluator(resources: Resources, plan: JobPlan) -> Evaluator:
    """Return the evaluator of a plan; its workers first compile the kernels that the plan needs."""
    return resources.evaluator(run_job, warm_up=preparation_of([(plan.controllers, plan.settings)]))


def evolve(
    experiment: str | Path | Mapping[str, Any] | Experiment = DEFAULT_PRESET,
    *,
    out: str | Path | None = None,
    resume: str | Path | None = None,
    on_generation: Callable[[Progress], None] | None = None,
    on_run: OnRun | None = None,
    resources: Resources = DEFAULT_RESOURCES,
    **options: Any,
) -> LoadedRun:
    """Search for map sets that tell controllers apart.

    Args:
        experiment: A preset's name, a YAML file with the sections ``search``, ``controllers`` and ``run``, the same as
            a mapping, or an experiment. The preset ``robust`` gives the options that a file or a mapping leaves out.
        out: New directory of the run; ``runs/FITNESS-popN-seedN`` if None.
        resume: Directory of a run to continue; the result equals that of an uninterrupted run. ``experiment``, ``out``
            and options of the search cannot be given beside it.
        on_generation: Called after each generation.
        on_run: Called after each run with its job, its result, and the number of remaining runs.
        resources: Workers, executor and time limits; the results do not depend on it.
        options: Options of the search that replace those of the experiment, by their short names, e.g.
            ``pop_size=20, seed=3``; and fields of :class:`evolution.driving.Resources`, e.g. ``workers=2``.

    Returns:
        The recorded run; a notebook shows the best map set.

    Raises:
        ConfigError: If an option cannot be used; then nothing is run.
        RunError: If no worker starts, nothing can be written, or a run cannot be continued.
    """
    resources, search = resources.taking(options)
    if resume is not None and (search or out is not None):
        raise ConfigError(f"resume: expected no other option, got {next(iter(search), 'out')}")
    begun = None if resume is None else RunDir.open(resume)
    wanted = _wanted(experiment, search) if begun is None else experiment_in(begun)
    LOG.info("seed %d; controllers: %s", wanted.search.seed, ", ".join(wanted.plan.names))
    with _evaluator(resources, wanted.plan) as evaluator:
        rundir = begun or _begin(wanted, out, evaluator)
        with exclusive_store(RUN, rundir.path, resources.wait_s) as evaluator.store:
            search_on(wanted, evaluator, rundir, on_generation=on_generation, on_run=on_run)
    run = load_run(rundir.path)
    write_run_figures(run)
    return run


def atlas(
    experiment: str | Path | Mapping[str, Any] | Experiment = DEFAULT_PRESET,
    *,
    out: str | Path,
    settings: AtlasSettings = DEFAULT_ATLAS,
    resume: bool = False,
    on_step: Callable[[str], object] = lambda _: None,
    on_run: OnRun | None = None,
    resources: Resources = DEFAULT_RESOURCES,
    **options: Any,
) -> Atlas:
    """Fill a grid of time ratios between controllers with the simplest reliable maps.

    Args:
        experiment: As for :func:`evolve`; families, mutation, people, seed, controllers and world are used.
        out: New directory of the result.
        settings: Options of the atlas.
        resume: Whether to continue the atlas in ``out``; the result equals that without interruption.
        on_step: Called with a line about each batch.
        on_run: Called after each run with its job, its result, and the number of remaining runs of its batch.
        resources: Workers, executor and time limits; the result does not depend on it.
        options: Options of the experiment's search that replace its own, by their short names; and fields of
            :class:`evolution.driving.Resources`.

    Returns:
        The atlas; a notebook shows its maps as a table.

    Raises:
        ConfigError: If an option cannot be used, or pyribs is not installed; then nothing is run.
        RunError: If no worker starts, or nothing can be written.
    """
    resources, search = resources.taking(options)
    wanted = _wanted(experiment, search)
    ribs_archives()
    settings.check(wanted.plan.names)
    check_experiment(wanted)
    return run_atlas(wanted, settings, Path(out), resume=resume, resources=resources, on_step=on_step, on_run=on_run)


def study(
    settings: str | Path | AnyStudy,
    *,
    out: str | Path | None = None,
    resume: bool = False,
    only: Sequence[str] | None = None,
    runs: int | None = None,
    on_progress: Callable[[StudyProgress], None] | None = None,
    on_run: OnRun | None = None,
    resources: Resources = DEFAULT_RESOURCES,
    **options: Any,
) -> StudyResults | SweepResults:
    """Run a study: many searches and baselines, compared on held-out seeds; or a sweep over worlds.

    Args:
        settings: A study of the package by name, a YAML file, settings, or with ``resume`` a study's directory.
        out: Its directory; ``runs/study-NAME`` if None.
        resume: Whether to continue a study that was begun there.
        only: Names of the configurations (in a sweep, of the worlds) to run now; all if None.
        runs: Number of seeds (in a sweep, of maps) to run now; all if None.
        on_progress: Called after each generation and each search of a study; a sweep has neither.
        on_run: Called after each run of a sweep with its job, its result, and the number of remaining runs.
        resources: Workers, executor and time limits; the results do not depend on it.
        options: Fields of :class:`evolution.driving.Resources`, e.g. ``workers=2``.

    Returns:
        The finished runs; a notebook shows a row for each search, or for each world and controller.

    Raises:
        ConfigError: If an option cannot be used, or the directory holds something else.
        RunError: If no worker starts, or nothing can be written.
    """
    resources = resources.replace(**options)
    wanted, path = study_in(settings, out, resume=resume)
    if isinstance(wanted, SweepSettings):
        return run_sweep(wanted, path, resume=resume, only=only, maps=runs, resources=resources, on_run=on_run)
    return run_study(wanted, path, resume=resume, only=only, runs=runs, resources=resources, on_progress=on_progress)


def train(
    algorithm: str | None = None,
    *,
    maps: Maps | Sequence[Maps] | None = None,
    curriculum: Maps | Sequence[Maps] | None = None,
    config: str | Path | Mapping[str, Any] | None = None,
    out: str | Path | None = None,
    resume: str | Path | None = None,
    on_progress: Callable[[TrainProgress], None] | None = None,
    **options: Any,
) -> Training:
    """Train a policy with Stable-Baselines3.

    Args:
        algorithm: ``ppo``, ``sac`` or ``td3``; None for that of ``config``, or ``ppo``.
        maps: Maps to train on; None for new random maps. Every fifth is held out; of fewer than five none, and the
            success is that on the training maps.
        curriculum: Maps for prioritized level replay among them; of the directory of a run, all maps on which a
            controller reached the goal. Held out as of ``maps``.
        config: A YAML file with fields of :class:`evolution.training.TrainSettings`, or a mapping of them.
        out: New directory of the training; ``runs/ALGORITHM-seedN`` if None.
        resume: Directory of a training to continue; nothing but ``on_progress`` can be given beside it.
        on_progress: Called after every rollout.
        options: Fields of TrainSettings that replace those of ``config``, e.g. ``steps=1_000_000, seed=3``.

    Returns:
        The training; ``best`` is the file of its best model, and a notebook shows the learning curve.

    Raises:
        ConfigError: If an option cannot be used, or Stable-Baselines3 is not installed; nothing is written then.
        MapFormatError: If a file is no map.
        RunError: If a directory cannot be written or continued.
    """
    given = {"algorithm": algorithm, "maps": maps, "curriculum": curriculum, "config": config, "out": out, **options}
    if resume is not None:
        for name in (name for name, value in given.items() if value is not None):
            raise ConfigError(f"resume: expected no other option, got {name}")
        return learn(TrainingDir.open(Path(resume)), on_progress)
    settings = train_settings(algorithm, config, **options)
    path = Path(out or Path("runs") / f"{settings.algorithm}-seed{settings.seed}")
    directory = begin_training(settings, path, listed(maps), levels_of(curriculum))
    return learn(directory, on_progress)


def tune(
    controller: str,
    train: Maps | Sequence[Maps],
    test: Maps | Sequence[Maps],
    *,
    out: str | Path,
    params: str | ParameterFile | None = None,
    space: str | Path | None = None,
    settings: DriveSettings | None = None,
    resume: bool = False,
    on_trial: OnTrial | None = None,
    on_run: OnRun | None = None,
    resources: Resources = DEFAULT_RESOURCES,
    **options: Any,
) -> Tuning:
    """Search for better values of a controller's parameters, and compare them with the user's on maps not searched on.

    Args:
        controller: The controller, by its name in the parameter file or by its kind.
        train: Maps of the search, in any form that :func:`bench` takes.
        test: Maps of the comparison; none of them may be a training map.
        out: New directory of the tuning; ``nav2_params.yaml`` in it holds the tuned values.
        params: A preset's name, a ``nav2_params.yaml``, or the options with which it is read; ``thesis`` if None.
        space: File of a search space; the controller's shipped space if None.
        settings: World and navigation in one value, instead of fields of the env.
        resume: Whether to continue the tuning in ``out``; the results equal those without interruption.
        on_trial: Called after each trial with the number of runs so far.
        on_run: Called after each run with its job, its result, and the number of remaining runs of its batch.
        resources: Workers, executor and time limits; the results do not depend on it.
        options: Fields of :class:`evolution.tuning.TuneSettings`, e.g. ``trials=50``, of
            :class:`gym_mapbench.env.config.EnvConfig`, e.g. ``noise="none"`` (``nominal`` if left out), and of
            :class:`evolution.driving.Resources`, e.g. ``workers=2``.

    Returns:
        The tuning; a notebook shows the changed parameters.

    Raises:
        ConfigError: If an option cannot be used, training and test maps overlap, or Optuna is not installed.
        MapFormatError: If a file is no map.
        RunError: If no worker starts, nothing can be written, or a tuning cannot be continued.
    """
    optuna()
    resources, others = resources.taking(options)
    tuned = TuneSettings(**{name: others.pop(name) for name in list(others) if name in TuneSettings.model_fields})
    check_alone(settings, others)
    environment = {"noise": "nominal", **others}
    plan, text = tuning_of(controller, train, test, params, space, settings, environment, tuned)
    try_controllers(plan.jobs_with(None).controllers, plan.world)
    return run_tuning(plan, text, Path(out), resume=resume, resources=resources, on_trial=on_trial, on_run=on_run)


def compose(preset: str = DEFAULT_PRESET, config: Mapping[str, Any] | None = None, **search: Any) -> dict[str, Any]:
    """Return the document of an experiment: a preset, overlaid by ``config``, then by options of the search."""
    return overlay(overlay(load_preset(preset), nested_document(config or {})), {"search": nested(search)})


def _wanted(experiment: str | Path | Mapping[str, Any] | Experiment, search: dict[str, Any]) -> Experiment:
    """Build an experiment."""
    if isinstance(experiment, Experiment):
        return experiment_of(overlay(experiment.document(), {"search": nested(search)})) if search else experiment
    if isinstance(experiment, Mapping):
        return experiment_of(compose(config=experiment, **search))
    if experiment in preset_names():
        return experiment_of(compose(str(experiment), **search))
    return experiment_of(compose(config=read_document(experiment), **search), str(experiment))


def _begin(experiment: Experiment, out: str | Path | None, evaluator: Evaluator) -> RunDir:
    """Check the experiment while the workers start, and make the directory of the run."""
    evaluator.get_ready()
    check_experiment(experiment)
    options = experiment.search
    default = Path("runs") / f"{options.judging.fitness.replace(':', '.')}-pop{options.ga.pop_size}-seed{options.seed}"
    return RunDir.create(out or default, experiment)
