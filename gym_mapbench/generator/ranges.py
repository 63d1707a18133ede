"""Ranges, and samples from them; both ends belong to a range."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from pydantic import AfterValidator, Field

from gym_mapbench.errors import ConfigError
from gym_mapbench.quantities import Count, Fraction, Natural, Positive, SignedFraction


def ordered_range(value: tuple[Any, Any]) -> tuple[Any, Any]:
    """Refuse a range whose ends are the wrong way round."""
    if value[0] > value[1]:
        raise ConfigError(f"expected (smallest, largest), got {value}")
    return value


Length = Annotated[Positive, Field(le=1000)]
"""m."""
RelativeWeight = Annotated[Positive, Field(le=1000)]
"""Compared with the weights of its neighbours."""
Repeats = Annotated[Count, Field(le=1000)]
"""How many times a motif is repeated."""
Seed = Annotated[Natural, Field(lt=2**32)]
"""Seed of everything that is sampled while a map is built."""

LengthRange = Annotated[tuple[Length, Length], AfterValidator(ordered_range)]
WeightRange = Annotated[tuple[RelativeWeight, RelativeWeight], AfterValidator(ordered_range)]
SignedFractionRange = Annotated[tuple[SignedFraction, SignedFraction], AfterValidator(ordered_range)]
FractionRange = Annotated[tuple[Fraction, Fraction], AfterValidator(ordered_range)]
CountRange = Annotated[tuple[Repeats, Repeats], AfterValidator(ordered_range)]
Cells = Annotated[Count, Field(le=2000)]
Number = Annotated[Natural, Field(le=100_000)]
CellRange = Annotated[tuple[Cells, Cells], AfterValidator(ordered_range)]
NumberRange = Annotated[tuple[Number, Number], AfterValidator(ordered_range)]


def sample(rng: np.random.Generator, bounds: tuple[float, float]) -> float:
    """Sample a number uniformly."""
    return float(rng.uniform(*bounds))


def sample_count(rng: np.random.Generator, bounds: tuple[int, int]) -> int:
    """Sample an integer uniformly."""
    return int(rng.integers(bounds[0], bounds[1], endpoint=True))


def sample_flag(rng: np.random.Generator) -> bool:
    """Sample True or False with equal probability."""
    return bool(rng.integers(2))


def sample_seed(rng: np.random.Generator) -> int:
    """Sample the seed of a generator."""
    return int(rng.integers(2**32))
