"""The speed filter: limits the speed of a robot in zones of the map.

Source: nav2_costmap_2d/plugins/costmap_filters/speed_filter.cpp (Humble, Jazzy and Lyrical).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gym_mapbench.costmap.filter_mask import UNKNOWN, FilterMask
from gym_mapbench.costmap.layer import Box, Cells, Costs, Layer, Window
from gym_mapbench.settings import Settings
from gym_mapbench.world.frames import compose
from gym_mapbench.world.scenario import Pose

NO_SPEED_LIMIT = 0.0
PERCENT = 100.0


class SpeedLimit(NamedTuple):
    """A speed limit, as the controllers get it.

    Args:
        speed: The limit, m/s or per cent of the controller's top speed; 0 for none.
        percentage: Whether it is in per cent.
    """

    speed: float
    percentage: bool


class SpeedFilter(Settings):
    """Nav2's ``SpeedFilter``: the limit is ``base`` + ``multiplier`` x the mask's value at the robot.

    Args:
        mask: The zones: 0 for no limit, else 1 to 100.
        base: Limit at a value of 0, m/s or per cent.
        multiplier: Change of the limit for each 1 of the value, m/s or per cent.
        percentage: Whether the limit is in per cent of the controller's top speed; else in m/s.
    """

    mask: FilterMask
    base: float = 0.0
    multiplier: float = 1.0
    percentage: bool = False

    def limit_of(self, value: int) -> float | None:
        """Return the limit for a value of the mask, 0 for none; None for an unknown cell, which changes nothing.

        A limit below 0, and in per cent one above 100, counts as none.
        """
        if value == UNKNOWN:
            return None
        if value == 0:
            return NO_SPEED_LIMIT
        limit = value * float(np.float32(self.multiplier)) + float(np.float32(self.base))
        return NO_SPEED_LIMIT if limit < 0.0 or (self.percentage and limit > PERCENT) else limit


class SpeedZones(Layer):
    """Publishes the speed limit at the robot's pose whenever it changes; costs stay as they are.

    Args:
        options: Options of the filter.
    """

    def __init__(self, options: SpeedFilter) -> None:
        self._options = options
        self._values = options.mask.values
        self._published = NO_SPEED_LIMIT
        self._news: list[SpeedLimit] = []

    def update_bounds(self, window: Window, robot: Pose, box: Box) -> None:
        """Remember the robot; the box stays as it is, as no cost changes."""
        self._robot = robot

    def update_costs(self, window: Window, master: Costs, cells: Cells) -> None:
        """Publish the limit at the robot if it is new; off the mask and on unknown cells the old limit stays."""
        cell = self._options.mask.cell_at(compose(window.frame, self._robot))
        limit = None if cell is None else self._options.limit_of(int(self._values[cell]))
        if limit is not None and limit != self._published:
            self._published = limit
            self._news.append(SpeedLimit(limit, self._options.percentage))

    def take_speed_limits(self) -> list[SpeedLimit]:
        """Return the limits published since the last call, in order."""
        news, self._news = self._news, []
        return news
