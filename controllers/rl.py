"""Learned policies as controllers: any object with ``predict(obs)``, or any callable ``obs -> action``.

Stable-Baselines3 models are objects with ``predict``; :func:`load_sb3` reads one from its file.
"""

from __future__ import annotations

import functools
import inspect
import json
import math
import warnings
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium.spaces import Box, Space

from controllers.base import Context, Observation
from controllers.learned import ModelCard, TrainedPolicy, read_card
from controllers.model_files import model_data, uncompressed
from gym_mapbench.env.action import ActionKind, to_command
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.env.observation import FAR, observation_space
from gym_mapbench.errors import ConfigError
from gym_mapbench.registry import BY_NAME, parameters_of
from gym_mapbench.settings import Settings
from gym_mapbench.world.lidar import LidarSettings

UNLEARNED = {
    "learning_rate": 0.0,
    "clip_range": 0.0,
    "ent_coef": 0.0,
    "buffer_size": 1,
    "n_steps": 1,
    "train_freq": 1,
    "optimize_memory_usage": False,
    "replay_buffer_kwargs": {},
    "rollout_buffer_kwargs": {},
}
"""Hyperparameters of a model that only predicts; SAC makes an optimizer for an entropy coefficient that is learned."""
PREDICTING = ("policy_class", "policy_kwargs", "observation_space", "action_space")
"""Attributes that a model needs to predict."""
TOLD = ("state", "episode_start", "deterministic")
"""What ``predict`` of Stable-Baselines3 takes beside the observation."""
LEARNED_ENTROPY = ("ent_coef_optimizer.pth", "pytorch_variables.pth")
"""Parts of a file that hold the entropy coefficient of SAC; other algorithms have nothing in them."""


class PolicyController:
    """A policy under its own name; made by :func:`as_controller`.

    Args:
        predict: Takes an observation and, by keyword, those of ``state``, ``episode_start`` and ``deterministic`` that
            are in its signature; ``**keywords`` stand for all three. Returns an action or ``(action, state)``.
        name: Name under which the controller is reported.
        observation_keys: Keys of the observation that the policy reads.
        normalized: Whether its actions are shares of the robot's limits, as in an env with ``action="normalized"``.
        spaces: Space of every key that it reads, as far as they are known: the env is given sensors of these sizes, and
            observations are cast to the type of a space of floating-point numbers.
    """

    def __init__(
        self,
        predict: Callable[..., Any],
        name: str,
        observation_keys: tuple[str, ...],
        normalized: bool = False,
        spaces: Mapping[str, Box] | None = None,
    ) -> None:
        self.name = name
        self.observation_keys = observation_keys
        self._action: ActionKind = "normalized" if normalized else "physical"
        self._predict = predict
        self._told = _told(predict)
        self._spaces = dict(spaces or {})
        self._types = {key: box.dtype for key, box in self._spaces.items() if np.issubdtype(box.dtype, np.floating)}

    def fit(self, config: EnvConfig) -> EnvConfig:
        """Return a world with sensors of the sizes that the policy was made for.

        Raises:
            ConfigError: If there are none, naming the key.
        """
        changes = {
            group: change(config, self._spaces[key]) for key, (group, change) in SIZED.items() if key in self._spaces
        }
        try:
            fitted = config.replace(observation=self.observation_keys, **changes)
        except ConfigError as error:
            raise ConfigError(f"{self.name}: {error}") from None
        there = observation_space(fitted)
        for key, space in self._spaces.items():
            if space.shape != there[key].shape:
                raise ConfigError(
                    f"{self.name}: expected {key} of shape {space.shape}, the world's is {there[key].shape}"
                )
        return fitted

    def reset(self, context: Context) -> None:
        """Forget the state of a recurrent policy."""
        self._robot = context.robot
        self._state: Any = None
        self._first = True

    def act(self, observation: Observation) -> tuple[float, float]:
        """Return the policy's action as a command, ``(v m/s, omega rad/s)``.

        Raises:
            ConfigError: If the action is not two finite numbers.
        """
        cast = {key: observation[key].astype(kind, copy=False) for key, kind in self._types.items()}
        offered = {"state": self._state, "episode_start": np.array([self._first]), "deterministic": True}
        answer = self._predict({**observation, **cast}, **{key: offered[key] for key in self._told})
        self._first = False
        action, self._state = answer if _has_state(answer) else (answer, None)
        try:
            return to_command(action, self._robot, self._action)
        except ConfigError as error:
            raise ConfigError(f"{self.name}: {error}") from None


