"""The genes of maps of motifs: a route, and sections of equal motifs on it."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from gym_mapbench.generator.motifs.routes import Route
from gym_mapbench.settings import Settings

Deviations = dict[str, float]
"""Deviation of an element by gene, share of the width of the gene's range."""


class Section(Settings):
    """One motif, repeated.

    Args:
        motif: Name of the motif in a sequence; empty where the family has only one.
        shared: Genes that all elements share, by name.
        elements: Deviations of each element from the shared genes; their number is that of the elements.
    """

    motif: str = ""
    shared: dict[str, float]
    elements: Annotated[tuple[Deviations, ...], Field(min_length=1)]


class MotifGenes(Settings):
    """A map of motifs.

    Args:
        route: The line that the elements follow.
        sections: Motifs from start to goal; one in a map of one motif.
    """

    route: Route
    sections: Annotated[tuple[Section, ...], Field(min_length=1)]
