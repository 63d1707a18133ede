"""Motifs: a shape with genes that is repeated along a route from start to goal.

A motif is a subclass of :class:`Motif`: one range for each gene of its own, and a function that says which cells
around an element are walls. Everything else is the same for all motifs. The genes that all elements share are:

=============  =========================================================================
``pitch``      from one element to the next, m, at right angles to the walls
``phase``      shift of all elements along the route, share of the pitch
``shift``      distance of the gaps from the route, m, positive to the left
``slope``      further distance of the gaps from the route, m for each m along the route
``swing``      further distance of the gaps, m, to the left and to the right in turn
=============  =========================================================================
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from functools import cached_property
from typing import Annotated, Any

import numpy as np
from pydantic import AfterValidator, Field

from gym_mapbench.generator.motifs.along_route import AlongRoute
from gym_mapbench.generator.motifs.around import Around
from gym_mapbench.generator.motifs.genes import Deviations, Section
from gym_mapbench.generator.ranges import (
    CountRange,
    FractionRange,
    Length,
    LengthRange,
    SignedFractionRange,
    ordered_range,
    sample,
    sample_count,
)
from gym_mapbench.generator.shapes import Cells

Values = Mapping[str, float]
Bounds = tuple[float, float]
Distance = Annotated[float, Field(ge=-1000, le=1000)]
DistanceRange = Annotated[tuple[Distance, Distance], AfterValidator(ordered_range)]
RangeFromNone = Annotated[tuple[Annotated[float, Field(ge=0, le=1000)], Length], AfterValidator(ordered_range)]

NO_GENES = ("routes", "bend", "count", "deviation")
"""Options of a motif that are no shared genes."""
WIDTHS = ("gap", "width")
"""Shared genes that leave room for the robot."""
SECTION_GENES = ("phase", "slope", "swing")
"""Shared genes that describe the line of all elements, from which no single element deviates."""


class Motif(AlongRoute):
    """A family of maps of one motif, repeated along a route.

    Args:
        count: Range of the number of elements; elements in the cleared areas of start and goal are left out.
        pitch: Range of the distance from one element to the next at right angles to the walls, m.
        phase: Range of the shift of all elements along the route, share of the pitch.
        shift: Range of the distance of the gaps from the route, m, positive to the left.
        slope: Range of the slope of the line of gaps against the route.
        swing: Range of the distance, m, by which gaps are to the left and to the right of that line in turn.
        deviation: Range of the standard deviation of single elements from shared genes, share of a gene's range.
    """

    count: CountRange = (1, 4)
    pitch: LengthRange = (1.35, 2.0)
    phase: SignedFractionRange = (-0.5, 0.5)
    shift: DistanceRange = (-0.4, 0.4)
    slope: DistanceRange = (-0.3, 0.3)
    swing: RangeFromNone = (0.0, 0.6)
    deviation: FractionRange = (0.0, 0.15)

    @abstractmethod
    def walls(self, around: Around, genes: Values) -> Cells:
        """Return the ``(rows, cols)`` cells that one element occupies.

        Args:
            around: The cells as seen from the element.
            genes: The element's own values of all genes.
        """

    @cached_property
    def ranges(self) -> dict[str, Bounds]:
        """Ranges of the shared genes by name."""
        return {name: getattr(self, name) for name in type(self).model_fields if name not in NO_GENES}

    @cached_property
    def element_genes(self) -> tuple[str, ...]:
        """Genes from which single elements deviate."""
        return tuple(name for name in self.ranges if name not in SECTION_GENES)

    def motif(self, name: str) -> Motif:
        """Return the motif of a section."""
        return self

    def options_for(self, wider: float) -> dict[str, Any]:
        """As :meth:`AlongRoute.options_for`: gaps and corridors are as much wider."""
        return {
            name: [round(bound + wider, 3) for bound in getattr(self, name)]
            for name in WIDTHS
            if name in type(self).model_fields and name not in self.model_fields_set
        }

    def draw_sections(self, rng: np.random.Generator) -> tuple[Section, ...]:
        """Sample the only section of one map."""
        return (self.draw_section(rng),)

    def draw_section(self, rng: np.random.Generator, name: str = "") -> Section:
        """Sample the genes of one section."""
        shared = {gene: sample(rng, bounds) for gene, bounds in self.ranges.items()}
        spread = sample(rng, self.deviation)
        count = sample_count(rng, self.count)
        return Section(motif=name, shared=shared, elements=tuple(self.draw_element(rng, spread) for _ in range(count)))

    def draw_element(self, rng: np.random.Generator, spread: float) -> Deviations:
        """Sample the deviations of one element with a standard deviation."""
        return {gene: float(rng.normal(0.0, spread)) for gene in self.element_genes}

    def values(self, section: Section, number: int) -> dict[str, float]:
        """Return the values of all genes of one element, each within its range."""
        deviations = section.elements[number]
        return {
            gene: float(min(max(section.shared[gene] + deviations.get(gene, 0.0) * (high - low), low), high))
            for gene, (low, high) in self.ranges.items()
        }
