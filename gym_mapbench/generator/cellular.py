"""BARN's maps: scattered tiles, smoothed by a cellular automaton.

Source: Perille, Truong, Xiao and Stone, "Benchmarking Metric Ground Navigation" (2020). The data set
uses tiles of 0.15 m, fills of 15 to 30 % and 2 to 4 smoothing steps, both sampled for every map.
"""

from __future__ import annotations

from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from gym_mapbench.generator.base import empty
from gym_mapbench.generator.ranges import Seed, sample_seed
from gym_mapbench.generator.shapes import Cells, ShapeSettings, clear_and_border, interior
from gym_mapbench.quantities import Count, Fraction, Natural
from gym_mapbench.settings import Settings

Neighbours = Annotated[Natural, Field(le=9)]
Steps = Annotated[Natural, Field(le=1000)]


class CellularGenes(Settings):
    """A map of the automaton.

    Args:
        fill_probability: Share of tiles filled at first.
        smoothing_iterations: Steps of the automaton.
        layout: Seed of the tiles filled at first.
    """

    fill_probability: Fraction
    smoothing_iterations: Steps
    layout: Seed


class Cellular(Settings):
    """Clumps of tiles, as BARN's cellular automaton leaves them; the defaults are BARN's.

    ::

        ##################
        # G   ###      ###
        #      ##   #   ##
        ##   #     ###   #
        ###  ##   #####  #
        ##  ####   ##    #
        #    ##      #   #
        ###       ##   S #
        ##################

    Args:
        fill_probability: Share of tiles filled at first; one of these is sampled for every map.
        smoothing_iterations: Steps of the automaton; one of these is sampled for every map.
        fill_threshold: A tile with at least so many filled neighbours is filled.
        clear_threshold: A tile with at most so many is cleared.
        tile: Side of a tile, cells of the map; 3 of 0.05 m are BARN's 0.15 m.
    """

    genes: ClassVar[type[Settings]] = CellularGenes

    fill_probability: Annotated[tuple[Fraction, ...], Field(min_length=1)] = (0.15, 0.20, 0.25, 0.30)
    smoothing_iterations: Annotated[tuple[Steps, ...], Field(min_length=1)] = (2, 3, 4)
    fill_threshold: Neighbours = 5
    clear_threshold: Neighbours = 1
    tile: Count = 3

    def draw_genes(self, rng: np.random.Generator) -> CellularGenes:
        """Sample the genes of one map."""
        return CellularGenes(
            fill_probability=float(rng.choice(self.fill_probability)),
            smoothing_iterations=int(rng.choice(self.smoothing_iterations)),
            layout=sample_seed(rng),
        )

    def build(self, genes: CellularGenes, shapes: ShapeSettings) -> Cells:
        """Return the occupancy; see :meth:`Family.build`."""
        cells = empty(shapes)
        inside = interior(cells, shapes.border)
        count = -(-inside.shape[0] // self.tile)
        tiles = np.random.default_rng(genes.layout).random((count, count)) < genes.fill_probability
        for _ in range(genes.smoothing_iterations):
            tiles = smoothed(tiles, self.fill_threshold, self.clear_threshold)
        fine = np.kron(tiles, np.ones((self.tile, self.tile), dtype=np.bool_))
        inside[:] = fine[: inside.shape[0], : inside.shape[1]]
        return clear_and_border(cells, shapes)


def smoothed(tiles: Cells, fill_threshold: int, clear_threshold: int) -> Cells:
    """Return the next step of the automaton: all tiles at once, the eight around each counted.

    What lies outside counts as filled beyond the first and last row, where BARN has its walls, and as
    free beyond the first and last column, where its robot comes in and leaves.
    """
    around = np.pad(np.pad(tiles, ((0, 0), (1, 1))), ((1, 1), (0, 0)), constant_values=True).astype(np.int64)
    rows, cols = tiles.shape
    neighbours = sum(around[r : r + rows, c : c + cols] for r in range(3) for c in range(3)) - tiles
    return np.where(neighbours >= fill_threshold, True, np.where(neighbours <= clear_threshold, False, tiles))
