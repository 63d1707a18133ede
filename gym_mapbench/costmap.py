"""Costmap: Nav2's cost values on a grid, and the layers that write them.

Source: nav2_costmap_2d (Humble). ``costs[row, col]`` has row 0 at the bottom, as
:class:`~gym_mapbench.gridmap.GridMap` and Nav2's own ``my``.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gym_mapbench.costmap_params import CostmapParams, InflationLayer, ObstacleLayer, StaticLayer
from gym_mapbench.errors import ConfigError
from gym_mapbench.footprint import Footprint
from gym_mapbench.gridmap import MAX_CELLS, GridMap
from gym_mapbench.kernels.inflation import inflate
from gym_mapbench.kernels.raytrace import clear_footprint, clear_rays, mark_hits
from gym_mapbench.scenario import Pose

__all__ = [
    "FREE_SPACE",
    "INSCRIBED_INFLATED_OBSTACLE",
    "LETHAL_OBSTACLE",
    "NO_INFORMATION",
    "Costmap",
    "CostmapParams",
    "InflationLayer",
    "LocalCostmap",
    "ObstacleLayer",
    "StaticLayer",
    "build_static_costmap",
    "inflate_costs",
    "inflation_costs",
    "static_costs",
]

FREE_SPACE = 0
INSCRIBED_INFLATED_OBSTACLE = 253
LETHAL_OBSTACLE = 254
NO_INFORMATION = 255
MAX_REACH_CELLS = 2000
OBSTACLE_LAYERS = ("obstacle_layer", "voxel_layer")
# An exact lidar's hits lie on the border of the wall's cell, where rounding would decide which cell they are in:
# a hair farther along the ray, in parts of the range and just above float32's rounding, they are inside the wall.
HAIR = 3e-7
RANGE_EPSILON = 1e-4


@dataclass
class Costmap:
    """Cost values of one moment.

    Args:
        costs: ``(rows, cols)`` uint8, C-contiguous; row 0 at the bottom.
        resolution: Side of a cell, m.
        origin_x: World x of the lower-left corner of cell (0, 0), m.
        origin_y: World y of it, m.
        track_unknown_space: Whether 255 means "unknown" rather than an obstacle.
    """

    costs: NDArray[np.uint8]
    resolution: float
    origin_x: float
    origin_y: float
    track_unknown_space: bool = False

    def world_to_map(self, x: float, y: float) -> tuple[int, int] | None:
        """Return ``(row, col)`` of the cell that holds the point, None off the map (``worldToMap``)."""
        if x < self.origin_x or y < self.origin_y:
            return None
        col = int((x - self.origin_x) / self.resolution)
        row = int((y - self.origin_y) / self.resolution)
        rows, cols = self.costs.shape
        return (row, col) if row < rows and col < cols else None

    def size_in_meters(self) -> tuple[float, float]:
        """``(x, y)`` extent as Nav2's ``getSizeInMeters`` counts it: half a cell short, m."""
        rows, cols = self.costs.shape
        return (cols - 0.5) * self.resolution, (rows - 0.5) * self.resolution


def build_static_costmap(grid: GridMap, params: CostmapParams, footprint: Footprint) -> Costmap:
    """Build the costmap of the whole map, from the static and the inflation layer alone.

    Args:
        grid: The map; it gives size, resolution and origin.
        params: Which of the two layers write, and how.
        footprint: Gives the inscribed radius.
    """
    free = np.uint8(NO_INFORMATION if params.track_unknown_space else FREE_SPACE)
    costs = static_costs(grid, params) if params.writes("static_layer") else np.full(grid.shape, free)
    inflate_costs(costs, grid.resolution, params, footprint)
    return Costmap(costs, grid.resolution, *grid.origin, params.track_unknown_space)


def static_costs(grid: GridMap, params: CostmapParams) -> NDArray[np.uint8]:
    """Cost values ``(rows, cols)`` uint8 of the map's free, occupied and unknown cells (``interpretValue``)."""
    costs = np.where(grid.occupancy, _static_cost(100, params), _static_cost(0, params))
    if grid.unknown is not None:
        costs[grid.unknown] = _static_cost(NO_INFORMATION, params)
    return costs


def _static_cost(value: int, params: CostmapParams) -> np.uint8:
    """Cost of one map value: 0 free, 100 occupied, 255 unknown."""
    if value == params.unknown_cost_value:
        return np.uint8(NO_INFORMATION if params.track_unknown_space else FREE_SPACE)
    if value >= params.lethal_cost_threshold:
        return np.uint8(LETHAL_OBSTACLE)
    scaled = FREE_SPACE if params.trinary_costmap else LETHAL_OBSTACLE * value // params.lethal_cost_threshold
    return np.uint8(scaled)


