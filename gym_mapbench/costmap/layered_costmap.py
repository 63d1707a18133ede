"""LayeredCostmap: layers that write one after the other, over the map or in a window that rolls with the robot.

Source: nav2_costmap_2d/src/layered_costmap.cpp.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gym_mapbench.costmap.grid import Costmap
from gym_mapbench.costmap.inflation_layer import Inflation, InflationLayer
from gym_mapbench.costmap.keepout_filter import Keepout
from gym_mapbench.costmap.layer import Box, Cells, Costs, Layer, LayerContext, Window
from gym_mapbench.costmap.layers import LAYERS
from gym_mapbench.costmap.params import CostmapParams
from gym_mapbench.costmap.scan import LaserScan
from gym_mapbench.costmap.speed_filter import SpeedLimit, SpeedZones
from gym_mapbench.costmap.static_layer import static_costs
from gym_mapbench.errors import ConfigError, PluginError
from gym_mapbench.kernels.layers import shifted
from gym_mapbench.world.footprint import Footprint
from gym_mapbench.world.frames import IDENTITY
from gym_mapbench.world.gridmap import MAX_CELLS, GridMap
from gym_mapbench.world.scenario import Pose


def build_static_costmap(grid: GridMap, params: CostmapParams, footprint: Footprint) -> Costmap:
    """Build the costmap of the whole map, from the static and the inflation layer alone.

    Args:
        grid: The map; it gives size, resolution and origin.
        params: Which of the two layers write, and how.
        footprint: Gives the inscribed radius.

    Raises:
        ConfigError: If the inflation radius is more than 2000 cells.
    """
    empty = np.full(grid.shape, params.default_cost, np.uint8)
    costs = static_costs(grid, params) if params.writes("static_layer") else empty
    if params.writes("inflation_layer"):
        window = Window(grid.shape, grid.resolution, *grid.origin)
        context = LayerContext(params, grid, grid.shape, grid.resolution, footprint)
        Inflation(params.inflation_layer, context).update_costs(window, costs, (0, 0, *grid.shape))
    return Costmap(costs, grid.resolution, *grid.origin, params.track_unknown_space)


class LayeredCostmap:
    """One of Nav2's costmaps with its layers: the global one on the map, or the local one, a window that rolls.

    An update writes only the box in which the layers report changes; cells outside it keep their values. Filters work
    on a copy of the layers' cells, which the layers do not see.

    Args:
        params: Layers and size.
        grid: The static map; only ``static_layer`` looks at it.
        footprint: The padded footprint; gives the inscribed radius, and the cells that footprint clearing frees.

    Raises:
        ConfigError: If the costmap has no cells or too many, or the inflation radius is more than 2000 cells.
    """

    _written: Costs
    _filtered: Costs | None
    _unchanging: Costmap | None
    _filters: list[Layer]

    def __init__(self, params: CostmapParams, grid: GridMap, footprint: Footprint) -> None:
        self._params, self._grid, self._footprint = params, grid, footprint
        self._default = params.default_cost
        self._start_over()
        self._never_changes = not (params.observes or params.follows_robot)

    def reset(self, pose: Pose) -> None:
        """Forget all observations and place the window around ``pose`` as at start-up."""
        self._start_over()
        self._roll(pose)

    def clear(self, plugins: Sequence[str] = ()) -> None:
        """Forget all cells ("clear entirely"); the newest scan fills them again at the next update.

        Args:
            plugins: Lyrical: names of the layers whose cells alone are forgotten beside those of the costmap; none for
                all layers. Other layers write their cells again only where an update changes the costmap.
        """
        self._master.fill(self._default)
        self._unchanging = None
        for name, layer in self._layers.items():
            if not plugins:
                layer.reset()
            elif name in plugins:
                layer.clear_cells()
        if not plugins:
            for each in self._filters:
                each.reset()

    def clear_square(self, x: float, y: float, side: float, *, outside: bool, plugins: Sequence[str] = ()) -> bool:
        """Forget what the layers that look at scans know of a square (``clearRegion``).

        Args:
            x: x of its middle, m, in the costmap's frame.
            y: y of its middle, m.
            side: Its side, m.
            outside: Whether the layers forget everything but the square.
            plugins: Lyrical: names of the layers; none for all of them.

        Returns:
            Whether there is such a layer; the costmap is then out of date until its next update.
        """
        chosen = [name for name in self._params.clearable if name in self._layers and (not plugins or name in plugins)]
        for name in chosen:
            self._layers[name].clear_square(self._window.cells_within(x, y, side), outside=outside)
        return bool(chosen)

    def observe(self, scan: LaserScan, sensor: Pose, height: float = 0.0) -> None:
        """Give the layers a new scan; every update uses it until there is a newer one.

        Args:
            scan: The scan.
            sensor: Pose of the lidar when it was taken, m and rad, in the costmap's frame.
            height: Height of the lidar above the ground, m.
        """
        for layer in self._layers.values():
            layer.observe(scan, sensor, height)

    def update(self, pose: Pose, frame: Pose = IDENTITY) -> Costmap:
        """Run one update cycle and return the costmap; call it at ``update_frequency``.

        Args:
            pose: Pose of the robot, m and rad, in the costmap's frame.
            frame: Pose of the costmap's frame in the map's; a rolling static layer needs it.
        """
        if self._unchanging is not None:
            return self._unchanging
        self._window.frame = frame
        self._roll(pose)
        self._write_layers(pose)
        costmap = Costmap(self._master.copy(), *self._window.geometry, self._params.track_unknown_space)
        if self._never_changes:
            self._unchanging = costmap
        return costmap

    def layer(self, name: str) -> Layer:
        """Return a layer by its name in ``plugins``.

        Raises:
            KeyError: If no layer of this name writes.
        """
        return self._layers[name]

    def take_speed_limits(self) -> list[SpeedLimit]:
        """Return the speed limits that the filters published since the last call, in order."""
        return [limit for zones in self._speed_zones for limit in zones.take_speed_limits()]

    @property
    def _master(self) -> Costs:
        """The cells of the costmap, behind the filters if there are any."""
        return self._written if self._filtered is None else self._filtered

    def _start_over(self) -> None:
        params, grid = self._params, self._grid
        self._window = _window(params, grid)
        context = LayerContext(params, grid, self._window.shape, self._window.resolution, self._footprint)
        speeds = {name: SpeedZones(options) for name, options in params.speed_filters.items()}
        filters: dict[str, Layer] = {
            **{name: Keepout(options, params.release) for name, options in params.keepout_filters.items()},
            **speeds,
            **{name: _inflation(name, layer, context) for name, layer in params.inflation_filters.items()},
        }
        among = params.filters_among_layers
        self._speed_zones = list(speeds.values())
        self._filters = [each for name, each in filters.items() if name not in among]
        self._layers = {
            name: filters[name] if name in among else _make_layer(name, params, context)
            for name in params.plugins
            if name in among or params.writes(name) or LAYERS.get(name).widens_when_disabled
        }
        self._written = np.full(self._window.shape, self._default, np.uint8)
        self._filtered = self._written.copy() if self._filters else None
        self._unchanging = None

    def _roll(self, pose: Pose) -> None:
        """Shift the window by whole cells to the robot; cells that stay keep their costs."""
        moved = self._window.roll(pose) if self._params.rolling_window else (0, 0)
        if moved != (0, 0):
            self._written = shifted(self._written, *moved, self._default)
            if self._filtered is not None:
                self._filtered = shifted(self._filtered, *moved, self._default)
            for layer in self._layers.values():
                layer.roll(*moved)

    def _write_layers(self, pose: Pose) -> None:
        """Collect the box of all changes, then let the layers write it in the order of ``plugins``."""
        box = np.array([np.inf, np.inf, -np.inf, -np.inf])
        for layer in self._layers.values():
            layer.update_bounds(self._window, pose, box)
        for each in self._filters:
            each.update_bounds(self._window, pose, box)
        row0, col0, row1, col1 = cells = self._window.cells_in(box)
        if row1 < row0 or col1 < col0:
            return
        self._written[row0:row1, col0:col1] = self._default
        for layer in self._layers.values():
            layer.update_costs(self._window, self._written, cells)
        self._filter(cells)

    def _filter(self, cells: Cells) -> None:
        """Let the filters work on the cells that the layers have written."""
        if self._filtered is None:
            return
        row0, col0, row1, col1 = cells
        self._filtered[row0:row1, col0:col1] = self._written[row0:row1, col0:col1]
        for each in self._filters:
            each.update_costs(self._window, self._filtered, cells)


def _window(params: CostmapParams, grid: GridMap) -> Window:
    """Where a costmap lies at start-up: on the map if it shows all of it, else where the options say."""
    if params.covers_map:
        return Window(grid.shape, grid.resolution, *grid.origin, release=params.release)
    rows, cols = int(params.height / params.resolution), int(params.width / params.resolution)
    if not 0 < rows * cols <= MAX_CELLS:
        raise ConfigError(f"costmap: expected width x height of 1 to {MAX_CELLS} cells, got {cols} x {rows}")
    return Window((rows, cols), params.resolution, params.origin_x, params.origin_y, release=params.release)


def _make_layer(name: str, params: CostmapParams, context: LayerContext) -> Layer:
    """Make a layer by its name in ``plugins``; that of a third party is guarded."""
    with LAYERS.blamed(name):
        layer = LAYERS.get(name).make(params.layers[name], context)
    if not isinstance(layer, Layer):
        raise PluginError(f"costmap layer {name!r}: expected a Layer, got {layer!r:.80}")
    return layer if name in LAYERS.built_in else _GuardedLayer(name, layer)


def _inflation(name: str, options: InflationLayer, context: LayerContext) -> Inflation:
    """Make an inflation layer that works behind the filters."""
    try:
        return Inflation(options, context)
    except ConfigError as error:
        raise ConfigError(f"inflation_filters.{name}.{error}") from None


class _GuardedLayer(Layer):
    """A third party's layer, whose errors and wrong answers are reported in one line with its name."""

    def __init__(self, name: str, layer: Layer) -> None:
        self._name, self._layer = name, layer

    def reset(self) -> None:
        with LAYERS.blamed(self._name):
            self._layer.reset()

    def clear_cells(self) -> None:
        with LAYERS.blamed(self._name):
            self._layer.clear_cells()

    def clear_square(self, cells: Cells, *, outside: bool) -> None:
        with LAYERS.blamed(self._name):
            self._layer.clear_square(cells, outside=outside)

    def roll(self, d_row: int, d_col: int) -> None:
        with LAYERS.blamed(self._name):
            self._layer.roll(d_row, d_col)

    def observe(self, scan: LaserScan, sensor: Pose, height: float) -> None:
        with LAYERS.blamed(self._name):
            self._layer.observe(scan, sensor, height)

    def update_bounds(self, window: Window, robot: Pose, box: Box) -> None:
        with LAYERS.blamed(self._name):
            self._expect_none("update_bounds", self._layer.update_bounds(replace(window), robot, box))
        if np.isnan(box).any():
            raise PluginError(f"costmap layer {self._name!r}: expected a box of numbers, got {box.tolist()}")

    def update_costs(self, window: Window, master: Costs, cells: Cells) -> None:
        with LAYERS.blamed(self._name):
            self._expect_none("update_costs", self._layer.update_costs(replace(window), master, cells))

    def _expect_none(self, method: str, answer: object) -> None:
        """Refuse an array that a layer returns instead of writing into the one that it was given."""
        if answer is not None:
            raise PluginError(
                f"costmap layer {self._name!r}: expected {method} to write into its argument and return None, got "
                f"{answer!r:.80}"
            )
