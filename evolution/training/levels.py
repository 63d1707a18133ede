"""The map of an episode: a new random map, a given map, or a replayed level."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from evolution.training.settings import ReplaySettings, TrainSettings
from gym_mapbench.env.random_task import draw_task
from gym_mapbench.env.scenario_source import draw_scenario, is_planned
from gym_mapbench.generator import with_people
from gym_mapbench.world.scenario import Scenario

POOL = 3000
"""Random maps that are kept for further episodes."""
FIRST_MAPS = 200
"""Random maps that are sampled before a map is reused."""
EVERY_FIFTH = 5
"""Of five given maps, one is held out."""


def split(scenarios: Sequence[Scenario]) -> tuple[list[Scenario], list[Scenario]]:
    """Return the maps to train on and those held out, every fifth; of fewer than five, all are used for both.

    A scenario that is given twice counts once, so that none is on both sides.
    """
    different = _different(scenarios)
    if len(different) < EVERY_FIFTH:
        return different, different
    held_out = different[EVERY_FIFTH - 1 :: EVERY_FIFTH]
    kept = [one for number, one in enumerate(different) if number % EVERY_FIFTH != EVERY_FIFTH - 1]
    return kept, held_out


def is_split(scenarios: Sequence[Scenario]) -> bool:
    """Whether some of these maps are held out."""
    return len(_different(scenarios)) >= EVERY_FIFTH


def _different(scenarios: Sequence[Scenario]) -> list[Scenario]:
    """Return the scenarios without repetitions of map, bodies and task, in order."""
    return list({one.digest: one for one in scenarios}.values())


class Levels(Protocol):
    """Gives every episode its map."""

    def next(self, progress: float) -> Scenario:
        """Return the map of a new episode; ``progress`` is the share of the training that is done."""
        ...

    def ended(self, scenario: Scenario, success: bool) -> None:
        """Learn how an episode ended."""
        ...


class GivenLevels:
    """Given maps, all equally often.

    Args:
        scenarios: One or more.
        rng: Source of all randomness.
    """

    def __init__(self, scenarios: Sequence[Scenario], rng: np.random.Generator) -> None:
        self._scenarios = tuple(scenarios)
        self._rng = rng

    def next(self, progress: float) -> Scenario:
        """Return one of the maps."""
        return self._scenarios[int(self._rng.integers(len(self._scenarios)))]

    def ended(self, scenario: Scenario, success: bool) -> None:
        """Learn nothing."""


class RandomLevels:
    """Random maps with a number of obstacles that changes as the training goes on.

    Sampling a map costs as much as dozens of steps, so each map is used for several episodes.

    Args:
        settings: World, obstacles, people and reuse of the maps; a map has 0 to ``people.count`` people.
        rng: Source of all randomness.
    """

    def __init__(self, settings: TrainSettings, rng: np.random.Generator) -> None:
        self._settings = settings
        self._rng = rng
        self._pool: deque[Scenario] = deque(maxlen=POOL)

    def obstacles(self, progress: float) -> tuple[int, int]:
        """Return the fewest and most obstacles at a share of the training."""
        after, fewest, most = zip(*((one.after, one.fewest, one.most) for one in self._settings.obstacles), strict=True)
        return round(float(np.interp(progress, after, fewest))), round(float(np.interp(progress, after, most)))

    def next(self, progress: float) -> Scenario:
        """Return a new map, or a recently sampled one."""
        if len(self._pool) < FIRST_MAPS or self._rng.random() * self._settings.reuse < 1.0:
            self._pool.append(self._populate(self._draw(progress)))
            return self._pool[-1]
        return self._pool[int(self._rng.integers(len(self._pool)))]

    def ended(self, scenario: Scenario, success: bool) -> None:
        """Learn nothing."""

    def _draw(self, progress: float) -> Scenario:
        world = self._settings.world
        shapes = world.shapes.replace(n_obstacles=self.obstacles(progress))
        scenario = draw_scenario(world.replace(shapes=shapes), self._rng)
        if self._rng.random() >= self._settings.anywhere:
            return scenario
        elsewhere = draw_task(scenario.map, world.robot, self._rng)
        return scenario if elsewhere is None or not is_planned(world, elsewhere) else elsewhere

    def _populate(self, scenario: Scenario) -> Scenario:
        """Add people to a map, where the settings have people."""
        people = self._settings.people
        wanted = int(self._rng.integers(people.count, endpoint=True)) if people.count else 0
        return with_people(scenario, people.replace(count=wanted), self._rng) if wanted else scenario


class ReplayedLevels:
    """Prioritized level replay, among new random maps.

    The score of a level is its learnability, the variance p (1 - p) of its success (Rutherford et al., No Regrets,
    2024). Levels are sampled by the rank of their score and by staleness (Jiang et al., Prioritized Level Replay,
    2021). A random map joins the levels after its first episode.

    Args:
        settings: How often, and which.
        fresh: Gives the new maps.
        levels: The levels to begin with; they are never given up.
        rng: Source of all randomness.
    """

    def __init__(
        self, settings: ReplaySettings, fresh: Levels, levels: Sequence[Scenario], rng: np.random.Generator
    ) -> None:
        self._settings = settings
        self._fresh = fresh
        self._rng = rng
        self._levels = list(levels)
        self._given = len(self._levels)
        self._capacity = max(settings.capacity, self._given)
        self._outcomes: list[deque[bool]] = [self._nothing() for _ in self._levels]
        self._played = [0] * len(self._levels)
        self._index = {level.digest: number for number, level in enumerate(self._levels)}
        self._episodes = 0

    def next(self, progress: float) -> Scenario:
        """Return a kept level or a new map."""
        replays = self._levels and self._rng.random() < self._settings.probability
        number = int(self._rng.choice(len(self._levels), p=self.probabilities())) if replays else None
        self._episodes += 1
        if number is None:
            return self._fresh.next(progress)
        self._played[number] = self._episodes
        return self._levels[number]

    def ended(self, scenario: Scenario, success: bool) -> None:
        """Record the outcome of an episode; a new map replaces the level with the lowest score."""
        number = self._index.get(scenario.digest)
        if number is None:
            number = self._room_for(scenario)
        if number is not None:
            self._outcomes[number].append(success)

    def scores(self) -> NDArray[np.float64]:
        """Return the learnability of every level, 0 to 1/4, with one success and one failure added to its outcomes."""
        counts = np.array([(sum(outcomes), len(outcomes)) for outcomes in self._outcomes], dtype=np.float64)
        success = (counts[:, 0] + 1.0) / (counts[:, 1] + 2.0)
        return np.asarray(success * (1.0 - success))

    def probabilities(self) -> NDArray[np.float64]:
        """Return the probability of every kept level to be replayed next."""
        ranks = np.empty(len(self._levels))
        ranks[np.argsort(-self.scores(), kind="stable")] = np.arange(1, len(self._levels) + 1)
        by_score = (1.0 / ranks) ** (1.0 / self._settings.temperature)
        stale = self._episodes - np.array(self._played, dtype=np.float64)
        share = self._settings.staleness
        by_age = stale / stale.sum() if stale.sum() > 0 else np.full(len(stale), 1.0 / len(stale))
        return np.asarray((1.0 - share) * by_score / by_score.sum() + share * by_age)

    def _nothing(self) -> deque[bool]:
        return deque(maxlen=self._settings.memory)

    def _room_for(self, scenario: Scenario) -> int | None:
        """Return the place of a new map; None if there is no room."""
        if len(self._levels) < self._capacity:
            self._levels.append(scenario)
            self._outcomes.append(self._nothing())
            self._played.append(self._episodes)
            number = len(self._levels) - 1
        else:
            kept = self.scores()[self._given :]
            if not len(kept):
                return None
            number = self._given + int(np.argmin(kept))
            del self._index[self._levels[number].digest]
            self._levels[number], self._outcomes[number] = scenario, self._nothing()
            self._played[number] = self._episodes
        self._index[scenario.digest] = number
        return number
