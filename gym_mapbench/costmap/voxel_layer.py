"""The voxel layer: the hits and the free space of a lidar, in columns of voxels.

Source: nav2_costmap_2d/plugins/voxel_layer.cpp.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gym_mapbench.costmap.layer import Box, LayerEntry, Window
from gym_mapbench.costmap.obstacle_layer import (
    LIDAR_PLANE,
    OBSTACLE_KEYS,
    ObstacleGrid,
    ObstacleLayer,
    adapt,
    check_combination,
    name_lidar,
)
from gym_mapbench.costmap.scan import Observation
from gym_mapbench.kernels.layers import shifted
from gym_mapbench.kernels.voxel_layer import HALF, UNKNOWN_COLUMN, clear_voxels, mark_voxels
from gym_mapbench.quantities import Count, Natural, Positive
from gym_mapbench.ros_params import RosPlugin, Section, in_every_release

MOST_VOXELS = 16


class VoxelLayer(ObstacleLayer):
    """Nav2's ``VoxelLayer`` with one lidar: as ``ObstacleLayer``, and columns of voxels.

    Args:
        z_voxels: Voxels in a column.
        z_resolution: Height of a voxel, m.
        origin_z: Height at which the lowest voxel begins, m.
        mark_threshold: How many marked voxels a column may have and still not be an obstacle.
        unknown_threshold: How many unknown voxels a cleared column may have and still be free; as in Nav2,
            the voxels by which the column is shorter than 16 are not counted against it.
    """

    z_voxels: Annotated[Count, Field(le=16)] = 10
    z_resolution: Positive = 0.2
    origin_z: float = 0.0
    mark_threshold: Annotated[Natural, Field(le=16)] = 0
    unknown_threshold: Annotated[Natural, Field(le=16)] = 15


class VoxelGrid(ObstacleGrid):
    """The layer with a column of voxels over every cell; its rays stop two cells before the hit.

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
            self.costs, self.columns, *window.geometry, window.size, layer.z_resolution, layer.origin_z, layer.z_voxels,
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


def adapt_voxels(section: Section) -> None:
    """Lower numbers that are too high for the layer, and take over the name of a third party's option.

    A lidar below the lowest voxel would mark, but never clear.
    """
    adapt(section)
    section.cap("origin_z", *LIDAR_PLANE)
    for name in ("z_voxels", "mark_threshold", "unknown_threshold"):
        section.cap(name, MOST_VOXELS, "a column has no more voxels in Nav2")
    if section.stand_in:
        clears = section.values.pop("update_footprint_enabled", True)
        section.values.setdefault("footprint_clearing_enabled", clears)


VOXEL_LAYER = LayerEntry(
    VoxelLayer,
    VoxelGrid,
    observes=True,
    check=check_combination,
    nav2=RosPlugin(
        in_every_release("nav2_costmap_2d::VoxelLayer"),
        "the voxel layer",
        VoxelLayer,
        replace(OBSTACLE_KEYS, ros_only=OBSTACLE_KEYS.ros_only | {"publish_voxel_map"}),
        stands_in_for=("SpatioTemporalVoxelLayer", "NonPersistentVoxelLayer"),
        adapt=adapt_voxels,
        arrange=name_lidar,
    ),
)
