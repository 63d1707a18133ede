"""Models of Stable-Baselines3: made from settings, saved with their card, loaded to be continued."""

from __future__ import annotations

import importlib
import importlib.util
import inspect
import io
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, nullcontext
from operator import attrgetter
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Box

from controllers.learned import ModelCard, Normalization, Sight, write_card
from evolution.files import write_bytes
from evolution.training.settings import TrainSettings
from gym_mapbench.errors import ConfigError, refuse_unknown

OURS = (
    "policy",
    "env",
    "learning_rate",
    "policy_kwargs",
    "seed",
    "device",
    "verbose",
    "tensorboard_log",
    "self",
    "action_noise",
    "_init_setup_model",
)
"""Arguments of an algorithm that follow from other settings."""


KINDS: dict[type, tuple[str, Any]] = {
    bool: ("true or false", bool),
    int: ("a whole number", int),
    float: ("a number", int | float),
}
"""What a hyperparameter may be, by the type of its default."""
UNSET = ("clip_range_vf", "target_kl")
"""Numbers without a default; they may be left out by null."""
SHARES = ("gamma", "gae_lambda", "tau")
"""Hyperparameters of 0 to 1."""
POSITIVE = ("clip_range", "clip_range_vf", "max_grad_norm", "target_kl")
"""Hyperparameters above 0; an update with another value learns nothing or the opposite."""
NOT_NEGATIVE = ("ent_coef", "vf_coef", "target_policy_noise", "target_noise_clip")
"""Hyperparameters of at least 0."""
BY_RULE = ("gradient_steps", "sde_sample_freq")
"""Whole numbers for which -1 stands for a rule of Stable-Baselines3."""
HUGE = 1e6
"""Size of a weight from which on a network counts as diverged."""

LEARNER_STATE = ("_last_obs", "_last_original_obs", "_last_episode_starts", "ep_info_buffer", "ep_success_buffer")
"""Attributes of a model that are of no use for driving."""


def stable_baselines3() -> Any:
    """Import Stable-Baselines3.

    Raises:
        ConfigError: If it is not installed, with what to install.
    """
    try:
        return importlib.import_module("stable_baselines3")
    except ImportError:
        raise ConfigError("training needs stable-baselines3 (pip install 'gym-mapbench[rl]')") from None


class Blank(gymnasium.Env[Any, Any]):
    """An env with the spaces of a training and nothing else.

    Args:
        settings: The training.
    """

    def __init__(self, settings: TrainSettings) -> None:
        inputs = Sight(1, settings.encoding, settings.world).size
        self.observation_space = Box(-1.0, 1.0, (inputs,), np.float32)
        self.action_space = Box(-1.0, 1.0, (2,), np.float32)


def check_model(settings: TrainSettings) -> None:
    """Make a model once, so that errors are reported before a directory is made.

    Raises:
        ConfigError: If a hyperparameter cannot be used, or Stable-Baselines3 is not installed.
    """
    check_hyperparameters(settings)
    from stable_baselines3.common.vec_env import DummyVecEnv

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # they are given when the training begins
        make_model(settings, DummyVecEnv([lambda: Blank(settings)] * settings.envs), None)


def check_hyperparameters(settings: TrainSettings) -> None:
    """Refuse hyperparameters that the algorithm does not have, of another kind than its defaults, or out of range.

    Raises:
        ConfigError: Naming the first, or if Stable-Baselines3 is not installed.
    """
    parameters = inspect.signature(_class_of(settings).__init__).parameters
    known = {name: parameter.default for name, parameter in parameters.items() if name not in OURS}
    for name, value in settings.hyperparameters.items():
        refuse_unknown(f"hyperparameter of {settings.algorithm}", name, known)
        if value is None and known[name] is None:
            continue
        default = 0.0 if name in UNSET else known[name]
        kind = KINDS.get(type(default))
        if kind is not None and not (isinstance(value, kind[1]) and isinstance(value, bool) == (kind[1] is bool)):
            raise ConfigError(f"hyperparameters.{name}: expected {kind[0]}, got {value!r:.80}")
        _check_range(name, value, default)
    _check_learning_starts(settings, known)


def is_sound(model: Any) -> bool:
    """Whether a model's networks have finite weights of usual size and give finite actions on its latest input."""
    import torch

    weights = [weight for weight in model.policy.state_dict().values() if weight.is_floating_point()]
    if not all(bool((weight.abs() < HUGE).all()) for weight in weights):
        return False
    if model._last_obs is None:
        return True
    try:
        with torch.no_grad():
            return bool(np.isfinite(model.predict(model._last_obs)[0]).all())
    except ValueError:
        return False


