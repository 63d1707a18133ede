"""Quality of a map in an atlas: reliability first, then simplicity."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from evolution.quality_diversity.grid import Axes, Cell, Floats
from evolution.search import MapResults
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.scenario import Scenario


@dataclass(frozen=True)
class Elite:
    """The map of a cell after its re-evaluation on held-out seeds.

    Args:
        scenario: The map with its task, named after the cell.
        cell: The cell, which the mean of the held-out log ratios says.
        found_in: The cell that the search had it in.
        ratios: For each axis the geometric mean of the held-out time ratios.
        quality: Its quality on the held-out seeds.
        results: Held-out results, ``[controller][repeat]``.
    """

    scenario: Scenario
    cell: Cell
    found_in: Cell
    ratios: tuple[float, ...]
    quality: float
    results: MapResults

    @property
    def moved(self) -> bool:
        """Whether the held-out seeds moved it to another cell."""
        return self.cell != self.found_in


def boundary_length(grid: GridMap) -> float:
    """Return the length of the boundary between free and occupied cells, m."""
    cells = grid.occupancy.astype(np.int8)
    return float(grid.resolution * sum(np.count_nonzero(np.diff(cells, axis=axis)) for axis in (0, 1)))


def simplicity(grid: GridMap) -> float:
    """Return 1 / (1 + boundary length / circumference of the map): 1 if the map is empty."""
    rows, cols = grid.shape
    return 1.0 / (1.0 + boundary_length(grid) / (2.0 * (rows + cols) * grid.resolution))


def reliability(log_ratios: Floats, width: float) -> float:
    """Return the share of trials whose log ratios are all within a cell's width of their mean.

    Args:
        log_ratios: ``(trials, axes)`` log time ratios.
        width: Width of a cell.
    """
    return float(np.mean(np.all(np.abs(log_ratios - log_ratios.mean(axis=0)) <= width, axis=1)))


def quality(grid: GridMap, reliable: float, trials: int) -> float:
    """Return the quality of a map that all controllers solved, between 0 and 1.

    A map with one more reliable trial is better than any simpler map with the same number of trials.

    Args:
        grid: The map.
        reliable: Share of reliable trials, see :func:`reliability`.
        trials: Number of trials.
    """
    return (trials * reliable + simplicity(grid)) / (trials + 1)


def quality_of(grid: GridMap, log_ratios: Floats, axes: Axes) -> float:
    """Return the quality of a map with these ``(trials, axes)`` log time ratios."""
    return quality(grid, reliability(log_ratios, axes.width), len(log_ratios))