def inflate_costs(costs: NDArray[np.uint8], resolution: float, params: CostmapParams, footprint: Footprint) -> None:
    """Let the inflation layer, if it writes, inflate ``(rows, cols)`` cost values in place.

    Raises:
        ConfigError: If the inflation radius is more than 2000 cells.
    """
    layer = params.inflation_layer
    reach = int(np.ceil(layer.inflation_radius / resolution))
    if reach > MAX_REACH_CELLS:
        raise ConfigError(f"inflation_radius: expected at most {MAX_REACH_CELLS} cells, got {reach}")
    if params.writes("inflation_layer") and reach > 0:
        cost_of = inflation_costs(layer, reach, resolution, footprint.inscribed_radius)
        inflate(costs, reach, cost_of, layer.inflate_unknown, layer.inflate_around_unknown)


@functools.lru_cache(maxsize=64)
def inflation_costs(layer: InflationLayer, reach: int, resolution: float, inscribed_radius: float) -> NDArray[np.uint8]:
    """Cost ``(reach**2 + 1,)`` uint8 at every squared distance from an obstacle, in cells^2 (``computeCost``)."""
    distance = np.sqrt(np.arange(reach * reach + 1)) * resolution
    decay = np.exp(-layer.cost_scaling_factor * np.maximum(distance - inscribed_radius, 0.0))
    costs = np.where(distance <= inscribed_radius, INSCRIBED_INFLATED_OBSTACLE, np.trunc(252 * decay))
    costs[0] = LETHAL_OBSTACLE
    table = costs.astype(np.uint8)
    table.flags.writeable = False
    return table


class LocalCostmap:
    """One of Nav2's costmaps, with its layers: usually the local one, a window that rolls with the robot.

    Without obstacle layers and without a rolling window it is :func:`build_static_costmap`,
    computed once.

    Source: nav2_costmap_2d/src/layered_costmap.cpp and plugins.

    Args:
        params: Layers and size.
        grid: The static map; only ``static_layer`` looks at it.
        footprint: The padded footprint: inscribed radius, and what footprint clearing frees.
    """

    def __init__(self, params: CostmapParams, grid: GridMap, footprint: Footprint) -> None:
        self.params = params
        self.footprint = footprint
        self._map = Costmap(static_costs(grid, params), grid.resolution, *grid.origin)
        self._takes_size_of_map = params.writes("static_layer") and not params.rolling_window
        self._resolution = grid.resolution if self._takes_size_of_map else params.resolution
        rows, cols = int(params.height / self._resolution), int(params.width / self._resolution)
        self._shape = grid.shape if self._takes_size_of_map else (rows, cols)
        if not 0 < self._shape[0] * self._shape[1] <= MAX_CELLS:
            raise ConfigError(f"costmap: expected width x height of 1 to {MAX_CELLS} cells, got {cols} x {rows}")
        self._obstacle_layers = tuple(name for name in OBSTACLE_LAYERS if params.writes(name))
        fixed = self._takes_size_of_map and not self._obstacle_layers
        self._unchanging = build_static_costmap(grid, params, footprint) if fixed else None
        self._start_over()

    def reset(self, pose: Pose) -> None:
        """Forget all observations and place the window around ``pose`` as at start-up."""
        self._start_over()
        self._roll(pose)

    def clear(self) -> None:
        """Forget all observations ("clear entirely")."""
        self._observed = {name: np.full(self._shape, self._default) for name in self._obstacle_layers}

    def update(
        self,
        pose: Pose,
        scan_ranges: NDArray[np.floating] | None = None,
        scan_angles: NDArray[np.floating] | None = None,
        range_max: float = math.inf,
        sensor: Pose | None = None,
    ) -> Costmap:
        """Run one update cycle and return the costmap; call it at ``update_frequency``.

        Args:
            pose: Pose of the robot.
            scan_ranges: ``(beams,)`` m, ``range_max`` or more where nothing was hit; None if there is no new scan.
            scan_angles: ``(beams,)`` rad, in the lidar's frame.
            range_max: Range of the lidar, m.
            sensor: Pose of the lidar; None if it is the robot's.
        """
        if self._unchanging is not None:
            return self._unchanging
        self._roll(pose)
        for name in self._obstacle_layers:
            if scan_ranges is not None and scan_angles is not None:
                self._observe(name, sensor or pose, np.asarray(scan_ranges, np.float64), scan_angles, range_max)
            if self._layer(name).footprint_clearing_enabled:
                clear_footprint(self._observed[name], *self._frame, *pose, self.footprint.corners)
        return Costmap(self._combine(), *self._frame, self.params.track_unknown_space)

    @property
    def _frame(self) -> tuple[float, float, float]:
        """Resolution and origin, as the kernels take them."""
        return self._resolution, *self._origin

    @property
    def _default(self) -> np.uint8:
        return np.uint8(NO_INFORMATION if self.params.track_unknown_space else FREE_SPACE)

    def _layer(self, name: str) -> ObstacleLayer:
        layer: ObstacleLayer = getattr(self.params, name)
        return layer

    def _start_over(self) -> None:
        at_map = self._map.origin_x, self._map.origin_y
        self._origin = at_map if self._takes_size_of_map else (self.params.origin_x, self.params.origin_y)
        self.clear()

    def _roll(self, pose: Pose) -> None:
        """Shift the window by whole cells to the robot; cells that stay keep what was observed."""
        if not self.params.rolling_window:
            return
        rows, cols = self._shape
        d_row = int((pose.y - (rows - 0.5) * self._resolution / 2 - self._origin[1]) / self._resolution)
        d_col = int((pose.x - (cols - 0.5) * self._resolution / 2 - self._origin[0]) / self._resolution)
        self._origin = self._origin[0] + d_col * self._resolution, self._origin[1] + d_row * self._resolution
        for name, layer in self._observed.items():
            self._observed[name] = _shifted(layer, d_row, d_col, self._default)

    def _observe(
        self, name: str, pose: Pose, ranges: NDArray[np.float64], angles: NDArray[np.floating], range_max: float
    ) -> None:
        """Clear along the rays of a scan, then mark its hits."""
        layer, observed, voxel = self._layer(name), self._observed[name], name == "voxel_layer"
        hit = ranges < range_max
        reach = np.where(hit, ranges * (1 + HAIR), range_max - RANGE_EPSILON)
        valid = np.isfinite(reach) & (hit | layer.inf_is_valid)
        headings, reach = pose.yaw + np.asarray(angles)[valid], reach[valid]
        beams = np.stack([np.cos(headings), np.sin(headings)], axis=1)
        position = np.array([pose.x, pose.y])
        if layer.clearing:
            cleared = np.maximum(reach - 2 * self._resolution, 0.0) if voxel else reach
            cells = [math.ceil(r / self._resolution) for r in (layer.raytrace_min_range, layer.raytrace_max_range)]
            clear_rays(observed, *self._frame, pose.x, pose.y, position + cleared[:, None] * beams, *cells)
        if layer.marking:
            hits = position + reach[:, None] * beams
            limits = layer.obstacle_min_range, layer.obstacle_max_range
            mark_hits(observed, *self._frame, pose.x, pose.y, hits, *limits, not voxel)

    def _combine(self) -> NDArray[np.uint8]:
        """Let every layer write over the default, in the order of ``plugins``."""
        costs = np.full(self._shape, self._default)
        for name in self.params.plugins:
            if name in self._observed:
                _write(costs, self._observed[name], greater=self._layer(name).combination_method == 1)
            elif name == "static_layer" and self.params.writes(name):
                self._write_map(costs)
            elif name == "inflation_layer":
                inflate_costs(costs, self._resolution, self.params, self.footprint)
        return costs

    def _write_map(self, costs: NDArray[np.uint8]) -> None:
        """Look every cell's centre up in the map; cells outside stay as they are."""
        rows, in_rows = _lookup(self._shape[0], self._resolution, self._origin[1], self._map, axis=0)
        cols, in_cols = _lookup(self._shape[1], self._resolution, self._origin[0], self._map, axis=1)
        window = costs[in_rows, in_cols]
        known = self._map.costs[np.ix_(rows, cols)]
        if self.params.use_maximum:
            _write(window, known, greater=True)
        else:
            window[:] = known


