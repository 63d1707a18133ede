"""The functions that search for maps."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from evolution.arguments import instance_of, names_from, path_from, refuse_beside_resume, whole_number
from evolution.driving import DEFAULT_RESOURCES, Evaluator, OnRun, Resources, preparation_of, run_job
from evolution.pictures import write_run_figures
from evolution.quality_diversity import Atlas, AtlasSettings, run_atlas
from evolution.runs import RUN, LoadedRun, RunDir, exclusive_store, experiment_in, load_run
from evolution.search import (
    DEFAULT_PRESET,
    Experiment,
    Progress,
    check_experiment,
    check_sections,
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
from gym_mapbench.ros_params import overlay

DEFAULT_ATLAS = AtlasSettings()
LOG = logging.getLogger(__name__)


def evolve(
    experiment: str | Path | Mapping[str, Any] | Experiment | None = None,
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
        experiment: A preset's name, a YAML file with the sections ``search``, ``controllers`` and ``run``, the
            ``config.json`` of a run, the same as a mapping, or an experiment; ``robust`` if None. The preset
            ``robust`` gives the options that another file or mapping leaves out.
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
    resources, search = instance_of(Resources, "resources", resources).taking(options)
    if resume is not None:
        refuse_beside_resume({"experiment": experiment, "out": out, **search})
    begun = None if resume is None else RunDir.open(path_from("resume", resume))
    wanted = _wanted(experiment, search) if begun is None else experiment_in(begun)
    LOG.info("seed %d; controllers: %s", wanted.search.seed, ", ".join(wanted.plan.names))
    with resources.evaluator(run_job, warm_up=preparation_of([wanted.plan]), on_run=on_run) as evaluator:
        rundir = begun or _begin(wanted, out, evaluator)
        with exclusive_store(RUN, rundir.path, resources.wait_s) as evaluator.store:
            search_on(wanted, evaluator, rundir, on_generation=on_generation)
        run = load_run(rundir.path)
        write_run_figures(run, apply=evaluator.map)
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
    path = path_from("out", out)
    resources, search = instance_of(Resources, "resources", resources).taking(options)
    settings = instance_of(AtlasSettings, "settings", settings)
    wanted = _wanted(experiment, search)
    return run_atlas(wanted, settings, path, resume=resume, resources=resources, on_step=on_step, on_run=on_run)


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
        only: A name or names of the configurations (in a sweep, of the worlds) to run now; all if None.
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
    resources = instance_of(Resources, "resources", resources).replace(**options)
    only = None if only is None else names_from("only", only)
    runs = None if runs is None else whole_number("runs", runs, 1)
    wanted, path = study_in(settings, out, resume=resume)
    if isinstance(wanted, SweepSettings):
        return run_sweep(wanted, path, resume=resume, only=only, maps=runs, resources=resources, on_run=on_run)
    return run_study(wanted, path, resume=resume, only=only, runs=runs, resources=resources, on_progress=on_progress)


def compose(preset: str | None = None, config: Mapping[str, Any] | None = None, **search: Any) -> dict[str, Any]:
    """Return the document of an experiment: a preset, overlaid by ``config``, then by options of the search.

    Without a preset it is the default one, or none for the ``config.json`` of a run, which has all options.
    """
    config = config or {}
    base = {} if preset is None and "format" in config else load_preset(preset or DEFAULT_PRESET)
    return overlay(overlay(base, nested_document(config)), {"search": nested(search)})


def _wanted(experiment: str | Path | Mapping[str, Any] | Experiment | None, search: dict[str, Any]) -> Experiment:
    """Build an experiment; the default preset's if None."""
    if experiment is None:
        return experiment_of(compose(DEFAULT_PRESET, **search))
    if isinstance(experiment, Experiment):
        return experiment_of(overlay(experiment.document(), {"search": nested(search)})) if search else experiment
    if isinstance(experiment, Mapping):
        check_sections(experiment, "experiment")
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
    return RunDir.create(path_from("out", out or default), experiment)
