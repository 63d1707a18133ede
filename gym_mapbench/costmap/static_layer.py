"""The static layer: the map's cells as costs.

Source: nav2_costmap_2d/plugins/static_layer.cpp.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gym_mapbench.costmap.grid import FREE_SPACE, LETHAL_OBSTACLE, NO_INFORMATION
from gym_mapbench.costmap.layer import Box, Cells, Costs, Layer, LayerContext, LayerEntry, Window
from gym_mapbench.costmap.options import CostmapOptions
from gym_mapbench.kernels.layers import MAX, TRUE_OVERWRITE, combine, write_map
from gym_mapbench.kernels.raytrace import touch
from gym_mapbench.ros_params import Keys, RosPlugin, in_every_release
from gym_mapbench.settings import Settings
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.scenario import Pose


class StaticLayer(Settings):
    """Nav2's ``StaticLayer``: writes the map.

    Args:
        enabled: Whether the layer writes.
    """

    enabled: bool = True


def static_costs(grid: GridMap, params: CostmapOptions) -> NDArray[np.uint8]:
    """Cost values ``(rows, cols)`` uint8 of the map's free, occupied and unknown cells (``interpretValue``)."""
    costs = np.where(grid.occupancy, _static_cost(100, params), _static_cost(0, params))
    if grid.unknown is not None:
        costs[grid.unknown] = _static_cost(NO_INFORMATION, params)
    return costs


def _static_cost(value: int, params: CostmapOptions) -> np.uint8:
    """Cost of one map value: 0 free, 100 occupied, 255 unknown."""
    if value == params.unknown_cost_value:
        return np.uint8(NO_INFORMATION if params.track_unknown_space else FREE_SPACE)
    if value >= params.lethal_cost_threshold:
        return np.uint8(LETHAL_OBSTACLE)
    scaled = FREE_SPACE if params.trinary_costmap else LETHAL_OBSTACLE * value // params.lethal_cost_threshold
    return np.uint8(scaled)


class StaticMap(Layer):
    """Writes the map: once into a costmap of the whole map, at every update into a rolling window.

    Args:
        options: The layer's options.
        context: The map, how it is read, and whether the window rolls.
    """

    def __init__(self, options: StaticLayer, context: LayerContext) -> None:
        costmap, grid = context.costmap, context.grid
        self._enabled, self._rolling, self._use_maximum = options.enabled, costmap.rolling_window, costmap.use_maximum
        self._costs = static_costs(grid, costmap)
        self._geometry = grid.resolution, *grid.origin
        self.reset()

    def reset(self) -> None:
        """Have the whole map written again."""
        self._has_news = True

    def update_bounds(self, window: Window, robot: Pose, box: Box) -> None:
        """Widen the box by the map, or by the whole of a rolling window.

        In a rolling window, Humble and Jazzy use the map's bounds instead of the window's. This makes no difference
        in the map frame, but is wrong in an odom frame; newer releases have corrected it, and so does this layer.
        """
        if self._rolling or self._has_news:
            for corner in window.corners:
                touch(box, *corner)
        self._has_news = False

    def update_costs(self, window: Window, master: Costs, cells: Cells) -> None:
        """Copy the map's cells; for a rolling window, look each of its cells up in the map."""
        if not self._enabled:
            return
        if not self._rolling:
            combine(master, self._costs, *cells, MAX if self._use_maximum else TRUE_OVERWRITE)
            return
        at = *self._geometry, *window.frame
        write_map(master, *window.geometry, self._costs, *at, *cells, self._use_maximum)


STATIC_LAYER = LayerEntry(
    StaticLayer,
    StaticMap,
    widens_when_disabled=True,
    nav2=RosPlugin(
        in_every_release("nav2_costmap_2d::StaticLayer"),
        "the static layer",
        StaticLayer,
        Keys(
            ros_only=frozenset(
                {"map_subscribe_transient_local", "map_topic", "plugin", "subscribe_to_updates", "transform_tolerance"}
            ),
            elsewhere={
                "footprint_clearing_enabled": "the static layer does not clear the footprint here",
                "restore_cleared_footprint": "the static layer does not clear the footprint here",
            },
        ),
    ),
)
