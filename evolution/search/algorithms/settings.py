"""The options of the algorithm and its operators."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, field_validator

from evolution.search.algorithms.registry import ALGORITHMS, Algorithm
from evolution.search.operators import MutationSettings
from gym_mapbench.quantities import Fraction
from gym_mapbench.settings import Settings


class GaSettings(Settings):
    """The algorithm of a search, and how it makes new map sets.

    Args:
        algorithm: ``ga``, the baseline ``random``, which samples every generation, ``nsga2`` for several objectives, or
            a third-party algorithm (see :mod:`evolution.search.algorithms`).
        pop_size: Individuals in the population, and offspring per generation.
        crossover: ``pool`` (the maps of both parents are distributed at random) or ``position`` (maps at the same
            position are exchanged).
        crossover_probability: Fraction that two parents are crossed (p_c).
        mutation: How obstacles change.
    """

    algorithm: str = "ga"
    pop_size: Annotated[int, Field(ge=2, le=100_000)] = 40
    crossover: Literal["pool", "position"] = "pool"
    crossover_probability: Fraction = 1.0
    mutation: MutationSettings = MutationSettings()

    @field_validator("algorithm")
    @classmethod
    def _known(cls, value: str) -> str:
        ALGORITHMS.get(value)
        return value

    @property
    def kind(self) -> Algorithm:
        """The algorithm."""
        return ALGORITHMS.get(self.algorithm)
