"""Worlds stepped together with encoded observations: after an end, an episode begins on the next level."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from numpy.typing import NDArray

import gym_mapbench  # noqa: F401, registers MapBench-v0
from controllers.learned import EncodingSettings, Features, Sight
from evolution.training.settings import ShapingSettings
from evolution.training.shaping import Shaping
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.world.scenario import Scenario

UNSHAPED = ShapingSettings()


@dataclass(frozen=True)
class Step:
    """The result of one step of all worlds.

    Args:
        features: ``(worlds, inputs)`` the networks' input at the end of the step, before any new episode.
        rewards: ``(worlds,)``.
        ended: ``(worlds,)`` whether an episode has ended.
        truncated: ``(worlds,)`` whether it has ended by its time limit only.
        outcomes: By the number of the world, the map and the outcome of every episode that has ended; ``stalled`` where
            the shaping has ended it.
    """

    features: Features
    rewards: NDArray[np.float64]
    ended: NDArray[np.bool_]
    truncated: NDArray[np.bool_]
    outcomes: dict[int, tuple[Scenario, str]]


class EncodedWorlds:
    """Worlds over Gymnasium's vector API, their observations encoded and stacked.

    Args:
        count: Number of worlds.
        world: Options of the worlds.
        encoding: How observations become the networks' input.
        next_level: Called for the map of every new episode.
        seed: Root of the worlds' own randomness, such as noise.
        shaping: Reward shaping and early ends.
    """

    def __init__(
        self,
        count: int,
        world: EnvConfig,
        encoding: EncodingSettings,
        next_level: Callable[[], Scenario],
        seed: int,
        shaping: ShapingSettings = UNSHAPED,
    ) -> None:
        self.count = count
        self.worlds: VectorEnv[Any, Any, Any] = gymnasium.make_vec(
            "MapBench-v0",
            num_envs=count,
            vectorization_mode="vector_entry_point",
            config=world,
            autoreset_mode=AutoresetMode.DISABLED,
        )
        self._sight = Sight(count, encoding, world)
        self._shaping = Shaping(shaping, world, count)
        self._stall = shaping.stall if shaping.stall_time else 0.0
        self._next_level = next_level
        self._seed: int | None = seed
        self._levels: list[Scenario] = []

    @property
    def inputs(self) -> int:
        """Entries of the networks' input."""
        return self._sight.size

    def reset(self) -> Features:
        """Begin an episode in every world; the first time, the worlds are seeded."""
        self._levels = [self._next_level() for _ in range(self.count)]
        if self._seed is not None:
            self.worlds.reset(seed=self._seed, options={"scenario": self._levels[0]})
            self._seed = None
        return self._begin(np.ones(self.count, dtype=np.bool_))

    def step(self, actions: NDArray[Any]) -> Step:
        """Drive all worlds for one decision."""
        observation, rewards, terminated, truncated, info = self.worlds.step(np.clip(actions, -1.0, 1.0))
        stalled = self._shaping.stalled(info["reward_terms"]["progress"]) & ~terminated & ~truncated
        rewards = rewards - self._shaping.taken_off(observation) - self._stall * stalled
        ended = terminated | truncated | stalled
        features = self._sight.push(observation)
        how = np.where(stalled, "stalled", info["outcome"])
        outcomes = {int(i): (self._levels[i], str(how[i])) for i in np.flatnonzero(ended)}
        return Step(features, rewards, ended, truncated & ~terminated, outcomes)

    def begin_again(self, ended: NDArray[np.bool_]) -> Features:
        """Begin new episodes where some have ended; return the input of all worlds."""
        for number in np.flatnonzero(ended):
            self._levels[number] = self._next_level()
        return self._begin(ended)

    def close(self) -> None:
        """Close all worlds."""
        self.worlds.close()

    def _begin(self, which: NDArray[np.bool_]) -> Features:
        """Put some worlds on their levels, each on its own."""
        observation, _ = self.worlds.reset(options={"reset_mask": which.copy(), "scenarios": self._levels})
        self._shaping.begin(which)
        return self._sight.begin(observation, which)
