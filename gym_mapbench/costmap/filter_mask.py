"""FilterMask: the occupancy grid of a costmap filter, in a form that a settings file can hold.

Source: nav_msgs/OccupancyGrid, whose resolution is a number of single precision.
"""

from __future__ import annotations

import re
from typing import Annotated, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, field_validator, model_validator

from gym_mapbench.costmap.options import MAX_CELLS
from gym_mapbench.errors import ConfigError
from gym_mapbench.quantities import Positive
from gym_mapbench.settings import Settings
from gym_mapbench.world.scenario import Pose

INFO_SERVERS, MASK_SERVERS = FILTER_SERVERS = ("filter_info_server", "filter_mask_server")
"""Ends of the names of nodes that serve costmap filters: those of info servers, and of the masks' map servers."""
UNKNOWN = -1
HIGHEST = 100
RUNS = re.compile(r"(-?\d{1,3}x\d{1,8})( -?\d{1,3}x\d{1,8})*")

Size = Annotated[int, Field(gt=0)]
Values = NDArray[np.int8]


class FilterMask(Settings):
    """The grid of values that a costmap filter reads, in the frame of the map.

    Args:
        rows: Number of rows.
        cols: Number of columns.
        resolution: Side of a cell, m.
        origin: x and y of the lower-left corner, m.
        runs: The values from the bottom row up, run by run, ``VALUExCOUNT`` with a space between: 0 to 100, -1 unknown.
    """

    rows: Size
    cols: Size
    resolution: Positive
    origin: tuple[float, float] = (0.0, 0.0)
    runs: str

    @classmethod
    def from_values(cls, values: Values, resolution: float, origin: tuple[float, float] = (0.0, 0.0)) -> Self:
        """Make a mask of ``(rows, cols)`` values, row 0 at the bottom."""
        rows, cols = values.shape
        flat = values.ravel()
        begins = np.flatnonzero(np.diff(flat, prepend=flat[:1] - 1))
        counts = np.diff(begins, append=len(flat))
        pairs = zip(flat[begins].tolist(), counts.tolist(), strict=True)
        runs = " ".join(f"{value}x{count}" for value, count in pairs)
        return cls(rows=rows, cols=cols, resolution=resolution, origin=origin, runs=runs)

    @field_validator("runs")
    @classmethod
    def _are_runs(cls, value: str) -> str:
        if not RUNS.fullmatch(value):
            raise ConfigError(f"expected runs 'VALUExCOUNT VALUExCOUNT ...', got {value[:80]!r}")
        return value

    @model_validator(mode="after")
    def _fill_the_grid(self) -> Self:
        values, counts = self._pairs()
        if self.rows * self.cols > MAX_CELLS:
            raise ConfigError(f"rows, cols: expected at most {MAX_CELLS} cells, got {self.rows} x {self.cols}")
        if values.min() < UNKNOWN or values.max() > HIGHEST:
            raise ConfigError(f"runs: expected values of {UNKNOWN} to {HIGHEST}, got {values.min()} to {values.max()}")
        if counts.sum() != self.rows * self.cols:
            raise ConfigError(f"runs: expected {self.rows * self.cols} values, rows times cols, got {counts.sum()}")
        return self

    @property
    def values(self) -> Values:
        """The values, ``(rows, cols)`` int8, row 0 at the bottom: 0 to 100, -1 unknown."""
        values, counts = self._pairs()
        return np.repeat(values.astype(np.int8), counts).reshape(self.rows, self.cols)

    @property
    def geometry(self) -> tuple[float, float, float]:
        """Resolution, in single precision as in ROS, and origin, m."""
        return float(np.float32(self.resolution)), *self.origin

    def cell_at(self, pose: Pose) -> tuple[int, int] | None:
        """Return row and column of the cell at a pose in the map's frame; None off the mask (``worldToMask``)."""
        resolution, x, y = self.geometry
        if pose.x < x or pose.y < y:
            return None
        row, col = int((pose.y - y) / resolution), int((pose.x - x) / resolution)
        return (row, col) if row < self.rows and col < self.cols else None

    def _pairs(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return value and count of every run."""
        pairs = np.array([run.split("x") for run in self.runs.split()], dtype=np.int64)
        return pairs[:, 0], pairs[:, 1]
