"""What a pattern is: the part of a fitness that says which maps belong together in a good set."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from evolution.search.judging.patterns.pools import Found, Pool
from gym_mapbench.errors import ConfigError

Times = Sequence[float]
"""One value per controller on one map."""

SHORTEST = 1e-9


def log_times(times: Times) -> NDArray[np.float64]:
    """Return the logarithms of some values; those below 1e-9 are taken for that, as zero has no logarithm."""
    return np.log(np.maximum(np.asarray(times, dtype=np.float64), SHORTEST))


class PatternOptions(Protocol):
    """The options of a search that the patterns here look at; all of :class:`EvolveSettings` are there at run time."""

    @property
    def fitness(self) -> str:
        """Name of the pattern."""
        ...

    @property
    def failures(self) -> str:
        """How a failed run counts."""
        ...

    @property
    def maps_per_set(self) -> int:
        """Maps in a set."""
        ...

    @property
    def epsilon(self) -> float:
        """Smallest difference between two Gini coefficients."""
        ...

    @property
    def unevenness_weight(self) -> float:
        """Weight of unevenly spread Gini coefficients."""
        ...


class Pattern:
    """Reads every map of a set, and says how good the readings are together.

    Subclass it, and register the subclass in :data:`~evolution.search.judging.patterns.FITNESSES`, or name it
    ``module:attribute``. The class attributes are all that tables, pictures and pages need.

    Attributes:
        reading_name: What a map's reading is called, beside its value.
        wanted: What is rewarded, in words that continue "maps whose ...".
        nothing: What :meth:`judge` returns where there is no pattern at all.
        needs_scale: Whether maps cannot be read without a scale, which is calibrated on the first population.
        exact: Whether :meth:`best_of` is implemented.
        solved_only: Whether a failed run must not count as a time.
        ordered: Whether a set is meant to keep the order of its maps' readings when it is driven again.

    Args:
        settings: Options of the search.
        scale: The scale, in units of the metric; None until it is known, or if none is needed.
    """

    reading_name: ClassVar[str] = "reading"
    wanted: ClassVar[str] = "readings this fitness rewards"
    nothing: ClassVar[float] = 0.0
    needs_scale: ClassVar[bool] = False
    exact: ClassVar[bool] = False
    solved_only: ClassVar[bool] = False
    ordered: ClassVar[bool] = True

    def __init__(self, settings: PatternOptions, scale: float | None = None) -> None:
        self.settings = settings
        self.scale = scale

    @classmethod
    def check(cls, settings: PatternOptions, controllers: int) -> None:
        """Refuse a search in which the pattern means nothing; by default, any will do.

        Args:
            settings: Options of the search.
            controllers: How many are compared.

        Raises:
            ConfigError: Naming the option, what is expected, and what was given.
        """

    def read(self, times: Times) -> float:
        """Return the reading of one map.

        Args:
            times: One value of the search's metric per controller, in their order.
        """
        raise NotImplementedError

    def judge(self, readings: Sequence[float], maps: Sequence[Times]) -> float:
        """Return how good a set is; greater is better.

        Args:
            readings: Readings of the maps that have a value; there may be none.
            maps: The values that :meth:`read` saw of the same maps, for a pattern that compares them across maps.
        """
        raise NotImplementedError

    def bound(self, widest: float) -> float:
        """Return a value that :meth:`judge` never exceeds.

        Args:
            widest: Difference between the largest and the smallest reading of all maps.
        """
        return float("inf")

    def best_of(self, pools: Sequence[Pool]) -> Found:
        """Return the best pattern that one map from each of these pools can show, and which maps show it."""
        raise ConfigError(f"fitness {self.settings.fitness!r}: how to find its exact best set is not known")