def _lookup(
    cells: int, resolution: float, origin: float, target: Costmap, axis: int
) -> tuple[NDArray[np.int64], slice]:
    """Return which cells of ``target`` lie under the cell centres of one axis, and which of these centres are on it."""
    target_origin = target.origin_y if axis == 0 else target.origin_x
    offset = origin + (np.arange(cells) + 0.5) * resolution - target_origin
    index = np.trunc(offset / target.resolution).astype(np.int64)
    inside = np.flatnonzero((offset >= 0) & (index < target.costs.shape[axis]))
    return index[inside], slice(inside[0], inside[-1] + 1) if len(inside) else slice(0, 0)


def _write(costs: NDArray[np.uint8], layer: NDArray[np.uint8], *, greater: bool) -> None:
    """Write a layer's known cells, all of them or those greater than what is there; unknown gives way."""
    writes = layer != NO_INFORMATION
    if greater:
        writes &= (costs == NO_INFORMATION) | (costs < layer)
    costs[writes] = layer[writes]


def _shifted(layer: NDArray[np.uint8], d_row: int, d_col: int, default: np.uint8) -> NDArray[np.uint8]:
    """Return ``layer`` as seen from a window moved by whole cells; entering cells are ``default``."""
    if d_row == d_col == 0:
        return layer
    moved = np.full(layer.shape, default)
    rows, cols = layer.shape
    to_rows, to_cols = slice(max(0, -d_row), rows - max(0, d_row)), slice(max(0, -d_col), cols - max(0, d_col))
    from_rows, from_cols = slice(max(0, d_row), rows - max(0, -d_row)), slice(max(0, d_col), cols - max(0, -d_col))
    if abs(d_row) < rows and abs(d_col) < cols:
        moved[to_rows, to_cols] = layer[from_rows, from_cols]
    return moved
