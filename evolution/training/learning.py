"""Training: from settings and maps to a model in a directory, which can be continued."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.learned import Features
from evolution.files import locked
from evolution.training.algorithms import check_model, is_sound, make_model, tensorboard_is_installed, threads
from evolution.training.continuing import continued_model, load_experience, load_statistics, saved_steps
from evolution.training.directory import (
    BUFFER,
    LATEST,
    LOGS,
    STATISTICS,
    TRAINING,
    Training,
    TrainingDir,
    load_training,
)
from evolution.training.evaluation import Judgement, judge
from evolution.training.levels import EVERY_FIFTH, GivenLevels, Levels, RandomLevels, ReplayedLevels, is_split, split
from evolution.training.record import Recorder, TrainProgress
from evolution.training.settings import TrainSettings
from gym_mapbench.env.scenario_source import draw_scenario, is_planned
from gym_mapbench.errors import ConfigError, RunError
from gym_mapbench.generator import with_people
from gym_mapbench.world.clearance import check_clearance
from gym_mapbench.world.scenario import Scenario

LOG = logging.getLogger(__name__)
HELD_OUT = 20_260_713
"""Seed of the random maps that policies are judged on: the same in every training."""


def begin_training(
    settings: TrainSettings, path: Path, maps: Sequence[Scenario] = (), curriculum: Sequence[Scenario] = ()
) -> TrainingDir:
    """Check everything and make the directory of a training.

    Args:
        settings: The training.
        path: New or empty directory.
        maps: Maps to train on; empty for random ones.
        curriculum: Levels to replay among them; empty for none.

    Raises:
        ConfigError: If something cannot be used; nothing is made then.
    """
    check_model(settings)
    _check_maps(settings, (*maps, *curriculum))
    _check_held_out(maps, curriculum)
    _check_held_out(curriculum, maps)
    return TrainingDir.create(path, settings, maps, curriculum)


def learn(directory: TrainingDir, on_progress: Callable[[TrainProgress], None] | None = None) -> Training:
    """Train from where the directory stands to the end.

    Args:
        directory: New, or one in which a training was interrupted.
        on_progress: Called after every rollout.

    Returns:
        The training, as :func:`~evolution.training.directory.load_training` reads it.

    Raises:
        RunError: If the directory is damaged, cannot be written, was written by another version of this package, or
            another process trains there; or if the training diverges.
        KeyboardInterrupt: At Ctrl-C, SIGTERM or SIGHUP; the model is kept and can be continued.
    """
    with locked(directory.path / TRAINING.mark, 0.0):
        if not (directory.state or {}).get("finished"):
            _go_on(directory, on_progress)
    return load_training(directory.path)


def _check_maps(settings: TrainSettings, scenarios: Sequence[Scenario]) -> None:
    """Refuse given maps on which no episode can begin."""
    for scenario in scenarios:
        check_clearance(scenario, settings.world.robot)
        if not is_planned(settings.world, scenario):
            raise ConfigError(f"{scenario.name}: expected a map on which the planner finds the observed path, got none")


def _check_held_out(scenarios: Sequence[Scenario], others: Sequence[Scenario]) -> None:
    """Refuse scenarios of which one is held out that is trained on among the others."""
    trained = {one.digest for one in split(others)[0]}
    for one in split(scenarios)[1] if is_split(scenarios) else ():
        if one.digest in trained:
            raise ConfigError(
                f"maps and curriculum: expected no map that one holds out and the other trains on, got {one.name}"
            )


def _go_on(directory: TrainingDir, on_progress: Callable[[TrainProgress], None] | None) -> None:
    """Train to the end, or until Ctrl-C, SIGTERM or SIGHUP."""
    from evolution.training.callback import Companion, Interruption
    from evolution.training.vec_env import TrainingWorlds

    settings, state = directory.settings, directory.state
    TRAINING.check_resumed(directory.path, directory.config, {})
    maps, curriculum = directory.read_maps()
    directory.complete()
    for name in directory.not_held_out:
        LOG.warning("%s: fewer than %d, so none is held out: success is that on the training maps", name, EVERY_FIFTH)
    done = 0 if state is None else saved_steps(directory.path / LATEST)
    worlds = TrainingWorlds(settings, make_levels(settings, maps, curriculum, done), done)
    lessons, statistics = _normalized(settings, worlds, directory.path if state else None, done)
    model = _model(directory, lessons, resumed=state is not None)
    recorder = Recorder(directory, statistics, done)
    groups = held_out_groups(settings, maps, curriculum)
    interruption = Interruption()
    companion = Companion(
        settings, worlds, recorder, partial(_judge_all, settings, groups, statistics), interruption, on_progress
    )
    with interruption.heeded(), threads(settings.threads), _divergence_told(model, directory.path):
        left = settings.steps - model.num_timesteps
        model.learn(left, callback=companion, reset_num_timesteps=state is None, tb_log_name=settings.algorithm)
        if interruption.asked:
            recorder.keep(model)
            raise KeyboardInterrupt
        companion.evaluate()


@contextmanager
def _divergence_told(model: Any, path: Path) -> Iterator[None]:
    """Turn whatever fails inside the ``with`` block into an error of one line, if the networks have diverged.

    Raises:
        RunError: If they have.
    """
    try:
        yield
    except Exception as error:
        if is_sound(model):
            raise
        raise RunError(
            f"{path}: the training has diverged at step {model.num_timesteps}: expected finite weights and actions of "
            "the policy, got others; a lower learning_rate may help"
        ) from error


def make_levels(
    settings: TrainSettings, maps: Sequence[Scenario], curriculum: Sequence[Scenario], done: int = 0
) -> Levels:
    """Return what gives every episode its map; after ``done`` steps, others than at the beginning."""
    fresh_rng, replay_rng = (np.random.default_rng((settings.seed, done, stream)) for stream in range(2))
    fresh: Levels = GivenLevels(split(maps)[0], fresh_rng) if maps else RandomLevels(settings, fresh_rng)
    return ReplayedLevels(settings.replay, fresh, split(curriculum)[0], replay_rng) if curriculum else fresh


def held_out_groups(
    settings: TrainSettings, maps: Sequence[Scenario], curriculum: Sequence[Scenario]
) -> dict[str, list[Scenario]]:
    """Return the maps that the policy is judged on, by the name of their group; of fewer than five, the training's."""
    groups = {"maps": split(maps)[1]} if maps else _random_groups(settings)
    return {**groups, "curriculum": split(curriculum)[1]} if curriculum else groups


