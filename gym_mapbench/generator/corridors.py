"""Corridors: one bent way through solid ground."""

from __future__ import annotations

from itertools import accumulate, pairwise
from typing import ClassVar

import numpy as np

from gym_mapbench.generator.base import mirrored, to_cells
from gym_mapbench.generator.ranges import (
    CountRange,
    Length,
    LengthRange,
    RelativeWeight,
    WeightRange,
    sample,
    sample_count,
    sample_flag,
)
from gym_mapbench.generator.shapes import Cells, ShapeSettings, clear_and_border, task_cells
from gym_mapbench.settings import Settings


class Flight(Settings):
    """One step of the staircase that the corridor is.

    Args:
        up: How far it goes up, as a weight among all steps.
        left: How far it then goes to the left, likewise.
    """

    up: RelativeWeight
    left: RelativeWeight


class CorridorGenes(Settings):
    """A corridor.

    Args:
        flights: Its steps, from the start on.
        width: Width of the corridor, m.
        mirrored: Whether it goes to the left first, then up, and so on.
    """

    flights: tuple[Flight, ...]
    width: Length
    mirrored: bool


class Corridors(Settings):
    """A corridor from start to goal with right-angled bends, everything else solid; it only leads up and to the left.

    ::

        ################
        # G     ########
        #       ########
        ####  ##########
        ####      ######
        ########  ######
        ########      ##
        ###########    #
        ########### S  #
        ################

    Args:
        flights: Range of the number of steps; each has two bends, the last one only one.
        width: Range of the corridor's width, m.
        weight: Range of the steps' weights; the narrower it is, the more even the steps.
    """

    genes: ClassVar[type[Settings]] = CorridorGenes

    flights: CountRange = (1, 4)
    width: LengthRange = (0.6, 1.2)
    weight: WeightRange = (0.3, 1.0)

    def draw_genes(self, rng: np.random.Generator) -> CorridorGenes:
        """Sample the genes of one map."""
        return CorridorGenes(
            flights=tuple(
                Flight(up=sample(rng, self.weight), left=sample(rng, self.weight))
                for _ in range(sample_count(rng, self.flights))
            ),
            width=sample(rng, self.width),
            mirrored=sample_flag(rng),
        )

    def build(self, genes: CorridorGenes, shapes: ShapeSettings) -> Cells:
        """Return the occupancy; see :meth:`Family.build`."""
        cells = np.ones((shapes.size, shapes.size), dtype=np.bool_)
        (low, right), (high, left) = task_cells((shapes.size, shapes.size), shapes.border + shapes.task_distance)
        rows = _stops(low, high, [flight.up for flight in genes.flights])
        cols = _stops(right, left, [flight.left for flight in genes.flights])
        width = to_cells(genes.width, shapes)
        for (row, above), (col, beside) in zip(pairwise(rows), pairwise(cols), strict=True):
            _carve(cells, (row, above), (col, col), width)
            _carve(cells, (above, above), (col, beside), width)
        return clear_and_border(mirrored(cells) if genes.mirrored else cells, shapes)


def _stops(first: int, last: int, weights: list[float]) -> list[int]:
    """Divide the way from one cell to another in the ratio of some weights."""
    total = sum(weights)
    return [first, *(first + round((last - first) * reached / total) for reached in accumulate(weights))]


def _carve(cells: Cells, rows: tuple[int, int], cols: tuple[int, int], width: int) -> None:
    """Free the cells along a straight piece, with a square at each end."""
    before, beyond = (width - 1) // 2, width // 2 + 1
    (low, high), (left, right) = sorted(rows), sorted(cols)
    cells[max(0, low - before) : high + beyond, max(0, left - before) : right + beyond] = False
