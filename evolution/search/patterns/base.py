"""What a pattern is: the part of a fitness that says which maps belong together in a good set."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar, Protocol

from evolution.search.patterns.pools import Found, Pool
from gym_mapbench.errors import ConfigError

Times = Sequence[float]
"""One value per controller on one map."""


class PatternOptions(Protocol):
    """The options of a search that the patterns here look at; all of :class:`EvolveSettings` are there at run time."""

    @property
    def fitness(self) -> str:
        """Name of the pattern."""
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

    Subclass it, and register the subclass in :data:`~evolution.search.patterns.FITNESSES`, or name it
    ``module:attribute``. The class attributes are all that tables, pictures and pages need.

    Attributes:
        reading_name: What a map's reading is called, beside its value.
        wanted: What is rewarded, in words that continue "maps whose ...".
        nothing: What :meth:`judge` returns where there is no pattern at all.
        needs_scale: Whether maps cannot be read without a scale, which is calibrated on the first population.
        exact: Whether :meth:`best_of` is implemented.

    Args:
        settings: Options of the search.
        scale: The scale, in units of the metric; None until it is known, or if none is needed.
    """

    reading_name: ClassVar[str] = "reading"
    wanted: ClassVar[str] = "readings this fitness rewards"
    nothing: ClassVar[float] = 0.0
    needs_scale: ClassVar[bool] = False
    exact: ClassVar[bool] = False

    def __init__(self, settings: PatternOptions, scale: float | None = None) -> None:
        self.settings = settings
        self.scale = scale

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
