"""TrainedPolicy: a model with a card as a controller, with the observations and the rate of its training."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from controllers.base import Context, Observation
from controllers.learned.memory import Sight
from controllers.learned.model_card import ModelCard
from gym_mapbench.env.action import to_command
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.errors import ConfigError

ONE = np.ones(1, dtype=np.bool_)


class TrainedPolicy:
    """A network over encoded observations as a policy over the env's own.

    Args:
        predict: Takes ``(1, input_size)`` float32, and ``deterministic`` by keyword; returns ``(1, 2)`` actions, shares
            of the robot's limits, and a state that is not used.
        name: Name under which the controller is reported.
        card: The card of the model.
    """

    def __init__(self, predict: Callable[..., Any], name: str, card: ModelCard) -> None:
        self.name = name
        self.card = card
        self.observation_keys = card.encoding.keys
        self._predict = predict

    def fit(self, config: EnvConfig) -> EnvConfig:
        """Return a world with the sensors that the network was trained with.

        Raises:
            ConfigError: If the network cannot drive in that world.
        """
        try:
            self.card.repeats_in(config)
        except ConfigError as error:
            raise ConfigError(f"{self.name}: {error}") from None
        return self.card.fit(config)

    def reset(self, context: Context) -> None:
        """Forget all observations."""
        card = self.card
        self._robot = context.robot
        # Not checked as a world: the physics of the training may be too slow for this robot, and this world's is not.
        seen = card.world.model_copy(update={"robot": context.robot, "lidar": context.lidar})
        self._sight = Sight(1, card.encoding, seen)
        self._repeats = round(1.0 / context.control_period / card.world.control_hz)
        self._step = 0

    def act(self, observation: Observation) -> tuple[float, float]:
        """Return the command, a new one as often as the network decided in training.

        Raises:
            ConfigError: If the network's action is not two finite numbers.
        """
        if self._step % self._repeats == 0:
            self._command = self._decide(observation)
        self._step += 1
        return self._command

    def _decide(self, observation: Observation) -> tuple[float, float]:
        batch = {key: np.asarray(observation[key])[np.newaxis] for key in self.observation_keys}
        seen = self._sight.push(batch) if self._step else self._sight.begin(batch, ONE)
        if self.card.normalization is not None:
            seen = self.card.normalization.apply(seen)
        actions, _ = self._predict(seen, deterministic=True)
        try:
            return to_command(np.asarray(actions)[0], self._robot, "normalized")
        except ConfigError as error:
            raise ConfigError(f"{self.name}: {error}") from None
