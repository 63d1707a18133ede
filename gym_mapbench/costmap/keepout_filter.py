"""The keepout filter: raises the costs of zones that the robot shall not enter.

Source: nav2_costmap_2d/plugins/costmap_filters/keepout_filter.cpp (Humble, Jazzy and Lyrical).
"""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from gym_mapbench.costmap.filter_mask import UNKNOWN, FilterMask
from gym_mapbench.costmap.grid import INSCRIBED_INFLATED_OBSTACLE, LETHAL_OBSTACLE, NO_INFORMATION
from gym_mapbench.costmap.layer import Box, Cells, Costs, Layer, Window
from gym_mapbench.kernels.filters import NO_OVERRIDE, write_mask
from gym_mapbench.kernels.raytrace import touch
from gym_mapbench.releases import Release
from gym_mapbench.settings import Settings
from gym_mapbench.world.frames import IDENTITY, compose
from gym_mapbench.world.scenario import Pose

HIGHEST_OVERRIDE = 252
"""Highest cost that is no obstacle."""
LETHAL = (INSCRIBED_INFLATED_OBSTACLE, LETHAL_OBSTACLE)


class KeepoutFilter(Settings):
    """Nav2's ``KeepoutFilter``.

    Args:
        mask: The zones: values from 0, free, to 100, lethal.
        override_lethal_cost: Since Jazzy: whether a robot inside a lethal zone sees ``lethal_override_cost`` there.
        lethal_override_cost: Since Jazzy: that cost.
    """

    mask: FilterMask
    override_lethal_cost: bool = False
    lethal_override_cost: Annotated[int, Field(ge=0, le=HIGHEST_OVERRIDE)] = HIGHEST_OVERRIDE


def mask_costs(mask: FilterMask) -> Costs:
    """Return the costs of a mask, ``(rows, cols)`` uint8: 0 to 100 becomes 0 to 254 (``getMaskCost``)."""
    values = mask.values
    costs = np.floor(values.astype(np.float64) * LETHAL_OBSTACLE / 100.0 + 0.5)
    costs[values == UNKNOWN] = NO_INFORMATION
    return costs.astype(np.uint8)


class Keepout(Layer):
    """Writes the mask's costs over the layers' where they are higher.

    Args:
        options: Options of the filter.
        release: Release of Nav2. Since Jazzy a new mask widens the first update. In Lyrical the zones that were
            overridden are updated by the layers as well, in Jazzy by the filter alone.
    """

    def __init__(self, options: KeepoutFilter, release: Release) -> None:
        self._options, self._release = options, release
        self._costs = mask_costs(options.mask)
        self._geometry = options.mask.geometry
        self._was_lethal = self._is_lethal = False
        self.reset()

    def reset(self) -> None:
        """Take the mask anew (``initializeFilter``): since Jazzy it then widens the next update."""
        self._has_news = self._release != "humble"
        self._touched_box = _nothing()
        self._touched_cells: Cells | None = None

    def update_bounds(self, window: Window, robot: Pose, box: Box) -> None:
        """Widen the box by a new mask, and in Lyrical by what was touched while the robot was in a lethal zone."""
        if self._has_news:
            self._has_news = False
            self._touch_mask(window, box)
            if self._release == "lyrical":
                return
        if self._options.override_lethal_cost:
            self._is_lethal = self._cost_at(window, robot) in LETHAL
            if self._release == "lyrical":
                self._widen_box(box)

    def update_costs(self, window: Window, master: Costs, cells: Cells) -> None:
        """Raise the costs of these cells; see :func:`~gym_mapbench.kernels.filters.write_mask`."""
        overlap = self._overlap(window, cells)
        if overlap is None:
            return
        if self._options.override_lethal_cost and self._release != "lyrical":
            overlap = self._widen_cells(overlap)
        override = self._options.lethal_override_cost if self._is_lethal else NO_OVERRIDE
        at = *self._geometry, *window.frame
        write_mask(master, *window.geometry, self._costs, *at, *overlap, override)
        self._was_lethal = self._is_lethal

    def _touch_mask(self, window: Window, box: Box) -> None:
        """Widen the box by as many cells of the costmap as the mask has, as Nav2 does."""
        resolution, x, y = window.geometry
        rows, cols = self._costs.shape
        touch(box, x + 0.5 * resolution, y + 0.5 * resolution)
        touch(box, x + (cols + 0.5) * resolution, y + (rows + 0.5) * resolution)

    def _cost_at(self, window: Window, robot: Pose) -> int | None:
        """Return the mask's cost at the robot; None off the mask."""
        cell = self._options.mask.cell_at(compose(window.frame, robot))
        return None if cell is None else int(self._costs[cell])

    def _widen_box(self, box: Box) -> None:
        """Widen the box by all boxes since the robot came into a lethal zone, until it has left."""
        if not (self._is_lethal or self._was_lethal):
            self._touched_box = _nothing()
            return
        touched = self._touched_box
        box[:2], box[2:] = np.minimum(box[:2], touched[:2]), np.maximum(box[2:], touched[2:])
        self._touched_box = box.copy()

    def _widen_cells(self, cells: Cells) -> Cells:
        """Return the cells with all cells since the robot came into a lethal zone, until it has left."""
        if not (self._is_lethal or self._was_lethal):
            self._touched_cells = None
            return cells
        before = self._touched_cells or cells
        low, high = np.minimum(cells, before).tolist(), np.maximum(cells, before).tolist()
        self._touched_cells = low[0], low[1], high[2], high[3]
        return self._touched_cells

    def _overlap(self, window: Window, cells: Cells) -> Cells | None:
        """Return the cells that Nav2 looks at: of a costmap in the mask's frame those on the mask; None for none."""
        if window.frame != IDENTITY:
            return cells
        resolution, x, y = self._geometry
        rows, cols = self._costs.shape
        half = 0.5 * resolution
        row0, col0 = _cell_of(window, x + half, y + half)
        row1, col1 = _cell_of(window, x + cols * resolution + half, y + rows * resolution + half)
        first, last = (max(cells[0], row0), max(cells[1], col0)), (min(cells[2], row1), min(cells[3], col1))
        if first[0] >= last[0] or first[1] >= last[1]:
            return None
        return *first, *last


def _cell_of(window: Window, x: float, y: float) -> tuple[int, int]:
    """Return row and column of a point, rounded towards zero, also off the costmap (``worldToMapNoBounds``)."""
    resolution, origin_x, origin_y = window.geometry
    return int((y - origin_y) / resolution), int((x - origin_x) / resolution)


def _nothing() -> Box:
    """Return an empty box."""
    return np.array([np.inf, np.inf, -np.inf, -np.inf])
