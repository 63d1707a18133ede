"""The base class of patterns: the part of a fitness that says which maps belong together in a good set."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from evolution.search.judging.patterns.pools import Found, Pool
from gym_mapbench.errors import ConfigError
from gym_mapbench.quantities import NonNegative
from gym_mapbench.settings import Settings

Times = Sequence[float]
"""One value per controller on one map."""

SHORTEST = 1e-9

FORMER_NAMES = {"read": "score"}
"""Former names of methods of :class:`Pattern`; a subclass may still define them."""


def check_maps(maps_per_set: int, fitness: str, fewest: int = 2) -> None:
    """Refuse sets with too few maps for a fitness.

    Raises:
        ConfigError: With the number that is needed.
    """
    if maps_per_set < fewest:
        raise ConfigError(f"maps_per_set: expected {fewest} or more with {fitness}, got {maps_per_set}")


def log_times(times: Times) -> NDArray[np.float64]:
    """Return the logarithms of some values; values below 1e-9 count as 1e-9, because zero has no logarithm."""
    return np.array([math.log(max(time, SHORTEST)) for time in times])


class PatternSettings(Settings):
    """The options that patterns read.

    Args:
        epsilon: Smallest difference between two Gini coefficients (Alg. 2).
        unevenness_weight: lambda of Alg. 2.
    """

    epsilon: NonNegative = 1e-8
    unevenness_weight: NonNegative = 1.0


@dataclass(frozen=True)
class Parts:
    """The parts of the fitness of a map set.

    Args:
        penalty: Cost of failed runs and timeouts, 0 or more: the first two terms of Eq. 4.5.
        gain: Weighted pattern of the set, the last term of Eq. 4.5.
        success_rate: Successful runs / all runs.
        timeouts: Timed-out runs per repeat.
        pattern: Value of the pattern; greater is better.
    """

    penalty: float
    gain: float
    success_rate: float
    timeouts: float
    pattern: float


class Pattern:
    """Scores every map of a set, and says how good the scores are together.

    Subclass it, and register the subclass in :data:`~evolution.search.judging.FITNESSES`, or name it
    ``module:attribute``. The class attributes are all that tables, pictures and pages need.

    Attributes:
        wanted: What is rewarded, in words that continue "maps whose ...".
        nothing: What :meth:`judge` returns where there is no pattern.
        needs_scale: Whether maps cannot be scored without a scale, which is calibrated on the first population.
        exact: Whether :meth:`best_of` is implemented, for the fitness of Eq. 4.5.
        solved_only: Whether a failed run must not count as a time.
        less_is_better: Whether a controller with a smaller value is taken for the better one.
        ordered: Whether a set is meant to keep the ranks of its maps' scores on other seeds.
        objectives: Names of the values that :meth:`objectives_of` returns; the first is the fitness in every table.
        constraints: Names of the values that :meth:`constraints_of` returns.

    Args:
        settings: Options of patterns; those of a search are all options of its section ``judging``.
        scale: The scale, in units of the metric; None until it is known, or if none is needed.
    """

    wanted: ClassVar[str] = "scores this fitness rewards"
    nothing: ClassVar[float] = 0.0
    needs_scale: ClassVar[bool] = False
    exact: ClassVar[bool] = False
    solved_only: ClassVar[bool] = False
    less_is_better: ClassVar[bool] = False
    ordered: ClassVar[bool] = True
    objectives: ClassVar[tuple[str, ...]] = ("fitness",)
    constraints: ClassVar[tuple[str, ...]] = ()

    def __init_subclass__(cls, **options: Any) -> None:
        """Accept the former names of methods."""
        super().__init_subclass__(**options)
        for former, name in FORMER_NAMES.items():
            if former in vars(cls):
                setattr(cls, name, vars(cls)[former])

    def __init__(self, settings: PatternSettings, scale: float | None = None) -> None:
        self.settings = settings
        self.scale = scale

    @classmethod
    def check(cls, maps_per_set: int, controllers: int) -> None:
        """Refuse a search in which the pattern means nothing; the base class accepts every search.

        Args:
            maps_per_set: Maps in a set.
            controllers: Number of compared controllers.

        Raises:
            ConfigError: Naming the option, the expected value, and the given one.
        """

    def score(self, times: Times) -> float:
        """Return the score of one map.

        Args:
            times: One value of the search's metric per controller, in their order.
        """
        raise NotImplementedError(f"{type(self).__name__} has no method score")

    def judge(self, scores: Sequence[float], maps: Sequence[Times]) -> float:
        """Return how good a set is; greater is better.

        Args:
            scores: Scores of the maps that have a value; there may be none.
            maps: The values that :meth:`score` got for the same maps, for a pattern that compares them across maps.
        """
        raise NotImplementedError(f"{type(self).__name__} has no method judge")

    def objectives_of(self, parts: Parts) -> tuple[float, ...]:
        """Return the objectives of a set, smaller is better; by default its fitness (Eq. 4.5) alone."""
        return (parts.penalty - parts.gain,)

    def constraints_of(self, parts: Parts) -> tuple[float, ...]:
        """Return the constraints of a set; a value above 0 is violated. By default there are none."""
        return ()

    def bound(self, widest: float) -> float:
        """Return a value that :meth:`judge` never exceeds.

        Args:
            widest: Difference between the largest and the smallest score of all maps.
        """
        return float("inf")

    def best_of(self, pools: Sequence[Pool]) -> Found:
        """Return the best pattern that one map from each of these pools can show, and the maps that show it."""
        raise NotImplementedError