def _random_groups(settings: TrainSettings) -> dict[str, list[Scenario]]:
    groups = {}
    for count in settings.evaluation.obstacles:
        world = settings.world.replace(shapes=settings.world.shapes.replace(n_obstacles=(count, count)))
        rng = np.random.default_rng((HELD_OUT, count))
        drawn = [draw_scenario(world, rng) for _ in range(settings.evaluation.maps)]
        groups[f"random_{count}"] = [with_people(scenario, settings.people, rng) for scenario in drawn]
    return groups


def _judge_all(
    settings: TrainSettings, groups: Mapping[str, Sequence[Scenario]], statistics: Any, model: Any
) -> dict[str, Judgement]:
    """Evaluate the model, without exploration, on every group of maps."""

    def act(features: Features) -> NDArray[Any]:
        seen = statistics.normalize_obs(features) if settings.normalize_observations else features
        actions: NDArray[Any] = model.predict(seen, deterministic=True)[0]
        return actions

    world, encoding = settings.judged_world, settings.encoding
    return {name: judge(act, world, encoding, maps, HELD_OUT) for name, maps in groups.items()}


def _normalized(settings: TrainSettings, worlds: Any, resumed: Path | None, done: int) -> tuple[Any, Any]:
    """Return the worlds, in a VecNormalize if the settings want one, and that VecNormalize, after ``done`` steps."""
    if not (settings.normalize_rewards or settings.normalize_observations):
        return worlds, None
    from stable_baselines3.common.vec_env import VecNormalize

    gamma = float(settings.hyperparameters.get("gamma", 0.99))  # type: ignore[arg-type]
    observations, rewards = settings.normalize_observations, settings.normalize_rewards
    wrapped = VecNormalize(worlds, norm_obs=observations, norm_reward=rewards, gamma=gamma)
    if resumed is not None:
        load_statistics(wrapped, resumed / STATISTICS, done)
    return wrapped, wrapped


def _model(directory: TrainingDir, lessons: Any, *, resumed: bool) -> Any:
    """Make a model, or load the one to be continued."""
    logs = directory.path / LOGS if tensorboard_is_installed() else None
    if not resumed:
        return make_model(directory.settings, lessons, logs)
    model = continued_model(directory.settings, directory.path / LATEST, lessons, logs)
    if hasattr(model, "replay_buffer"):
        load_experience(model, directory.path / BUFFER)
    return model
