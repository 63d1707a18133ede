"""The input of a network in several worlds: encoded observations, the current and earlier ones, and the robot's trail.

The same code remembers in training and in driving, on batches: every array has the worlds as its first axis.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.learned.encoding import Encoder, EncodingSettings, Features
from gym_mapbench.env.config import EnvConfig


class Sight:
    """The input of a network, for several worlds.

    Args:
        worlds: How many.
        settings: The features, and how many earlier observations are kept.
        config: The configuration of the worlds.

    Attributes:
        size: Entries of the input.
    """

    def __init__(self, worlds: int, settings: EncodingSettings, config: EnvConfig) -> None:
        self._encoder = Encoder(settings, config)
        self._frames = Frames(worlds, self._encoder.size, settings)
        self._trail = Trail(worlds, settings) if settings.trail else None
        self.size = self._frames.size + 2 * len(settings.trail)

    def begin(self, observation: Mapping[str, NDArray[Any]], which: NDArray[np.bool_]) -> Features:
        """Begin episodes in some worlds; return the input of all, ``(worlds, size)``, in a new array.

        Args:
            observation: Of all worlds, by key.
            which: ``(worlds,)`` where episodes begin.
        """
        stacked = self._frames.begin(self._encoder.encode(observation), which)
        if self._trail is None:
            return stacked
        return np.concatenate([stacked, self._trail.begin(observation["goal"], which)], axis=1)

    def push(self, observation: Mapping[str, NDArray[Any]]) -> Features:
        """Add an observation of every world; return the input of all, ``(worlds, size)``, in a new array."""
        stacked = self._frames.push(self._encoder.encode(observation))
        if self._trail is None:
            return stacked
        return np.concatenate([stacked, self._trail.push(observation["goal"])], axis=1)


class Frames:
    """The last frames of several worlds; before the first step of an episode, its first frame stands for all.

    Args:
        worlds: How many worlds.
        size: Entries of one frame.
        settings: How many frames, how far apart.

    Attributes:
        size: Entries of a stack.
    """

    def __init__(self, worlds: int, size: int, settings: EncodingSettings) -> None:
        length = (settings.frames - 1) * settings.frame_spacing + 1
        self._history = np.zeros((length, worlds, size), dtype=np.float32)
        self._spacing = settings.frame_spacing
        self.size = settings.frames * size

    def begin(self, features: Features, which: NDArray[np.bool_]) -> Features:
        """Begin episodes in some worlds with a first frame; return the stacks of all."""
        self._history[:, which] = features[which]
        return self.stacked()

    def push(self, features: Features) -> Features:
        """Add one frame to every world; return the stacks."""
        self._history[1:] = self._history[:-1].copy()
        self._history[0] = features
        return self.stacked()

    def stacked(self) -> Features:
        """Return ``(worlds, frames * size)``, the newest frame first, in a new array."""
        chosen = self._history[:: self._spacing]
        return np.concatenate(list(chosen), axis=1)


class Trail:
    """Where robots were, seen from where they are; the goal, which stands still, says how they have moved.

    A place d metres away is encoded by its direction times d / (1 + d): its next metre counts most, and no place lies
    outside the unit circle. Before the first step of an episode, its first place stands for all.

    Args:
        worlds: How many.
        settings: How many decisions ago the places are.
    """

    def __init__(self, worlds: int, settings: EncodingSettings) -> None:
        self._ago = np.array(settings.trail)
        self._places = np.zeros((max(settings.trail) + 1, worlds, 2))
        self._newest = 0

    def begin(self, goal: NDArray[Any], which: NDArray[np.bool_]) -> Features:
        """Begin episodes in some worlds; return the trails of all.

        Args:
            goal: ``(worlds, 3)`` the goal in the robots' frames, m, m, rad.
            which: ``(worlds,)`` where episodes begin.
        """
        self._places[:, which] = _place(goal)[which]
        return self._seen(goal)

    def push(self, goal: NDArray[Any]) -> Features:
        """Add a place of every robot; return ``(worlds, 2 * places)`` of the trails."""
        self._newest = (self._newest + 1) % len(self._places)
        self._places[self._newest] = _place(goal)
        return self._seen(goal)

    def _seen(self, goal: NDArray[Any]) -> Features:
        before = self._places[(self._newest - self._ago) % len(self._places)]
        x, y = _turned(before[..., 0], before[..., 1], goal[:, 2])
        away = np.stack([x + goal[:, 0], y + goal[:, 1]], axis=-1)
        near = away / (1.0 + np.linalg.norm(away, axis=-1, keepdims=True))
        trails: Features = near.swapaxes(0, 1).reshape(len(goal), -1).astype(np.float32)
        return trails


def _place(goal: NDArray[Any]) -> NDArray[np.float64]:
    """Return the robots' places in the frame of the goal, ``(worlds, 2)``."""
    x, y = _turned(goal[:, 0], goal[:, 1], -goal[:, 2])
    return -np.stack([x, y], axis=1)


def _turned(x: NDArray[Any], y: NDArray[Any], angle: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    cosine, sine = np.cos(angle), np.sin(angle)
    return cosine * x - sine * y, sine * x + cosine * y
