"""The functions that improve controllers: training and tuning."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from evolution.arguments import instance_of, path_from, refuse_beside_resume
from evolution.driving import DEFAULT_RESOURCES, DriveSettings, OnRun, ParameterFile, Resources, try_controllers
from evolution.inputs import Maps, check_alone, levels_of, listed, tuning_of
from evolution.training import Training, TrainingDir, TrainProgress, begin_training, learn, train_settings
from evolution.tuning import OnTrial, TuneSettings, Tuning, optuna, run_tuning


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
        refuse_beside_resume(given)
        return learn(TrainingDir.open(path_from("resume", resume)), on_progress)
    settings = train_settings(algorithm, config, **options)
    path = path_from("out", out or Path("runs") / f"{settings.algorithm}-seed{settings.seed}")
    directory = begin_training(settings, path, listed(maps), levels_of(curriculum))
    return learn(directory, on_progress)


def tune(
    controller: str,
    train: Maps | Sequence[Maps],
    test: Maps | Sequence[Maps],
    *,
    out: str | Path,
    params: str | Path | ParameterFile | None = None,
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
    path = path_from("out", out)
    resources, others = instance_of(Resources, "resources", resources).taking(options)
    tuned = TuneSettings(**{name: others.pop(name) for name in list(others) if name in TuneSettings.model_fields})
    check_alone(settings, others)
    environment = {"noise": "nominal", **others}
    plan, text = tuning_of(controller, train, test, params, space, settings, environment, tuned)
    try_controllers(plan.jobs_with(plan.own).controllers, plan.world)
    return run_tuning(plan, text, path, resume=resume, resources=resources, on_trial=on_trial, on_run=on_run)
