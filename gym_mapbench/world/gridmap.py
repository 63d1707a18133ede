"""GridMap: the static occupancy of a world, as a frozen value.

The array convention is that of ``nav_msgs/OccupancyGrid``: ``occupancy[row, col]`` with row 0
at the *bottom*, so that row grows with y and col with x. Pictures and text have their first
line at the top; :meth:`GridMap.from_rows`, :meth:`GridMap.from_image_array` and
:meth:`GridMap.to_image_array` are the only places that turn one into the other.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gym_mapbench.errors import ConfigError
from gym_mapbench.kernels.rectangles import merge_rectangles

MAX_CELLS = 100_000_000


@dataclass(frozen=True, eq=False)
class GridMap:
    """Occupied, free and unknown cells of one map.

    Equal and hashable by content (:attr:`digest`).

    Args:
        occupancy: ``(rows, cols)`` bool, True where there is a wall; row 0 at the bottom.
        resolution: Side of a cell, m.
        origin: World position ``(x, y)`` of the lower-left corner of cell (0, 0), m.
        unknown: ``(rows, cols)`` bool, True where nothing is known, never at a wall; None if all is known.

    Raises:
        ConfigError: If an array is not two-dimensional and boolean, a value is out of range, or a cell is both
            occupied and unknown.
    """

    occupancy: NDArray[np.bool_]
    resolution: float = 0.05
    origin: tuple[float, float] = (0.0, 0.0)
    unknown: NDArray[np.bool_] | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        occupancy = _frozen_cells("occupancy", self.occupancy)
        object.__setattr__(self, "occupancy", occupancy)
        if self.unknown is not None:
            unknown = _frozen_cells("unknown", self.unknown)
            if unknown.shape != occupancy.shape:
                raise ConfigError(f"unknown: expected shape {occupancy.shape}, got {unknown.shape}")
            if both := np.count_nonzero(occupancy & unknown):
                raise ConfigError(f"unknown: expected no occupied cells, got {both}")
            object.__setattr__(self, "unknown", unknown if unknown.any() else None)
        resolution = float(self.resolution)
        if not (np.isfinite(resolution) and resolution > 0):
            raise ConfigError(f"resolution: expected metres per cell > 0, got {self.resolution}")
        object.__setattr__(self, "resolution", resolution)
        x, y = (float(value) for value in self.origin)
        if not (np.isfinite(x) and np.isfinite(y)):
            raise ConfigError(f"origin: expected finite (x, y) in m, got {self.origin}")
        object.__setattr__(self, "origin", (x, y))

    @classmethod
    def from_image_array(cls, occupancy: ArrayLike, resolution: float = 0.05, **fields: Any) -> GridMap:
        """Build from an array whose row 0 is the *top*, as in pictures; fields as in the class."""
        unknown = fields.pop("unknown", None)
        flipped = None if unknown is None else np.asarray(unknown)[::-1]
        return cls(np.asarray(occupancy)[::-1], resolution, unknown=flipped, **fields)

    @classmethod
    def from_rows(cls, rows: Sequence[str], resolution: float = 0.05, **fields: Any) -> GridMap:
        """Build from text, first line at the top: ``#`` occupied, ``.`` or space free, ``?`` unknown.

        Raises:
            ConfigError: If there are no rows, they differ in length, or hold another character.
        """
        if not rows or any(len(row) != len(rows[0]) for row in rows) or not rows[0]:
            lengths = sorted({len(row) for row in rows})
            raise ConfigError(f"map rows: expected equally long, non-empty lines, got lengths {lengths}")
        strange = set("".join(rows)) - set("#.? ")
        if strange:
            raise ConfigError(f"map rows: expected only '#', '.', ' ' and '?', got {sorted(strange)[0]!r}")
        cells = np.array([list(row) for row in rows])
        return cls.from_image_array(cells == "#", resolution, unknown=cells == "?", **fields)

    def to_rows(self) -> tuple[str, ...]:
        """Return the text form that :meth:`from_rows` reads."""
        cells = np.where(self.occupancy, "#", ".")
        if self.unknown is not None:
            cells = np.where(self.unknown, "?", cells)
        return tuple("".join(row) for row in cells[::-1])

    def to_image_array(self) -> NDArray[np.bool_]:
        """Return a copy of the occupancy with row 0 at the top, as in pictures."""
        return self.occupancy[::-1].copy()

    def with_walls(self, occupancy: NDArray[np.bool_]) -> GridMap:
        """Return the map with other walls; a cell that gets a wall is known then."""
        return replace(self, occupancy=occupancy, unknown=None if self.unknown is None else self.unknown & ~occupancy)

    def split(self, parts: int) -> GridMap:
        """Return the same walls in smaller cells: each cell becomes ``parts`` x ``parts`` cells."""
        unknown = None if self.unknown is None else _split(self.unknown, parts)
        return GridMap(_split(self.occupancy, parts), self.resolution / parts, self.origin, unknown)

    @property
    def shape(self) -> tuple[int, int]:
        """``(rows, cols)``."""
        rows, cols = self.occupancy.shape
        return rows, cols

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """``(x_min, y_min, x_max, y_max)`` of the map, m."""
        rows, cols = self.shape
        x, y = self.origin
        return x, y, x + cols * self.resolution, y + rows * self.resolution

    @cached_property
    def digest(self) -> str:
        """Content hash (hex, 32 characters): identity, cache key and part of every seed."""
        state = hashlib.blake2b(digest_size=16)
        state.update(repr((self.shape, self.resolution, self.origin)).encode())
        state.update(np.packbits(self.occupancy).tobytes())
        if self.unknown is not None:
            state.update(np.packbits(self.unknown).tobytes())
        return state.hexdigest()

    @cached_property
    def framed(self) -> NDArray[np.bool_]:
        """``(rows + 2, cols + 2)`` occupancy inside a frame of occupied cells, the edge of the map."""
        framed = np.ones((self.shape[0] + 2, self.shape[1] + 2), dtype=np.bool_)
        framed[1:-1, 1:-1] = self.occupancy
        framed.flags.writeable = False
        return framed

    @cached_property
    def rectangles(self) -> NDArray[np.int64]:
        """The walls as few rectangles, ``(n, 4)``: row and col of the lower-left cell, height and width."""
        rectangles: NDArray[np.int64] = merge_rectangles(self.occupancy)
        rectangles.flags.writeable = False
        return rectangles

    @property
    def boxes(self) -> NDArray[np.float64]:
        """The walls as few rectangles, ``(n, 4)`` left, bottom, right, top in the world, m; a copy."""
        return self._boxes.copy()

    @cached_property
    def _boxes(self) -> NDArray[np.float64]:
        row, col, height, width = self.rectangles.T
        x, y = self.origin
        cells = np.stack([col, row, col + width, row + height], axis=1)
        boxes: NDArray[np.float64] = cells * self.resolution + np.array([x, y, x, y])
        return boxes

    def world_to_cell(self, x: float, y: float) -> tuple[int, int] | None:
        """Return ``(row, col)`` of the cell that holds the point, None outside the map."""
        col = (x - self.origin[0]) / self.resolution
        row = (y - self.origin[1]) / self.resolution
        rows, cols = self.shape
        return (int(row), int(col)) if 0 <= row < rows and 0 <= col < cols else None

    def cell_to_world(self, row: float, col: float) -> tuple[float, float]:
        """Return the centre ``(x, y)`` of a cell, m."""
        x, y = self.origin
        return x + (col + 0.5) * self.resolution, y + (row + 0.5) * self.resolution

    def __eq__(self, other: object) -> bool:
        return self.digest == other.digest if isinstance(other, GridMap) else NotImplemented

    def __hash__(self) -> int:
        return hash(self.digest)

    def __reduce__(self) -> tuple[Any, ...]:
        # Array write flags are lost on unpickling; going through the constructor freezes again.
        return type(self), (self.occupancy, self.resolution, self.origin, self.unknown)


def _split(cells: NDArray[np.bool_], parts: int) -> NDArray[np.bool_]:
    return cells.repeat(parts, axis=0).repeat(parts, axis=1)


def _frozen_cells(name: str, cells: ArrayLike) -> NDArray[np.bool_]:
    array = np.asarray(cells)
    if array.ndim != 2 or array.size == 0 or array.size > MAX_CELLS:
        raise ConfigError(f"{name}: expected a (rows, cols) array of 1 to {MAX_CELLS} cells, got shape {array.shape}")
    if array.dtype != np.bool_ and not np.isin(array, (0, 1)).all():
        raise ConfigError(f"{name}: expected booleans (or 0 and 1), got {array.dtype} with other values")
    frozen = np.array(array, dtype=np.bool_, order="C")
    frozen.flags.writeable = False
    return frozen
