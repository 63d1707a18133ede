"""The input of a network at one step: the env's observation as one egocentric vector, every entry within [-1, 1].

The same code encodes in training and in driving, on batches: every array has the worlds as its first axis.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Annotated, Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, field_validator, model_validator

from controllers.learned.kernels import free_arcs
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.errors import ConfigError, refuse_unknown
from gym_mapbench.quantities import Count, NonNegative, Positive
from gym_mapbench.settings import Settings

Features = NDArray[np.float32]

BRISK = 2.0
"""Speed of a person that is encoded as 1, m/s."""
SURE = 1e-6
"""Share of the scanner's range that a reading must be below it, to be one."""


class EncodingSettings(Settings):
    """How observations become the input of a network.

    Args:
        features: The parts of the vector, in this order: of ``velocity goal scan arcs path costmap people``, all
            of it in the robot's own frame. ``arcs`` is what the scan means for driving: how far the robot could drive
            along arcs, forwards and backwards, until it touches something, with each of the ``margins`` around it.
        frames: How many observations it sees at once, the newest first.
        frame_spacing: Decisions between two of them.
        trail: How many decisions ago the places are that it remembers: where the robot was then, in its present frame,
            as the goal shows it.
        reach: Distance at which the distance to the goal, and the coordinates of path points, are clipped, m.
        near: Distance that is encoded as -1 in scans, m; shorter ones, too. Scans are encoded by their logarithm, so
            that a centimetre counts more the nearer a wall is.
        curvatures: Of the arcs to either side, 1/m; 0 is straight ahead.
        margins: Room around the robot, m.
        arc_reach: Longest arc, m.
    """

    features: tuple[str, ...] = ("goal", "velocity", "scan")
    frames: Annotated[Count, Field(le=100)] = 1
    frame_spacing: Annotated[Count, Field(le=1000)] = 1
    trail: tuple[Annotated[Count, Field(le=1000)], ...] = ()
    reach: Positive = 10.0
    near: Positive = 0.2
    curvatures: tuple[NonNegative, ...] = (0.0, 0.3, 0.7, 1.2, 2.0, 3.5, 7.0)
    margins: tuple[NonNegative, ...] = (0.02, 0.12)
    arc_reach: Positive = 3.0

    @property
    def keys(self) -> tuple[str, ...]:
        """Keys of the observation that the features are made of, each once."""
        return tuple(dict.fromkeys(source_of(name) for name in self.features))

    @property
    def arcs(self) -> NDArray[np.float64]:
        """Curvatures of all arcs, from the right to the left, 1/m."""
        return np.array(sorted({sign * value for value in self.curvatures for sign in (-1.0, 1.0)}))

    @field_validator("features")
    @classmethod
    def _known(cls, value: tuple[str, ...]) -> tuple[str, ...]:
        for name in value:
            refuse_unknown("feature", name, FEATURES)
        if not value or len(set(value)) < len(value):
            raise ConfigError(f"expected at least one feature, each once, got {value}")
        return value

    @model_validator(mode="after")
    def _sees_where_it_was(self) -> Self:
        if self.trail and "goal" not in self.features:
            raise ConfigError(f"trail: expected goal among the features, by which it is measured, got {self.features}")
        return self


class Encoder:
    """Encodes batches of observations of one kind of world.

    Args:
        settings: Keys and scales.
        config: The world: its robot, its lidar, its windows of path and costmap.
    """

    def __init__(self, settings: EncodingSettings, config: EnvConfig) -> None:
        self.settings = settings
        self.config = config

    @property
    def size(self) -> int:
        """Entries of one frame."""
        return sum(FEATURES[name].size(self) for name in self.settings.features)

    def encode(self, observation: Mapping[str, NDArray[Any]]) -> Features:
        """Return ``(worlds, size)`` float32 within [-1, 1] of the observations of several worlds."""
        parts = [FEATURES[name].encode(self, observation[source_of(name)]) for name in self.settings.features]
        features: Features = np.concatenate(parts, axis=1, dtype=np.float32)
        np.clip(features, -1.0, 1.0, out=features)
        return features


def _encode_velocity(encoder: Encoder, velocity: NDArray[Any]) -> NDArray[Any]:
    """Shares of the robot's limits."""
    robot = encoder.config.robot
    forwards = velocity[:, 0] / np.where(velocity[:, 0] > 0, robot.max_linear_velocity, robot.max_reverse_velocity or 1)
    return np.stack([forwards, velocity[:, 1] / robot.max_angular_velocity], axis=1)


