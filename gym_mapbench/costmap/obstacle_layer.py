"""The obstacle layer and the voxel layer: what a lidar saw, cell by cell.

Source: nav2_costmap_2d/plugins/obstacle_layer.cpp, voxel_layer.cpp.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gym_mapbench.costmap.grid import FREE_SPACE, NO_INFORMATION
from gym_mapbench.costmap.layer import Box, Cells, Costs, Layer, Window
from gym_mapbench.costmap.params import CostmapParams, ObstacleLayer, VoxelLayer
from gym_mapbench.costmap.scan import LaserScan, Observation
from gym_mapbench.kernels.footprint import clear_polygon, touch_footprint
from gym_mapbench.kernels.layers import combine, shifted
from gym_mapbench.kernels.obstacle_layer import clear_rays, mark_hits
from gym_mapbench.kernels.voxel_layer import HALF, UNKNOWN_COLUMN, clear_voxels, mark_voxels
from gym_mapbench.world.footprint import Footprint
from gym_mapbench.world.scenario import Pose


class ObstacleGrid(Layer):
    """The two-dimensional layer: the newest scan clears, then marks, at every update until there is a newer one.

    Args:
        layer: The layer's options.
        params: Release, and whether cells never seen are unknown.
        shape: ``(rows, cols)``.
        footprint: What footprint clearing frees.

    Attributes:
        costs: ``(rows, cols)`` uint8, what the layer knows: 0 free, 254 occupied, 255 never seen.
    """

    def __init__(
        self, layer: ObstacleLayer, params: CostmapParams, shape: tuple[int, int], footprint: Footprint
    ) -> None:
        self.layer = layer
        self._jazzy = params.release == "jazzy"
        self._corners = footprint.corners
        self._default = NO_INFORMATION if params.track_unknown_space else FREE_SPACE
        self._observation: Observation | None = None
        self.costs: Costs = np.full(shape, self._default, np.uint8)
        self.reset()

    def observe(self, scan: LaserScan, sensor: Pose, height: float) -> None:
        """Take a new scan from a sensor at a pose in the costmap's frame, ``height`` m above the ground."""
        source = self.layer.scan
        observation = scan.observe(sensor, height, inf_is_valid=source.inf_is_valid)
        if not source.min_obstacle_height <= observation.z <= source.max_obstacle_height:
            observation = Observation(observation.origin, observation.points[:0], observation.z)
        self._observation = observation

    def reset(self) -> None:
        """Forget all cells; the newest scan remains for the next update."""
        self.costs = np.full_like(self.costs, self._default)

    def roll(self, d_row: int, d_col: int) -> None:
        """Keep the cells that stay in the window."""
        self.costs = shifted(self.costs, d_row, d_col, self._default)

    def update_bounds(self, window: Window, robot: Pose, box: Box) -> None:
        """Clear along the rays of the newest scan, then mark its hits; the robot's footprint is freed later."""
        if self._observation is not None:
            if self.layer.scan.clearing:
                self._clear(window, self._observation, box)
            if self.layer.scan.marking and self._is_marked(self._observation.z):
                self._mark(window, self._observation, box)
        if self.layer.footprint_clearing_enabled:
            self._placed = touch_footprint(self._corners, *robot, box)

    def update_costs(self, window: Window, master: Costs, cells: Cells) -> None:
        """Free the robot's own cells, then write."""
        if self.layer.footprint_clearing_enabled:
            clear_polygon(self.costs, *window.geometry, self._placed)
        combine(master, self.costs, *cells, self.layer.combination_method)

    def _is_marked(self, z: float) -> bool:
        """Whether the layer marks hits at this height, m."""
        return self.layer.min_obstacle_height <= z <= self.layer.max_obstacle_height

    def _clear(self, window: Window, seen: Observation, box: Box) -> None:
        source = self.layer.scan
        ranges = source.raytrace_min_range, source.raytrace_max_range
        clear_rays(self.costs, *window.geometry, *seen.origin[:2], seen.points, *ranges, box)

    def _mark(self, window: Window, seen: Observation, box: Box) -> None:
        source = self.layer.scan
        ranges = source.obstacle_min_range, source.obstacle_max_range
        mark_hits(self.costs, *window.geometry, *seen.origin[:2], seen.points, *ranges, self._jazzy, box)


class VoxelGrid(ObstacleGrid):
    """The layer with a column of voxels over every cell; its rays stop two cells before what they hit.

    Attributes:
        columns: ``(rows, cols)`` int64, one column of voxels each, as :mod:`gym_mapbench.kernels.voxel_layer` has them.
    """

    layer: VoxelLayer
    columns: NDArray[np.int64]

    def reset(self) -> None:
        """Forget all cells and voxels."""
        super().reset()
        self.columns = np.full(self.costs.shape, UNKNOWN_COLUMN, np.int64)

    def roll(self, d_row: int, d_col: int) -> None:
        """Keep the cells and voxels that stay in the window."""
        super().roll(d_row, d_col)
        self.columns = shifted(self.columns, d_row, d_col, UNKNOWN_COLUMN)

    def _is_marked(self, z: float) -> bool:
        # Humble's voxel layer does not look at min_obstacle_height.
        return (not self._jazzy or z >= self.layer.min_obstacle_height) and z <= self.layer.max_obstacle_height

    def _clear(self, window: Window, seen: Observation, box: Box) -> None:
        layer, source = self.layer, self.layer.scan
        clear_voxels(
            self.costs, self.columns, *window.geometry, layer.z_resolution, layer.origin_z, layer.z_voxels,
            seen.origin, seen.points, seen.z, layer.mark_threshold, layer.unknown_threshold + HALF - layer.z_voxels,
            source.raytrace_min_range, source.raytrace_max_range, self._jazzy, box,
        )  # fmt: skip

    def _mark(self, window: Window, seen: Observation, box: Box) -> None:
        layer, source = self.layer, self.layer.scan
        # A hit below the lowest voxel counts as a hit in it.
        level = int((max(seen.z, layer.origin_z) - layer.origin_z) / layer.z_resolution)
        if level < layer.z_voxels:
            ranges = source.obstacle_min_range, source.obstacle_max_range
            mark_voxels(
                self.costs, self.columns, *window.geometry, seen.origin, seen.points, seen.z, level,
                layer.mark_threshold, *ranges, box,
            )  # fmt: skip
