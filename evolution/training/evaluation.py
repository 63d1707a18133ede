"""Evaluation of a policy: on given maps, without exploration."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.learned import EncodingSettings, Features
from evolution.statistics import wilson_interval
from evolution.training.worlds import EncodedWorlds
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.world.scenario import Scenario

WORLDS = 64
"""Most worlds that are stepped together."""

Act = Callable[[Features], NDArray[Any]]
"""``(worlds, inputs)`` -> ``(worlds, 2)`` actions, shares of the robot's limits."""


@dataclass(frozen=True)
class Judgement:
    """Outcomes of a policy on some maps.

    Args:
        outcomes: Number of episodes by outcome.
        time: Median time of those that reached the goal, s; None if none did.
    """

    outcomes: Mapping[str, int]
    time: float | None

    @property
    def runs(self) -> int:
        """Number of episodes."""
        return sum(self.outcomes.values())

    @property
    def success(self) -> float:
        """Share of episodes that reached the goal."""
        return self.outcomes.get("goal", 0) / self.runs

    @property
    def interval(self) -> tuple[float, float]:
        """Wilson's 95 % interval of the success."""
        return wilson_interval(self.outcomes.get("goal", 0), self.runs)


def judge(
    act: Act, world: EnvConfig, encoding: EncodingSettings, scenarios: Sequence[Scenario], seed: int
) -> Judgement:
    """Evaluate a policy with one episode on every map.

    Args:
        act: The policy, without exploration.
        world: The world, with the time limit that counts.
        encoding: Encoding of the policy's observations.
        scenarios: One or more maps.
        seed: Seed of the world's noise.
    """
    left = list(scenarios)
    worlds = EncodedWorlds(min(WORLDS, len(left)), world, encoding, lambda: left.pop(0) if left else scenarios[0], seed)
    waiting, counts = len(scenarios), Counter[str]()
    busy, clock, times = np.ones(worlds.count, dtype=np.bool_), np.zeros(worlds.count), list[float]()
    features = worlds.reset()
    while waiting:
        step = worlds.step(act(features))
        clock += 1.0 / world.control_hz
        for order, (number, (_, outcome)) in enumerate(step.outcomes.items()):
            if busy[number]:
                waiting -= 1
                counts[outcome] += 1
                times += [clock[number]] if outcome == "goal" else []
            busy[number], clock[number] = order < len(left), 0.0
        features = worlds.begin_again(step.ended) if step.ended.any() else step.features
    worlds.close()
    return Judgement(counts, float(np.median(times)) if times else None)
