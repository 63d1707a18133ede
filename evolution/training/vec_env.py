"""Stable-Baselines3's side: the worlds as its VecEnv, and its models. The one module that imports it."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium.spaces import Box
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv

from controllers.learned import Features
from evolution.training.levels import Levels
from evolution.training.settings import TrainSettings
from evolution.training.worlds import EncodedWorlds, Step

LATEST = 1000
"""Episodes that the shown success is of."""


def share_done(settings: TrainSettings, steps: int) -> float:
    """Return the share of a training that is done after some steps, 0 to 1."""
    return min(1.0, steps / settings.steps)


class TrainingWorlds(VecEnv):
    """Worlds on levels, as Stable-Baselines3 trains on them.

    Args:
        settings: Which worlds, how many.
        levels: Give every episode its map.
        done: Steps that are done already, where a training is continued.

    Attributes:
        progress: Share of the training that is done; the trainer sets it before every rollout.
        successes: Whether each of the latest episodes reached the goal.
        episodes: Number of finished episodes.
    """

    def __init__(self, settings: TrainSettings, levels: Levels, done: int = 0) -> None:
        self.progress = share_done(settings, done)
        self.successes: deque[bool] = deque(maxlen=LATEST)
        self._levels = levels
        self._worlds = EncodedWorlds(
            settings.envs,
            settings.world,
            settings.encoding,
            lambda: levels.next(self.progress),
            settings.seed_after(done),
            settings.shaping,
        )
        self._returns = np.zeros(settings.envs)
        self._lengths = np.zeros(settings.envs, dtype=int)
        inputs = Box(-1.0, 1.0, (self._worlds.inputs,), np.float32)
        super().__init__(settings.envs, inputs, Box(-1.0, 1.0, (2,), np.float32))

    def reset(self) -> Features:
        """Begin an episode in every world."""
        self._returns[:], self._lengths[:] = 0.0, 0
        return self._worlds.reset()

    def step_async(self, actions: NDArray[Any]) -> None:
        """Take the actions of the next step."""
        self._actions = actions

    def step_wait(self) -> tuple[Features, NDArray[np.float32], NDArray[np.bool_], list[dict[str, Any]]]:
        """Step all worlds by one decision; ended episodes are followed by new ones."""
        step = self._worlds.step(self._actions)
        self._returns += step.rewards
        self._lengths += 1
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        features = step.features
        if step.outcomes:
            self._note(step, infos)
            features = self._worlds.begin_again(step.ended)
        return features, step.rewards.astype(np.float32), step.ended, infos

    def _note(self, step: Step, infos: list[dict[str, Any]]) -> None:
        """Tell the levels, and Stable-Baselines3, how episodes have ended."""
        for number, (scenario, outcome) in step.outcomes.items():
            self._levels.ended(scenario, outcome == "goal")
            self.successes.append(outcome == "goal")
            infos[number] = {
                "terminal_observation": step.features[number],
                "TimeLimit.truncated": bool(step.truncated[number]),
                "episode": {"r": float(self._returns[number]), "l": int(self._lengths[number]), "t": 0.0},
                "is_success": outcome == "goal",
            }
        self._returns[step.ended], self._lengths[step.ended] = 0.0, 0

    def close(self) -> None:
        """Close all worlds."""
        self._worlds.close()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """Return an attribute of this object, once for every chosen world; the worlds are not objects of their own."""
        return [getattr(self, attr_name, None)] * len(self._chosen(indices))

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Set an attribute of this object."""
        setattr(self, attr_name, value)

    def env_method(self, method_name: str, *args: Any, indices: Any = None, **options: Any) -> list[Any]:
        """Refuse: the worlds are not objects of their own."""
        raise NotImplementedError(f"{method_name}: worlds that are stepped together have no methods of their own")

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
        """Return False for every chosen world."""
        return [False] * len(self._chosen(indices))

    def _chosen(self, indices: Any) -> Sequence[int]:
        return list(self._get_indices(indices))
