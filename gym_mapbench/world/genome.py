"""Genome: the genes that a map was built from, as plain data; :mod:`gym_mapbench.generator` reads it."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, JsonValue

from gym_mapbench.settings import Settings


class Genome(Settings):
    """The genes of a map, JSON-able. It is no part of a map's identity: the occupied cells alone are.

    Args:
        family: Name of the family.
        options: Options of the family that differ from its own.
        genes: The genes, as the family writes them.
    """

    family: Annotated[str, Field(min_length=1)]
    options: dict[str, JsonValue] = Field(default_factory=dict)
    genes: dict[str, JsonValue]
