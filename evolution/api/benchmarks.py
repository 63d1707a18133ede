"""The functions that run controllers on given maps."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from controllers.nav2_params import Nav2Params
from evolution.arguments import instance_of, names_from, path_from, positive_number
from evolution.benchmark import (
    BENCHMARK,
    RULED,
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
    refuse_ruled,
    run_configurations,
    value_of,
)
from evolution.benchmark import bench as run_all
from evolution.driving import (
    DEFAULT_RESOURCES,
    DriveSettings,
    JobPlan,
    OnRun,
    Resources,
    check_room,
    run_job,
    try_controllers,
)
from evolution.files import Row
from evolution.inputs import (
    Controllers,
    Maps,
    barn_source,
    check_alone,
    chosen,
    each_once,
    items_of,
    load_all,
    own_controllers,
    read_parameters,
    run_of,
    seed_of,
    specs_of,
    world_from,
)
from evolution.minimizing import Minimized, MinimizeSettings, read_verdict, run_minimizing
from evolution.runs import exclusive_evaluator
from gym_mapbench.errors import ConfigError
from gym_mapbench.mapio import PoseLike
from gym_mapbench.metrics import ALWAYS

LOG = logging.getLogger(__name__)


def bench(
    maps: Maps | Sequence[Maps],
    controllers: Controllers | None = None,
    *,
    params: str | Path | Nav2Params | None = None,
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
        maps: One or several; ``barn:DIR`` must be the only one and has the rules of BARN. A map that is given twice,
            with its task, runs once; the best set of a run has each of its maps.
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
        metrics: A name or names of further metrics, besides the project's own.
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
    kept = _directory(out, resume=resume)
    metrics = names_from("metrics", metrics)
    resources, environment = instance_of(Resources, "resources", resources).taking(options)
    items = items_of(maps)
    if barn_source(items):
        refuse_ruled({name: environment.get(name) for name in RULED})
    read, run = read_parameters(params, controllers), run_of(items)
    scenarios = load_all(items, start, goal)
    scenarios = each_once(scenarios) if run is None else scenarios
    check_alone(settings, {"params": params, **environment})
    settings = settings or world_from(params, read, environment, run)
    settings = settings.replace(unknown_map=unknown_map or settings.unknown_map)
    settings = barn_settings(settings) if barn_source(items) else settings
    check_room(scenarios, settings)
    specs = specs_of(own_controllers(read, run) if controllers is None else controllers)
    try_controllers(specs, settings)
    root = seed_of(seed, run)
    plan = JobPlan(specs, settings, root, repeats, metrics)
    LOG.info("seed %d%s; controllers: %s", root, "" if seed is not None else " (not given)", ", ".join(plan.names))
    if kept is not None:
        begin_benchmark(kept, benchmark_document(scenarios, plan), resume=resume)
    with exclusive_evaluator(BENCHMARK, kept, resources, run_job, [plan], on_run) as evaluator:
        result = run_all(scenarios, plan, evaluator)
        result = replace(result, metrics=_shown(metrics, result.rows, result.metrics))
        result = result if run is None else replace(result, reevaluation=reevaluation_in(result.rows, run))
        if kept is not None:
            result.save(kept)
    return result


def _measured(configuration: Configuration, metrics: Sequence[str]) -> Configuration:
    """Return a configuration with further metrics."""
    plan = configuration.plan
    return replace(configuration, plan=replace(plan, metrics=(*plan.metrics, *metrics)))


def _directory(out: str | Path | None, *, resume: bool) -> Path | None:
    """Return the directory of a benchmark; None if nothing is to be written."""
    if resume and out is None:
        raise ConfigError("resume: expected the directory of a benchmark in 'out', got none")
    return None if out is None else path_from("out", out)


def _shown(asked: Sequence[str], rows: Sequence[Row], further: Sequence[str]) -> tuple[str, ...]:
    """Return the metrics that the tables show: those asked for that every run has, and the further ones."""
    always = [name for name in asked if name in ALWAYS and any(value_of(row, name) is not None for row in rows)]
    return tuple(dict.fromkeys([*always, *further]))


def compare(
    maps: Maps | Sequence[Maps],
    configurations: Sequence[Configuration],
    *,
    start: PoseLike | None = None,
    goal: PoseLike | None = None,
    against_first: bool = False,
    metrics: Sequence[str] = (),
    out: str | Path | None = None,
    resume: bool = False,
    on_run: OnRun | None = None,
    resources: Resources = DEFAULT_RESOURCES,
    **options: Any,
) -> ParameterComparison:
    """Run every configuration on every map with the same seeds and noise, and compare in pairs.

    Args:
        maps: One or several; a map that is given twice, with its task, runs once.
        configurations: Labels with controllers and parameters; :func:`configuration_of` makes one from a file, and
            :func:`evolution.benchmark.sweep` makes those of a sweep.
        start: Start pose ``(x, y, yaw)`` in m and rad, instead of the one in the files.
        goal: The same for the goal.
        against_first: Whether to compare each configuration with the first only; else all pairs are compared.
        metrics: A name or names of further metrics, besides the project's own and those of the configurations.
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
    kept = _directory(out, resume=resume)
    metrics = names_from("metrics", metrics)
    resources = instance_of(Resources, "resources", resources).replace(**options)
    configurations = [_measured(one, metrics) for one in check_configurations(configurations)]
    scenarios = each_once(load_all(items_of(maps), start, goal))
    for one in configurations:
        check_room(scenarios, one.plan.settings)
        try_controllers(one.plan.controllers, one.plan.settings)
    if kept is not None:
        begin_benchmark(kept, configurations_document(scenarios, configurations), resume=resume)
    plans = [one.plan for one in configurations]
    with exclusive_evaluator(BENCHMARK, kept, resources, run_job, plans, on_run) as evaluator:
        rows = run_configurations(scenarios, configurations, evaluator)
    parameters = parameter_rows(configurations)
    result = ParameterComparison(rows, parameters, against_first, tuple(configurations), tuple(scenarios))
    further = [name for one in configurations for name in one.plan.metrics]
    result = replace(result, metrics=_shown(metrics, rows, further))
    if kept is not None:
        result.save(kept)
    return result


def minimize(
    maps: Maps | Sequence[Maps],
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
        maps: A map, or the best maps of a run, or several.
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
    path, largest = path_from("out", out), positive_number("tolerance", tolerance)
    resources, environment = instance_of(Resources, "resources", resources).taking(options)
    items = items_of(maps)
    run = run_of(items)
    check_alone(settings, environment)
    world = settings or world_from(None, None, environment, run)
    scenario = chosen(load_all(items, start, goal), map_name)
    specs = specs_of(own_controllers(None, run) if controllers is None else controllers)
    verdict = read_verdict(instance_of(str, "keep", keep), [one.name for one in specs], largest)
    specs = tuple(one for one in specs if not verdict.outcomes or one.name in verdict.outcomes)
    check_room([scenario], world)
    try_controllers(specs, world)
    plan = JobPlan(specs, world, seed)
    wanted = MinimizeSettings(seeds=seeds, held_out_seeds=held_out_seeds)
    result = run_minimizing(
        scenario, plan, verdict, wanted, path, resume=resume, resources=resources, on_step=on_step, on_run=on_run
    )
    return result, plan


def configuration_of(
    label: str,
    params: str | Path | Nav2Params,
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
    read = read_parameters(params, controllers)
    settings = world_from(params, read, environment, None)
    specs = specs_of(own_controllers(read, None) if controllers is None else controllers)
    return Configuration(label, JobPlan(specs, settings, seed, repeats))