def as_controller(policy: Any, name: str, observation_keys: tuple[str, ...] | None = None) -> PolicyController:
    """Make a controller of a policy.

    Args:
        policy: An object with ``predict(obs)`` that returns an action or ``(action, state)``, or a callable
            ``obs -> action``. If it takes ``state``, the state is handed back at the next call; if it takes
            ``episode_start`` or ``deterministic``, it is given them. An action is ``(v m/s, omega rad/s)``, or, if
            ``policy.action_space`` reaches from -1 to 1, shares of the robot's limits.
        name: Name under which the controller is reported.
        observation_keys: Keys of the observation that the policy reads; None takes the keys of
            ``policy.observation_space``, or the env's default if the policy has none.

    Raises:
        ConfigError: If the policy is neither of the two, its observation space is not a Dict, its actions are not two
            continuous numbers, or the keys are a single text.
    """
    predict = getattr(policy, "predict", policy)
    if not callable(predict):
        raise ConfigError(f"{name}: expected an object with predict(obs) or a callable, got {type(policy).__name__}")
    if isinstance(observation_keys, str):
        raise ConfigError(f"{name}: observation_keys: expected several names, got {observation_keys!r:.80}")
    keys = _observed_by(policy, name) if observation_keys is None else tuple(observation_keys)
    known = getattr(getattr(policy, "observation_space", None), "spaces", {})
    spaces = {key: known[key] for key in keys if isinstance(known.get(key), Box)}
    normalized = _is_normalized(getattr(policy, "action_space", None), name)
    return PolicyController(predict, name, keys, normalized, spaces)


def load_sb3(path: str | Path, name: str) -> PolicyController | TrainedPolicy:
    """Load a Stable-Baselines3 model with continuous actions: one with a card, or one over the env's Dict observation.

    A model without a card decides once a control step of the world, and sees with the world's sensors in the sizes of
    its observation space.

    Like every pickle, such a file can run code while it is read: load only files that you trust.

    Raises:
        ConfigError: If Stable-Baselines3 is not installed, or the file is missing or not such a model.
    """
    try:
        data = model_data(path)
    except ConfigError as error:
        raise ConfigError(f"{name}: {error}") from None
    algorithm = _sb3_algorithm(data, path, name)
    try:
        import stable_baselines3
    except ImportError:
        raise ConfigError(f"{name}: reading {path} needs stable-baselines3 (pip install 'gym-mapbench[rl]')") from None
    try:
        model = _load_to_predict(getattr(stable_baselines3, algorithm), path, data)
    except Exception as error:
        reason = " ".join(str(error).split())[:200] or type(error).__name__
        raise ConfigError(f"{name}: {path} cannot be loaded as a {algorithm} model ({reason})") from None
    try:
        card = read_card(path)
    except ConfigError as error:
        raise ConfigError(f"{name}: {error}") from None
    return as_controller(model, name) if card is None else _with_card(model, name, card, path)


def _load_to_predict(algorithm: Any, path: str | Path, data: dict[str, Any]) -> Any:
    """Load a model without what only learning needs: its optimizers, its replay buffer, and pickled attributes.

    Making an optimizer imports the compiler of torch (2 s in each process). The buffer of an off-policy model has
    gigabytes in its default size. A schedule of the learning rate is compiled for the Python that saved it; another
    Python does not load it, or crashes when it calls it.

    Args:
        algorithm: The class of Stable-Baselines3 that loads it.
        path: Its file.
        data: The attributes in the file, from :func:`~controllers.model_files.model_data`.
    """
    from stable_baselines3.common.save_util import json_to_data

    with warnings.catch_warnings():
        # Stable-Baselines3 only warns, and gives the policy the default network: perhaps another activation function.
        warnings.filterwarnings("error", "Could not deserialize")
        saved = json_to_data(json.dumps({"policy_kwargs": data.get("policy_kwargs", {})}))
    kwargs = {**saved["policy_kwargs"], "optimizer_class": _NoOptimizer}
    parts = uncompressed(path, but=LEARNED_ENTROPY)
    unread = {name: None for name, value in data.items() if _is_pickled(value) and name not in PREDICTING}
    return algorithm.load(parts, device="cpu", custom_objects={**unread, **UNLEARNED, "policy_kwargs": kwargs})


def _is_pickled(attribute: object) -> bool:
    return isinstance(attribute, dict) and ":serialized:" in attribute


class _NoOptimizer:
    """In the place of the optimizer of a model that only predicts; takes and ignores what one would."""

    param_groups = ({"params": ()},)
    """Stable-Baselines3 counts these before it says which parts of a file are missing."""

    def __init__(self, *args: object, **kwargs: object) -> None:
        pass

    def load_state_dict(self, state: object, strict: bool = True) -> None:
        pass