def make_model(settings: TrainSettings, worlds: Any, logs: Path | None) -> Any:
    """Make a new model.

    Args:
        settings: Algorithm, networks and hyperparameters.
        worlds: The VecEnv of the training.
        logs: Where TensorBoard's files go; None for none.

    Raises:
        ConfigError: If a hyperparameter cannot be used.
    """
    check_hyperparameters(settings)
    from stable_baselines3.common.logger import Logger
    from torch import nn

    activations = {"tanh": nn.Tanh, "relu": nn.ReLU, "elu": nn.ELU}
    network = settings.network
    shape = {"net_arch": list(network.hidden), "activation_fn": activations[network.activation]}
    explored = {"action_noise": _noise(settings.action_noise)} if settings.action_noise else {}
    try:
        model = _class_of(settings)(
            "MlpPolicy",
            worlds,
            learning_rate=settings.learning_rate[0],
            policy_kwargs={**shape, **settings.policy},
            seed=settings.seed,
            device="cpu",
            tensorboard_log=None if logs is None else str(logs),
            **explored,
            **settings.hyperparameters,
        )
    except (TypeError, ValueError, AttributeError, AssertionError, RuntimeError) as error:
        reason = " ".join(str(error).split())[:200]
        raise ConfigError(f"hyperparameters of {settings.algorithm}: cannot be used ({reason})") from None
    if logs is None:  # the logger that Stable-Baselines3 would make leaves a folder among the temporary files
        model.set_logger(Logger(None, []))
    return model


def save_model(model: Any, path: Path, card: ModelCard, *, to_drive: bool = False) -> None:
    """Write a model and its card in one step.

    Args:
        model: The model.
        path: The file.
        card: Its card.
        to_drive: Whether to leave out the state that only learning needs, which is most of the file: the state of the
            optimizers and the latest observations.
    """
    content = io.BytesIO()
    with _forgetful(model) if to_drive else nullcontext():
        model.save(content, exclude=LEARNER_STATE if to_drive else None)
    write_card(content, card)
    write_bytes(path, content.getvalue())


def card_of(settings: TrainSettings, statistics: Any, **training: Any) -> ModelCard:
    """Return the card of a model.

    Args:
        settings: Settings of the training.
        statistics: The VecNormalize whose statistics its input is normalised by; None if it is not.
        training: For readers: steps, success...
    """
    normalization = None
    if statistics is not None:
        normalization = Normalization(
            mean=tuple(statistics.obs_rms.mean.tolist()),
            variance=tuple(statistics.obs_rms.var.tolist()),
            epsilon=statistics.epsilon,
            clip=statistics.clip_obs,
        )
    return ModelCard(
        algorithm=settings.algorithm,
        world=settings.world.replace(maps=None),
        encoding=settings.encoding,
        normalization=normalization,
        training={"seed": settings.seed, **training},
    )


@contextmanager
def threads(count: int) -> Iterator[None]:
    """Let networks use as many CPU threads inside the ``with`` block; their sums, and so the models, depend on it."""
    import torch

    before = torch.get_num_threads()
    torch.set_num_threads(count)
    try:
        yield
    finally:
        torch.set_num_threads(before)


def tensorboard_is_installed() -> bool:
    """Whether TensorBoard's files can be written."""
    return importlib.util.find_spec("tensorboard") is not None


@contextmanager
def _forgetful(model: Any) -> Iterator[None]:
    """Hide the state of a model's optimizers while the ``with`` block lasts."""
    names = [name for name in model.get_parameters() if name.endswith("optimizer")]
    optimizers = [attrgetter(name)(model) for name in names]
    gathered = [optimizer.state for optimizer in optimizers]
    for optimizer in optimizers:
        optimizer.state = type(optimizer.state)(dict)
    try:
        yield
    finally:
        for optimizer, state in zip(optimizers, gathered, strict=True):
            optimizer.state = state


def _check_range(name: str, value: Any, default: Any) -> None:
    if name in SHARES and not 0 <= value <= 1:
        raise ConfigError(f"hyperparameters.{name}: expected 0 to 1, got {value}")
    if name in POSITIVE and value <= 0:
        raise ConfigError(f"hyperparameters.{name}: expected more than 0, got {value}")
    if name in NOT_NEGATIVE and isinstance(value, int | float) and value < 0:
        raise ConfigError(f"hyperparameters.{name}: expected at least 0, got {value}")
    lowest, by_rule = int(name != "learning_starts"), name in BY_RULE
    if type(default) is int and value < lowest and not (by_rule and value == -1):
        raise ConfigError(f"hyperparameters.{name}: expected at least {lowest}{', or -1' * by_rule}, got {value}")


def _check_learning_starts(settings: TrainSettings, known: Mapping[str, Any]) -> None:
    """Refuse a training that ends before its algorithm begins to learn."""
    name = "learning_starts"
    if name in known and settings.steps <= (starts := settings.hyperparameters.get(name, known[name])):
        raise ConfigError(
            f"steps: expected more than hyperparameters.{name}, {starts}, as {settings.algorithm} learns nothing "
            f"before, got {settings.steps}"
        )


def _noise(deviation: float) -> Any:
    from stable_baselines3.common.noise import NormalActionNoise

    return NormalActionNoise(np.zeros(2), np.full(2, deviation))


def _class_of(settings: TrainSettings) -> Any:
    return getattr(stable_baselines3(), settings.algorithm.upper())
