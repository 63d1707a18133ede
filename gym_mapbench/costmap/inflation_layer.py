"""The inflation layer: cost around obstacles.

Source: nav2_costmap_2d/plugins/inflation_layer.cpp.
"""

from __future__ import annotations

import functools
import math

import numpy as np
from numpy.typing import NDArray

from gym_mapbench.costmap.grid import INSCRIBED_INFLATED_OBSTACLE, LETHAL_OBSTACLE
from gym_mapbench.costmap.layer import Box, Cells, Costs, Layer, Window
from gym_mapbench.costmap.params import CostmapParams, InflationLayer
from gym_mapbench.errors import ConfigError
from gym_mapbench.kernels.inflation import inflate, widen
from gym_mapbench.world.footprint import Footprint
from gym_mapbench.world.scenario import Pose

MAX_REACH_CELLS = 2000
EVERYWHERE = -math.inf, -math.inf, math.inf, math.inf


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


class Inflation(Layer):
    """Inflates what the layers before it wrote.

    Args:
        params: The layer's options, and the release.
        resolution: Side of a cell, m.
        footprint: Gives the inscribed radius.

    Raises:
        ConfigError: If the inflation radius is more than 2000 cells.
    """

    def __init__(self, params: CostmapParams, resolution: float, footprint: Footprint) -> None:
        self._params = params.inflation_layer
        self._reach = math.ceil(self._params.inflation_radius / resolution)
        if self._reach > MAX_REACH_CELLS:
            raise ConfigError(f"inflation_radius: expected at most {MAX_REACH_CELLS} cells, got {self._reach}")
        self._cost_of = inflation_costs(self._params, self._reach, resolution, footprint.inscribed_radius)
        self._reset_is_news = params.release == "jazzy"
        self._all_is_news = True
        self._last = np.array(EVERYWHERE)

    def reset(self) -> None:
        """Inflate everything again at the next update; only Jazzy does so."""
        self._all_is_news |= self._reset_is_news

    def update_bounds(self, window: Window, robot: Pose, box: Box) -> None:
        """Widen the box by that of the last update, and by the inflation radius."""
        widen(box, self._last, self._params.inflation_radius)
        if self._all_is_news:
            box[:] = EVERYWHERE
        self._all_is_news = False

    def update_costs(self, window: Window, master: Costs, cells: Cells) -> None:
        """Inflate these cells; obstacles outside them count as far as they reach."""
        if not self._params.enabled or self._reach == 0:
            return
        options = self._params.inflate_unknown, self._params.inflate_around_unknown
        inflate(master, self._reach, self._cost_of, *options, *cells)
