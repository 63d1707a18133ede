"""The card of a trained model: its observations and its world, as a JSON file inside the model's own zip.

Stable-Baselines3 ignores files that it does not know, so a model with a card is still one of its models.
"""

from __future__ import annotations

import json
import zipfile
from pathlib import Path
from typing import Any, BinaryIO, Literal

import numpy as np
from pydantic import Field

from controllers.learned.encoding import EncodingSettings, Features
from controllers.learned.memory import Sight
from controllers.model_files import MAX_MODEL_BYTES
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.errors import ConfigError
from gym_mapbench.files.bounded import open_zip
from gym_mapbench.files.documents import parse_json
from gym_mapbench.quantities import Positive
from gym_mapbench.settings import Settings

CARD = "mapbench.json"
MAX_CARD_BYTES = 1_000_000
SCANNER = ("beams", "range_max", "angle_min", "angle_increment")
"""Options on which a network's input depends; the scanner's place and noise are those of the current world."""
NO_CARD = (
    "has no card, so it decides at the world's control_hz and sees with the world's sensors, in the sizes of its "
    "observation space: angles of the scan, spacing of the path and all else may differ from its training, and "
    "wrappers that change observations or actions (VecNormalize, VecFrameStack, RescaleAction) do not act"
)
"""What is assumed of a model without a card, for a note to the user."""

WINDOWS = {"path": ("path", "costmap"), "costmap": ("costmap",), "people": ("people",)}
"""Groups of the world's options that a window depends on: the path is planned on the costmap."""


class Normalization(Settings):
    """Statistics of Stable-Baselines3's VecNormalize, applied to the encoder's features.

    Args:
        mean: Mean of every entry.
        variance: Variance of every entry.
        epsilon: Added to the variance.
        clip: Largest absolute value of a normalised entry.
    """

    mean: tuple[float, ...]
    variance: tuple[float, ...]
    epsilon: float = 1e-8
    clip: Positive = 10.0

    def apply(self, features: Features) -> Features:
        """Return normalised features."""
        scaled = (features - np.array(self.mean)) / np.sqrt(np.array(self.variance) + self.epsilon)
        clipped: Features = np.clip(scaled, -self.clip, self.clip).astype(np.float32)
        return clipped


class ModelCard(Settings):
    """What travels with a trained model.

    Args:
        format: Always ``mapbench-model``.
        format_version: Version of this format.
        algorithm: Name of the algorithm that trained it.
        world: The world it was trained in, without its maps: robot, rates, sensors, noise, tolerances. One action a
            control step: its ``control_hz`` is the rate at which the model decides.
        encoding: How observations become its input.
        normalization: Statistics that its input is normalised by, if it is.
        training: How it was trained and how well it drove then; for readers only.
    """

    format: Literal["mapbench-model"] = "mapbench-model"
    format_version: Literal[1] = 1
    algorithm: str
    world: EnvConfig
    encoding: EncodingSettings
    normalization: Normalization | None = None
    training: dict[str, Any] = Field(default_factory=dict)

    @property
    def input_size(self) -> int:
        """Entries of the model's input."""
        return Sight(1, self.encoding, self.world).size

    def repeats_in(self, config: EnvConfig) -> int:
        """Return for how many control steps of a world an action holds.

        Raises:
            ConfigError: If it is no whole number.
        """
        repeats = config.control_hz / self.world.control_hz
        if repeats < 1 or abs(repeats - round(repeats)) > 1e-9:
            raise ConfigError(
                f"control_hz: expected a multiple of {self.world.control_hz:g}, the rate at which the model decides, "
                f"got {config.control_hz:g}"
            )
        return round(repeats)

    def fit(self, config: EnvConfig) -> EnvConfig:
        """Return a world with the sensors that the model was trained with, where it uses them."""
        changes: dict[str, Any] = {}
        if "scan" in self.encoding.keys:
            own = self.world.lidar
            changes["lidar"] = config.lidar.replace(**{name: getattr(own, name) for name in SCANNER})
        changes |= {group: getattr(self.world, group) for key in self.encoding.keys for group in WINDOWS.get(key, ())}
        return config.replace(**changes)

    def differences(self, config: EnvConfig) -> list[str]:
        """Say how a world differs from the one of the training, and how the difference is handled."""
        own, found = self.world, []
        if own.robot != config.robot:
            found.append(
                f"trained with the robot {own.robot.name} and drives {config.robot.name}, its actions as shares of "
                "that robot's limits"
            )
        fitted = self.fit(config)
        if fitted.lidar != config.lidar:
            here = f"{config.lidar.beams} to {config.lidar.range_max:g} m"
            found.append(f"sees with its own {own.lidar.beams} beams to {own.lidar.range_max:g} m instead of {here}")
        windows = [key for key in WINDOWS if key in self.encoding.keys]
        found += [f"sees its own window of {key}" for key in windows if _differ(fitted, config, WINDOWS[key])]
        if own.noise != config.noise:
            found.append("trained with other noise")
        if own.delay != config.delay:
            found.append(f"trained with commands that are {own.delay:g} s late, here it is {config.delay:g} s")
        found += self._other_values(config)
        for name in ("xy_goal_tolerance", "yaw_goal_tolerance"):
            if getattr(own, name) > getattr(config, name):
                found.append(f"trained with {name} {getattr(own, name):g}, here it is {getattr(config, name):g}")
        return found

    def _other_values(self, config: EnvConfig) -> list[str]:
        """Say which options of a world that the model does not bring along differ from those of the training."""
        pairs: dict[str, tuple[Any, Any]] = {"plant": (self.world.plant, config.plant)}
        if "scan" in self.encoding.keys:
            lidars = self.world.lidar, config.lidar
            pairs["lidar.no_reading"] = lidars[0].no_reading, lidars[1].no_reading
            pairs["lidar.scan_rate"] = lidars[0].scan_rate, lidars[1].scan_rate
        return [f"trained with {name} {own}, here it is {here}" for name, (own, here) in pairs.items() if own != here]


def _differ(one: EnvConfig, other: EnvConfig, groups: tuple[str, ...]) -> bool:
    return any(getattr(one, group) != getattr(other, group) for group in groups)


def write_card(model: Path | BinaryIO, card: ModelCard) -> None:
    """Add a card to a model file that has none yet."""
    with zipfile.ZipFile(model, "a", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(CARD, json.dumps(card.model_dump(mode="json"), indent=1))


def read_card(path: str | Path) -> ModelCard | None:
    """Read the card of a model file; None if it has none. Nothing of the file is run.

    Raises:
        ConfigError: If the file is no zip or a suspicious one, or its card is damaged or of another version.
    """
    with open_zip(path, MAX_MODEL_BYTES, ConfigError) as archive:
        if CARD not in archive.namelist():
            return None
        if (size := archive.getinfo(CARD).file_size) > MAX_CARD_BYTES:
            raise ConfigError(f"{path}: {CARD}: expected at most {MAX_CARD_BYTES} bytes, got {size}")
        text = archive.read(CARD).decode("utf-8")
    return ModelCard.from_mapping(parse_json(text, f"{path}: {CARD}", ConfigError), f"{path}: {CARD}")
