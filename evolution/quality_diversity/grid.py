"""The grid of an atlas: cells by log time ratios, each with its best map, in pyribs' ``GridArchive``."""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from dataclasses import dataclass
from math import log
from typing import Any

import numpy as np
from numpy.typing import NDArray

from evolution.driving import RunResult
from evolution.quality_diversity.settings import AtlasSettings
from gym_mapbench.errors import ConfigError

Floats = NDArray[np.float64]
Cell = tuple[int, ...]


def ribs_archives() -> Any:
    """Import the archives of pyribs.

    Raises:
        ConfigError: If it is not installed, with what to install.
    """
    try:
        return importlib.import_module("ribs.archives")
    except ImportError:
        raise ConfigError("an atlas needs pyribs (pip install 'gym-mapbench[qd]')") from None


@dataclass(frozen=True)
class Axes:
    """The axes of an atlas.

    Args:
        pairs: For each axis the places of two controllers; the axis is the time of the first over that of the second.
        names: For each axis the two controllers' names, as ``A/B``.
        cells: Cells along each axis.
        largest_ratio: Ratio at the end of each axis.
    """

    pairs: tuple[tuple[int, int], ...]
    names: tuple[str, ...]
    cells: int
    largest_ratio: float

    @classmethod
    def of(cls, settings: AtlasSettings, controllers: Sequence[str]) -> Axes:
        """Build from the options; errors as for :meth:`AtlasSettings.axes`."""
        pairs = settings.axes(controllers)
        names = tuple(f"{controllers[one]}/{controllers[other]}" for one, other in pairs)
        return cls(pairs, names, settings.cells, settings.largest_ratio)

    @property
    def width(self) -> float:
        """Width of a cell, in natural logarithms of the ratio."""
        return 2.0 * log(self.largest_ratio) / self.cells

    @property
    def edges(self) -> Floats:
        """The ratios between the cells of an axis, ``(cells + 1,)``."""
        end = log(self.largest_ratio)
        return np.exp(np.linspace(-end, end, self.cells + 1))

    def log_ratios(self, of_map: Sequence[Sequence[RunResult]]) -> Floats:
        """Return the log time ratios of the trials on a map, ``(trials, axes)``; every run must have a time.

        Args:
            of_map: Results of the map, ``[controller][repeat]``.
        """
        times = np.log([[run.time_s for run in runs] for runs in of_map])
        return np.stack([times[one] - times[other] for one, other in self.pairs], axis=1)


class MapGrid:
    """The best map of every cell, by the number of the map.

    Args:
        axes: The axes.
    """

    def __init__(self, axes: Axes) -> None:
        count, end = len(axes.pairs), log(axes.largest_ratio)
        self._archive = ribs_archives().GridArchive(
            solution_dim=(),
            dims=[axes.cells] * count,
            ranges=[(-end, end)] * count,
            solution_dtype=np.int64,
            objective_dtype=np.float64,
            measures_dtype=np.float64,
        )

    def takes(self, quality: float, position: Floats) -> bool:
        """Whether a map of this quality would enter the cell at its position, ``(axes,)`` log ratios.

        Positions beyond an end are in the last cell.
        """
        occupied, elite = self._archive.retrieve_single(position)
        return not occupied or bool(quality > elite["objective"])

    def add(self, number: int, quality: float, position: Floats) -> None:
        """Add a map; it enters its cell if the cell is empty or has a map of lower quality."""
        self._archive.add_single(number, quality, position)

    @property
    def elites(self) -> dict[Cell, int]:
        """The number of the map in each filled cell, in order of the cells."""
        numbers, places = self._archive.data(["solution", "index"], return_type="tuple")
        cells = self._archive.int_to_grid_index(places) if len(places) else []
        return dict(sorted((tuple(map(int, cell)), int(one)) for cell, one in zip(cells, numbers, strict=True)))

    @property
    def coverage(self) -> float:
        """Filled cells over all cells."""
        return float(self._archive.stats.coverage)

    @property
    def qd_score(self) -> float:
        """Sum of the qualities of all elites."""
        return float(self._archive.stats.qd_score)
