"""BARN's maps: scattered tiles, smoothed by a cellular automaton (a baseline for sampling).

Source: Perille, Truong, Xiao and Stone, "Benchmarking Metric Ground Navigation" (2020). The data set
uses tiles of 0.15 m, fills of 15 to 30 % and 2 to 4 smoothing steps, a new draw of both for every map.
"""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from gym_mapbench.generator import Cells, ShapeSettings, clear_and_border, interior
from gym_mapbench.settings import Settings

Probability = Annotated[float, Field(ge=0, le=1)]
Neighbours = Annotated[int, Field(ge=0, le=9)]


class CellularSettings(Settings):
    """The automaton; the defaults are BARN's.

    Args:
        fill_probability: Share of tiles filled at first; one of these is drawn for every map.
        smoothing_iterations: Steps of the automaton; one of these is drawn for every map.
        fill_threshold: A tile with at least so many filled neighbours is filled.
        clear_threshold: A tile with at most so many is cleared.
        tile: Side of a tile, cells of the map; 3 of 0.05 m are BARN's 0.15 m.
    """

    fill_probability: Annotated[tuple[Probability, ...], Field(min_length=1)] = (0.15, 0.20, 0.25, 0.30)
    smoothing_iterations: Annotated[tuple[Annotated[int, Field(ge=0)], ...], Field(min_length=1)] = (2, 3, 4)
    fill_threshold: Neighbours = 5
    clear_threshold: Neighbours = 1
    tile: Annotated[int, Field(ge=1)] = 3


BARN = CellularSettings()


def cellular_map(rng: np.random.Generator, shapes: ShapeSettings, cellular: CellularSettings = BARN) -> Cells:
    """Draw the ``(size, size)`` occupancy of one map, with its border, and start and goal areas cleared.

    Args:
        rng: Source of all randomness.
        shapes: Size, border and cleared areas; its shapes are not drawn.
        cellular: The automaton.
    """
    cells = np.zeros((shapes.size, shapes.size), dtype=np.bool_)
    inside = interior(cells, shapes.border)
    count = -(-inside.shape[0] // cellular.tile)
    tiles = rng.random((count, count)) < rng.choice(cellular.fill_probability)
    for _ in range(int(rng.choice(cellular.smoothing_iterations))):
        tiles = smoothed(tiles, cellular.fill_threshold, cellular.clear_threshold)
    fine = np.kron(tiles, np.ones((cellular.tile, cellular.tile), dtype=np.bool_))
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
