"""Reward shaping in training: penalties for proximity and reverse motion, and the end of stalled episodes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from evolution.training.settings import ShapingSettings
from gym_mapbench.env.config import EnvConfig

CLOSER = 0.1
"""Distance by which a robot must come closer to the goal than ever before in its episode not to count as stalled, m."""


class Shaping:
    """Reward shaping of worlds that are stepped together.

    Args:
        settings: Penalties, and the time until an episode counts as stalled.
        world: Options of the worlds.
        count: How many there are.
    """

    def __init__(self, settings: ShapingSettings, world: EnvConfig, count: int) -> None:
        self._settings = settings
        self._world = world
        self._gained = np.zeros(count)
        self._most = np.zeros(count)
        self._waiting = np.zeros(count, dtype=np.int64)

    def begin(self, which: NDArray[np.bool_]) -> None:
        """Forget the last episodes of some worlds."""
        for values in (self._gained, self._most, self._waiting):
            values[which] = 0

    def taken_off(self, observation: Mapping[str, NDArray[Any]]) -> NDArray[np.float64]:
        """Return the penalties of this step for proximity to walls and people, and for reverse motion."""
        settings, seconds = self._settings, 1.0 / self._world.control_hz
        costs = np.zeros(len(self._gained))
        if settings.proximity:
            room = observation["scan"].min(axis=1) - self._world.robot.circumscribed_radius
            costs += settings.proximity * seconds * np.clip(1.0 - room / settings.reach, 0.0, 1.0)
        if settings.people:
            room = self._nearest_person(observation["people"])
            costs += settings.people * seconds * np.clip(1.0 - room / settings.personal_space, 0.0, 1.0)
        if settings.reverse:
            costs += settings.reverse * seconds * np.maximum(-observation["velocity"][:, 0], 0.0)
        return costs

    def _nearest_person(self, people: NDArray[Any]) -> NDArray[np.float64]:
        """Return the distance between the outlines of the robot and the nearest person, m; inf where there is none."""
        x, y, radius, there = np.moveaxis(people.reshape(len(people), -1, 6), 2, 0)[[0, 1, 4, 5]]
        gaps = np.hypot(x, y) - radius - self._world.robot.circumscribed_radius
        return np.asarray(np.where(there > 0, gaps, np.inf).min(axis=1))

    def stalled(self, progress: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return which robots have had no progress to the goal for too long.

        Args:
            progress: ``(count,)`` term of the reward for progress of this step.
        """
        self._gained += progress / (self._world.reward.progress or 1.0)
        closer = self._gained > self._most + CLOSER
        self._most[closer] = self._gained[closer]
        self._waiting = np.where(closer, 0, self._waiting + 1)
        longest = self._settings.stall_time * self._world.control_hz
        return np.asarray(self._waiting >= longest) if longest else np.zeros(len(progress), dtype=np.bool_)
