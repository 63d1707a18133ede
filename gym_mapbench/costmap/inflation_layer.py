"""The inflation layer: cost around obstacles.

Source: nav2_costmap_2d/plugins/inflation_layer.cpp, legacy_inflation_layer.cpp (Lyrical).
"""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from gym_mapbench.costmap.grid import INSCRIBED_INFLATED_OBSTACLE, LETHAL_OBSTACLE
from gym_mapbench.costmap.layer import Box, Cells, Costs, Layer, LayerContext, LayerEntry, Window
from gym_mapbench.errors import ConfigError
from gym_mapbench.kernels.inflation import inflate, widen
from gym_mapbench.quantities import NonNegative
from gym_mapbench.releases import Release
from gym_mapbench.ros_params import Keys, RosPlugin, Section, in_every_release, since
from gym_mapbench.settings import ExtendedSettings
from gym_mapbench.world.scenario import Pose

MAX_REACH_CELLS = 2000
LEGACY = since("lyrical", "nav2_costmap_2d::LegacyInflationLayer")
"""The class of the inflation layer that finds distances as before Lyrical."""
EVERYWHERE = -math.inf, -math.inf, math.inf, math.inf


_FROM_FOOTPRINT = "the inscribed radius is the footprint's"


class InflationLayer(ExtendedSettings):
    """Nav2's ``InflationLayer``: cost around obstacles.

    Args:
        enabled: Whether the layer writes at all.
        inflation_radius: Reach, m, rounded up to whole cells.
        cost_scaling_factor: Decay of the cost, 1/m.
        inflate_unknown: Whether any cost replaces "unknown", not only an inscribed obstacle's.
        inflate_around_unknown: Whether unknown cells are inflated like obstacles.
        custom_inscribed_radius: Lyrical: radius around obstacles with the cost of a collision, m; the footprint's
            inscribed radius if it is negative.
        brushfire: Lyrical: whether the layer is the ``LegacyInflationLayer``, which finds distances as older releases.
    """

    newer: ClassVar[tuple[str, ...]] = ("custom_inscribed_radius", "brushfire")
    MISSING: ClassVar[Mapping[Release, Mapping[str, str]]] = {
        "humble": {"custom_inscribed_radius": _FROM_FOOTPRINT},
        "jazzy": {"custom_inscribed_radius": _FROM_FOOTPRINT},
    }

    enabled: bool = True
    inflation_radius: NonNegative = 0.55
    cost_scaling_factor: NonNegative = 10.0
    inflate_unknown: bool = False
    inflate_around_unknown: bool = False
    custom_inscribed_radius: float = -1.0
    brushfire: bool = False


@functools.lru_cache(maxsize=64)
def inflation_costs(
    layer: InflationLayer, reach: int, resolution: float, inscribed_radius: float, hundredths: bool = False
) -> NDArray[np.uint8]:
    """Cost ``(reach**2 + 1,)`` uint8 at every squared distance from an obstacle, in cells^2 (``computeCost``).

    With ``hundredths`` (Lyrical) the distance is rounded to 0.01 cell.
    """
    cells = np.sqrt(np.arange(reach * reach + 1))
    distance = (np.floor(cells * 100 + 0.5) / 100 if hundredths else cells) * resolution
    decay = np.exp(-layer.cost_scaling_factor * np.maximum(distance - inscribed_radius, 0.0))
    costs = np.where(distance <= inscribed_radius, INSCRIBED_INFLATED_OBSTACLE, np.trunc(252 * decay))
    costs[0] = LETHAL_OBSTACLE
    table = costs.astype(np.uint8)
    table.flags.writeable = False
    return table


