"""run_atlas(): an atlas in a directory that can be continued."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from evolution.driving import DEFAULT_RESOURCES, OnRun, Resources, run_job
from evolution.quality_diversity.grid import ribs_archives
from evolution.quality_diversity.results import ATLAS, Atlas
from evolution.quality_diversity.search import OnStep, search_atlas
from evolution.quality_diversity.settings import AtlasSettings
from evolution.runs import exclusive_evaluator
from evolution.search import Experiment, check_experiment


def run_atlas(
    experiment: Experiment,
    settings: AtlasSettings,
    path: Path,
    *,
    resume: bool = False,
    resources: Resources = DEFAULT_RESOURCES,
    on_step: OnStep = lambda _: None,
    on_run: OnRun | None = None,
) -> Atlas:
    """Fill an atlas, or continue: the store answers the finished runs, so the result is that without interruption.

    Args:
        experiment: Families and mutation of the maps, seed, controllers, world.
        settings: Options.
        path: New directory of the result.
        resume: Whether to continue an atlas that was begun there.
        resources: Workers, executor and time limits; the results do not depend on it.
        on_step: Called with a line about each batch.
        on_run: Called after each run with its job, its result, and the number of remaining runs of its batch.

    Raises:
        ConfigError: If an option cannot be used, pyribs is not installed, or the directory holds something else.
        RunError: If no worker starts, or nothing can be written.
    """
    ribs_archives()
    settings.check(experiment.plan.names)
    check_experiment(experiment)
    document = {"experiment": experiment.document(), "atlas": settings.model_dump(mode="json")}
    ATLAS.begin_or_resume(path, document, _options, resume=resume)
    with exclusive_evaluator(ATLAS, path, resources, run_job, [experiment.plan], on_run) as evaluator:
        found = search_atlas(experiment, settings, evaluator, on_step=on_step)
        atlas = Atlas(experiment, settings, found)
        atlas.write(path)
    return atlas


def _options(document: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the options of a document, as errors name them."""
    return {**document["experiment"], **document["atlas"]}
