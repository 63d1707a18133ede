"""Ranges, and draws from them; both ends belong to a range."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from pydantic import AfterValidator, Field

from gym_mapbench.errors import ConfigError


def _ordered(value: tuple[Any, Any]) -> tuple[Any, Any]:
    """Refuse a range whose ends are the wrong way round."""
    if value[0] > value[1]:
        raise ConfigError(f"expected (smallest, largest), got {value}")
    return value


Length = Annotated[float, Field(gt=0, le=1000)]
"""m."""
Weight = Annotated[float, Field(gt=0, le=1000)]
Share = Annotated[float, Field(ge=0, le=1)]
SignedShare = Annotated[float, Field(ge=-1, le=1)]
Count = Annotated[int, Field(ge=1, le=1000)]
Seed = Annotated[int, Field(ge=0, lt=2**32)]
"""Seed of everything that is drawn while a map is built."""

LengthRange = Annotated[tuple[Length, Length], AfterValidator(_ordered)]
WeightRange = Annotated[tuple[Weight, Weight], AfterValidator(_ordered)]
SignedShareRange = Annotated[tuple[SignedShare, SignedShare], AfterValidator(_ordered)]
ShareRange = Annotated[tuple[Share, Share], AfterValidator(_ordered)]
CountRange = Annotated[tuple[Count, Count], AfterValidator(_ordered)]
Cells = Annotated[int, Field(ge=1, le=2000)]
Number = Annotated[int, Field(ge=0, le=100_000)]
CellRange = Annotated[tuple[Cells, Cells], AfterValidator(_ordered)]
NumberRange = Annotated[tuple[Number, Number], AfterValidator(_ordered)]


def draw(rng: np.random.Generator, bounds: tuple[float, float]) -> float:
    """Draw a number uniformly."""
    return float(rng.uniform(*bounds))


def draw_count(rng: np.random.Generator, bounds: tuple[int, int]) -> int:
    """Draw an integer uniformly."""
    return int(rng.integers(bounds[0], bounds[1], endpoint=True))


def draw_flag(rng: np.random.Generator) -> bool:
    """Toss a coin."""
    return bool(rng.integers(2))


def draw_seed(rng: np.random.Generator) -> int:
    """Draw the seed of a generator."""
    return int(rng.integers(2**32))