class Inflation(Layer):
    """Inflates the obstacles that the layers before it wrote.

    Args:
        options: The layer's options.
        context: Gives the side of a cell, the inscribed radius and the release.

    Raises:
        ConfigError: If the inflation radius is more than 2000 cells.
    """

    def __init__(self, options: InflationLayer, context: LayerContext) -> None:
        self._options = options
        self._reach = math.ceil(options.inflation_radius / context.resolution)
        if self._reach > MAX_REACH_CELLS:
            raise ConfigError(f"inflation_radius: expected at most {MAX_REACH_CELLS} cells, got {self._reach}")
        release = context.costmap.release
        self._reset_is_news, self._exact = release != "humble", release == "lyrical" and not options.brushfire
        custom = options.custom_inscribed_radius
        inscribed_radius = context.footprint.inscribed_radius if custom < 0.0 else custom
        self._cost_of = inflation_costs(options, self._reach, context.resolution, inscribed_radius, self._exact)
        self._all_is_news = True
        self._last = np.array(EVERYWHERE)
        self._before: tuple[Cells, bytes] | None = None
        self._inflated = np.empty((0, 0), np.uint8)

    def reset(self) -> None:
        """Inflate everything again at the next update; Humble does not."""
        self._all_is_news |= self._reset_is_news

    def update_bounds(self, window: Window, robot: Pose, box: Box) -> None:
        """Widen the box by that of the last update, and by the inflation radius."""
        widen(box, self._last, self._options.inflation_radius)
        if self._all_is_news:
            box[:] = EVERYWHERE
        self._all_is_news = False

    def update_costs(self, window: Window, master: Costs, cells: Cells) -> None:
        """Inflate these cells; obstacles outside them count as far as they reach.

        The result depends on these cells and on those within reach. If they are those of the last update, so is the
        result: a robot that stands, as in a recovery, sees the same again and again.
        """
        if not self._options.enabled or self._reach == 0:
            return
        (row0, col0, row1, col1), reach = cells, self._reach
        around = master[max(0, row0 - reach) : row1 + reach, max(0, col0 - reach) : col1 + reach]
        before, inside = (cells, around.tobytes()), master[row0:row1, col0:col1]
        if before == self._before:
            inside[:] = self._inflated
            return
        unknown = self._options.inflate_unknown, self._options.inflate_around_unknown
        inflate(master, reach, self._cost_of, self._exact, *unknown, *cells)
        self._before, self._inflated = before, inside.copy()


def check_options(layer: InflationLayer, release: Release) -> None:
    """Refuse options that a release, or Lyrical's ``LegacyInflationLayer``, does not have.

    Raises:
        ConfigError: Beginning with the name of the option.
    """
    if release in InflationLayer.MISSING and layer.custom_inscribed_radius >= 0.0:
        raise ConfigError(f"custom_inscribed_radius: Nav2 {release.capitalize()} has none: {_FROM_FOOTPRINT}")
    if layer.brushfire and release != "lyrical":
        raise ConfigError(f"brushfire: expected false, as all layers of Nav2 {release.capitalize()} find distances so")
    if layer.brushfire and layer.custom_inscribed_radius >= 0.0:
        raise ConfigError(f"custom_inscribed_radius: the LegacyInflationLayer has none: {_FROM_FOOTPRINT}")


def adapt_legacy(group: Section) -> None:
    """Bring the section of Lyrical's other inflation layer into the form of the layer that finds distances so."""
    group.values["brushfire"] = True
    if "custom_inscribed_radius" in group.values:
        group.leave("custom_inscribed_radius")


def arrange(values: dict[str, Any], release: Release) -> dict[str, Any]:
    """Write the class of Lyrical's other inflation layer for the option."""
    return values | {"plugin": LEGACY[release]} if values.pop("brushfire", False) else values


INFLATION_LAYER = LayerEntry(
    InflationLayer,
    Inflation,
    widens_when_disabled=True,
    check=check_options,
    nav2=RosPlugin(
        in_every_release("nav2_costmap_2d::InflationLayer"),
        "the inflation layer",
        InflationLayer,
        Keys(
            ros_only=frozenset({"plugin"}),
            elsewhere={
                "cost_scaling_factor_left": "a parameter of the AsymmetricInflationLayer",
                "cost_scaling_factor_right": "a parameter of the AsymmetricInflationLayer",
                "num_threads": "it changes the computing time only",
            },
        ),
        stands_in_for=("AsymmetricInflationLayer",),
        arrange=arrange,
    ),
)