def _encode_goal(encoder: Encoder, goal: NDArray[Any]) -> NDArray[Any]:
    """Bearing and heading as cosine and sine, distance in the whole, and near the goal."""
    x, y, yaw = goal.T.astype(np.float64)
    distance = np.hypot(x, y)
    bearing = np.arctan2(y, x)
    far, near = 2.0 * distance / encoder.settings.reach - 1.0, 1.0 - 2.0 * np.exp(-2.0 * distance)
    return np.stack([np.cos(bearing), np.sin(bearing), far, near, np.cos(yaw), np.sin(yaw)], axis=1)


def _encode_scan(encoder: Encoder, scan: NDArray[Any]) -> NDArray[Any]:
    """Logarithm of the distance, from ``near`` at -1 to the scanner's range at 1."""
    near = encoder.settings.near
    whole = math.log(encoder.config.lidar.range_max / near)
    return np.asarray(2.0 / whole * np.log(np.maximum(scan, near) / near) - 1.0)


def _encode_arcs(encoder: Encoder, scan: NDArray[Any]) -> NDArray[Any]:
    """Free lengths, from 0 m at -1 to ``arc_reach`` at 1; squares roots, as the next centimetres count most."""
    settings, config = encoder.settings, encoder.config
    lidar, curvatures = config.mounted_lidar, settings.arcs
    place = lidar.place
    angles = lidar.angles + place.yaw
    beams = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    radii = config.robot.circumscribed_radius + np.array(settings.margins)
    free = np.empty((len(scan), len(radii), 2, len(curvatures)))
    seen = lidar.range_max * (1.0 - SURE)
    free_arcs(scan, beams, place.x, place.y, seen, radii, curvatures, settings.arc_reach, free)
    return 2.0 * np.sqrt(np.maximum(free, 0.0) / settings.arc_reach).reshape(len(scan), -1) - 1.0


def _encode_path(encoder: Encoder, path: NDArray[Any]) -> NDArray[Any]:
    """Coordinates as shares of the length of the window."""
    window = encoder.config.path
    return path / min(encoder.settings.reach, window.points * window.spacing)


def _encode_costmap(_encoder: Encoder, costmap: NDArray[Any]) -> NDArray[Any]:
    return costmap.reshape(len(costmap), -1) / 127.5 - 1.0


def _encode_people(encoder: Encoder, people: NDArray[Any]) -> NDArray[Any]:
    """Of every person: bearing as cosine and sine, nearness (1 at contact), velocity, and 1; zeros without a person."""
    x, y, *velocity, radius, there = np.moveaxis(people.reshape(len(people), -1, 6), 2, 0)
    distance = np.hypot(x, y)
    gap = np.maximum(distance - radius - encoder.config.robot.circumscribed_radius, 0.0)
    bearing = np.stack([x, y]) / np.maximum(distance, SURE)
    entries = there * np.stack([*bearing, np.exp(-gap), velocity[0] / BRISK, velocity[1] / BRISK, there])
    return np.asarray(np.moveaxis(entries, 0, 2).reshape(len(people), -1))


class Feature(NamedTuple):
    """A part of the input.

    Args:
        encode: Returns it, ``(worlds, size)``, for the observations of several worlds under its key.
        size: Returns the number of its entries.
        source: The key of the observation that it is made of, if that has another name.
    """

    encode: Callable[[Encoder, NDArray[Any]], NDArray[Any]]
    size: Callable[[Encoder], int]
    source: str = ""


FEATURES = {
    "velocity": Feature(_encode_velocity, lambda _: 2),
    "goal": Feature(_encode_goal, lambda _: 6),
    "scan": Feature(_encode_scan, lambda encoder: encoder.config.lidar.beams),
    "arcs": Feature(_encode_arcs, lambda one: 2 * len(one.settings.arcs) * len(one.settings.margins), source="scan"),
    "path": Feature(_encode_path, lambda encoder: 2 * encoder.config.path.points),
    "costmap": Feature(_encode_costmap, lambda encoder: encoder.config.costmap.cells**2),
    "people": Feature(_encode_people, lambda encoder: 6 * encoder.config.people.nearest),
}


def source_of(feature: str) -> str:
    """Return the key of the observation that a feature is made of."""
    return FEATURES[feature].source or feature
