"""The saved state of a training: weights, statistics and experience, as numbers.

Stable-Baselines3 would unpickle its files, and so run code of a directory from another person. Of its model file only
the weights and the counters (plain JSON) are read; everything else follows from the settings.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.model_files import model_data
from evolution.files import counted, read_arrays, write_arrays
from evolution.training.algorithms import make_model
from evolution.training.settings import TrainSettings
from gym_mapbench.errors import ConfigError, RunError

LOG = logging.getLogger(__name__)

COUNTERS = ("num_timesteps", "_n_updates", "_episode_num")
MOMENTS = ("mean", "var", "count")
NORMALIZED = ("obs_rms", "ret_rms")
SLACK = 1_000_000
"""Bytes that headers may take in a file of arrays."""


def continued_model(settings: TrainSettings, path: Path, worlds: Any, logs: Path | None) -> Any:
    """Return a model that continues a saved one.

    Args:
        settings: Settings of the training.
        path: The saved model.
        worlds: The VecEnv of the training.
        logs: Where TensorBoard's files go; None for none.

    Raises:
        RunError: If the file is not such a model.
    """
    from stable_baselines3.common.save_util import load_from_zip_file, recursive_setattr

    model, counted = make_model(settings, worlds, logs), _counters(path)
    try:
        _, weights, variables = load_from_zip_file(path, load_data=False, device="cpu")
        model.set_parameters(weights, exact_match=True, device="cpu")
        for name, value in (variables or {}).items():
            recursive_setattr(model, f"{name}.data", value.data)
    except Exception as error:
        reason = " ".join(str(error).split())[:200]
        raise RunError(f"{path}: cannot be continued as a model of {settings.algorithm} ({reason})") from None
    vars(model).update(counted)
    model.set_random_seed(settings.seed_after(model.num_timesteps))
    return model


def saved_steps(path: Path) -> int:
    """Return the steps of a saved model.

    Raises:
        RunError: If the file is not such a model.
    """
    return _counters(path)["num_timesteps"]


def save_statistics(statistics: Any, path: Path, steps: int) -> None:
    """Write the running statistics of a VecNormalize, and the steps of the model that they belong to."""
    found = _moments(statistics)
    arrays = {f"{name}.{part}": np.asarray(getattr(one, part)) for name, one in found.items() for part in MOMENTS}
    write_arrays(path, arrays | {"steps": np.asarray(steps)})


def load_statistics(statistics: Any, path: Path, steps: int) -> None:
    """Load running statistics into a VecNormalize.

    A log message says if they are those of other steps: the training was killed between model and statistics.

    Args:
        statistics: The VecNormalize.
        path: What :func:`save_statistics` wrote, or an earlier version, which recorded no steps.
        steps: Steps of the continued model.

    Raises:
        RunError: If the file is damaged.
    """
    arrays = read_arrays(path, SLACK)
    kept = int(_fitting(arrays, "steps", (), path)) if "steps" in arrays else steps
    if kept != steps:
        LOG.warning("%s: expected the statistics of %d steps, got those of %d, which are used", path, steps, kept)
    for name, one in _moments(statistics).items():
        for part in MOMENTS:
            value = _fitting(arrays, f"{name}.{part}", np.shape(getattr(one, part)), path)
            setattr(one, part, value if value.shape else float(value))


def save_experience(model: Any, path: Path) -> None:
    """Write the content of a model's replay buffer, and the steps of the model."""
    buffer = model.replay_buffer
    arrays = {name: array[: buffer.size()] for name, array in _arrays(buffer).items()}
    write_arrays(path, arrays | {"pos": np.asarray(buffer.pos), "steps": np.asarray(model.num_timesteps)})


def load_experience(model: Any, path: Path) -> None:
    """Fill the replay buffer of a continued model, if its experience was kept at the same step.

    With less experience than ``learning_starts``, the model first explores at random until it has as much. A log
    message says where experience is lost.

    Args:
        model: The model, with its steps and an empty buffer.
        path: What :func:`save_experience` wrote; there may be no such file.

    Raises:
        RunError: If the file is damaged or of another training.
    """
    buffer, expected = model.replay_buffer, f"expected the experience of {counted(model.num_timesteps, 'step')}"
    lost = f"{path}: {expected}, got none"
    if path.is_file():
        arrays = read_arrays(path, SLACK + sum(array.nbytes for array in _arrays(buffer).values()))
        steps = int(_fitting(arrays, "steps", (), path))
        lost = f"{path}: {expected}, got that of {steps}"
        if steps == model.num_timesteps:
            _fill(buffer, arrays, path)
            lost = ""
    wanted = min(model.learning_starts, buffer.buffer_size * buffer.n_envs)
    missing = wanted - buffer.size() * buffer.n_envs
    if lost:
        LOG.warning("%s; the training collects %d steps before it learns on", lost, missing)
    if missing > 0:
        model.learning_starts = max(model.learning_starts, model.num_timesteps + missing)


def _fill(buffer: Any, arrays: Mapping[str, NDArray[Any]], path: Path) -> None:
    """Fill a new replay buffer."""
    own = _arrays(buffer)
    kept = min(len(arrays.get(next(iter(own)), ())), buffer.buffer_size)
    for name, array in own.items():
        array[:kept] = _fitting(arrays, name, (kept, *array.shape[1:]), path)
    buffer.full = kept == buffer.buffer_size
    buffer.pos = int(_fitting(arrays, "pos", (), path)) % buffer.buffer_size


def _counters(path: Path) -> dict[str, int]:
    """Return the counters of a saved model; raises ``RunError`` if it is none."""
    try:
        data = model_data(path)
        return {name: int(data[name]) for name in COUNTERS}
    except (ConfigError, KeyError, TypeError, ValueError) as error:
        reason = str(error) if isinstance(error, ConfigError) else f"{path}: expected the counters of a model"
        raise RunError(reason) from None


def _moments(statistics: Any) -> dict[str, Any]:
    return {name: getattr(statistics, name) for name in NORMALIZED if hasattr(statistics, name)}


def _arrays(buffer: Any) -> dict[str, NDArray[Any]]:
    return {name: value for name, value in vars(buffer).items() if isinstance(value, np.ndarray)}


def _fitting(arrays: Mapping[str, NDArray[Any]], name: str, shape: tuple[int, ...], path: Path) -> NDArray[Any]:
    """Return an array of numbers of the right shape."""
    found = arrays.get(name)
    numbers = found is not None and found.shape == shape and np.issubdtype(found.dtype, np.number)
    if found is None or not (numbers and np.isfinite(found).all()):
        what = "none" if found is None else f"{found.dtype} {found.shape}"
        raise RunError(f"{path}: {name}: expected finite numbers of shape {shape}, got {what}")
    return found