def _with_card(model: Any, name: str, card: ModelCard, path: str | Path) -> TrainedPolicy:
    """Make a controller of a model with a card, if its network is the one that the card describes."""
    wanted, found = (card.input_size,), model.observation_space.shape
    if found != wanted:
        raise ConfigError(f"{name}: {path}: expected a network for {wanted} inputs, as its card says, got {found}")
    return TrainedPolicy(model.predict, name, card)


def _lidar_of(config: EnvConfig, space: Box) -> LidarSettings:
    """Return a lidar with as many beams as a space has entries, and the range of its upper bound if there is one."""
    farthest = float(space.high.max())
    changes = {"range_max": farthest} if math.isfinite(farthest) and farthest < FAR else {}
    return config.lidar.replace(beams=space.high.size, **changes)


def _told(predict: Callable[..., Any]) -> tuple[str, ...]:
    """Return which of :data:`TOLD` a policy takes by keyword.

    The first positional argument is the observation, whatever its name. A method ``predict`` with ``**keywords`` takes
    all, and so does another callable that names its observation. A callable of ``(*args, **keywords)``, such as a
    decorated function, takes none: the function inside may take none. Keywords that a ``partial`` has bound stay.
    """
    # A module of PyTorch takes anything, and passes it on to its forward.
    parameters = parameters_of(getattr(predict, "forward", predict))
    named = bool(parameters) and parameters[0].kind in (inspect.Parameter.POSITIONAL_ONLY, BY_NAME[0])
    beside = {one.name: one.kind for one in parameters[named:]}
    bound, function = (predict.keywords, predict.func) if isinstance(predict, functools.partial) else ({}, predict)
    open_end = inspect.Parameter.VAR_KEYWORD in beside.values()
    takes_all = open_end and (named or getattr(function, "__name__", "") == "predict")
    return tuple(name for name in TOLD if name not in bound and (takes_all or beside.get(name) in BY_NAME))


SIZED: dict[str, tuple[str, Callable[[EnvConfig, Box], Settings]]] = {
    "scan": ("lidar", _lidar_of),
    "path": ("path", lambda config, space: config.path.replace(points=space.high.size // 2)),
    "costmap": ("costmap", lambda config, space: config.costmap.replace(cells=math.isqrt(space.high.size))),
    "people": ("people", lambda config, space: config.people.replace(nearest=space.high.size // 6)),
}
"""For every key whose size is an option of the env: the group of options, and the group for a space of that key."""


def _has_state(answer: Any) -> bool:
    """Tell ``(action, state)`` from an action that is a tuple of two numbers."""
    return isinstance(answer, tuple) and len(answer) == 2 and np.ndim(answer[0]) > 0


def _observed_by(policy: Any, name: str) -> tuple[str, ...]:
    """Return the keys of a policy's observation space, or the env's default if it has none."""
    space = getattr(policy, "observation_space", None)
    if space is None:
        keys: tuple[str, ...] = EnvConfig.model_fields["observation"].default
        return keys
    spaces = getattr(space, "spaces", None)
    if not isinstance(spaces, Mapping):
        raise ConfigError(f"{name}: expected a policy over the env's Dict observation, got one over {_named(space)}")
    return tuple(spaces)


def _is_normalized(space: Any, name: str) -> bool:
    """Whether an action space is that of an env with ``action="normalized"``, in any type of numbers.

    Raises:
        ConfigError: If it is known and not one of two continuous numbers.
    """
    if isinstance(space, Space) and not (isinstance(space, Box) and space.shape == (2,)):
        raise ConfigError(f"{name}: expected a policy whose actions are a Box of shape (2,), got {_named(space)}")
    low, high = (getattr(space, end, ()) for end in ("low", "high"))
    return np.array_equal(low, [-1.0, -1.0]) and np.array_equal(high, [1.0, 1.0])


def _named(space: Any) -> str:
    """Return kind and shape of a space; its own text may have many lines."""
    return f"a {type(space).__name__} of shape {getattr(space, 'shape', None)}"


def _sb3_algorithm(data: dict[str, Any], path: str | Path, name: str) -> str:
    """Return the name of the algorithm that can load a model: TD3 for DDPG too, which is a TD3 with one critic."""
    policy = data.get("policy_class")
    module = str(policy.get("__module__", "")) if isinstance(policy, dict) else ""
    known = {
        "stable_baselines3.common.policies": "PPO" if "clip_range" in data else "A2C",
        "stable_baselines3.sac.policies": "SAC",
        "stable_baselines3.td3.policies": "TD3",
    }
    if module not in known:
        wanted = "an A2C, DDPG, PPO, SAC or TD3 model with a policy class of Stable-Baselines3"
        raise ConfigError(f"{name}: expected {path} to hold {wanted}, got a policy class of {module or '?'}")
    return known[module]
