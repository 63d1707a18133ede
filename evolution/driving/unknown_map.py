"""Runs without the map: costmaps that only the robot's own sensors fill.

Nav2 without a map has the same set-up: no static layer, so a costmap has an origin and a size of its own, and a planner
whose paths may cross unknown cells.
"""

from __future__ import annotations

import math
from typing import Any

from controllers.base import Controller
from controllers.nav2_params import NavigationParams
from gym_mapbench.costmap import CostmapParams
from gym_mapbench.errors import ConfigError
from gym_mapbench.world.gridmap import GridMap

STATIC = "static_layer"
OF_THE_MAP = ("path", "costmap")
"""Keys of the observation that the env makes of the whole map."""


def without_map(navigation: NavigationParams, grid: GridMap) -> NavigationParams:
    """Return navigation that knows only the origin and size of the map.

    Args:
        navigation: With costmaps that :func:`check_sensors` accepts.
        grid: Gives origin and size to costmaps of the whole map.
    """
    changes: dict[str, Any] = {name: _without_static(one, grid) for name, one in navigation.costmaps.items()}
    planner = navigation.planner
    if "allow_unknown" in planner.params:  # other planners treat unknown cells by rules of their own
        changes["planner"] = planner.replace(params={**planner.params, "allow_unknown": True})
    return navigation.replace(**changes)


def check_sensors(navigation: NavigationParams) -> None:
    """Refuse a costmap that would stay empty without the map.

    Raises:
        ConfigError: Naming the costmap.
    """
    for name, costmap in navigation.costmaps.items():
        if costmap.writes(STATIC) and not costmap.observes:
            raise ConfigError(
                f"unknown_map: expected an obstacle layer or a voxel layer in the {name}, "
                f"because only the sensors fill it, got {', '.join(costmap.plugins)}"
            )


def check_observed(controller: Controller, name: str) -> None:
    """Refuse a controller that observes what the env makes of the map.

    Args:
        controller: The controller.
        name: Its name in tables and errors.

    Raises:
        ConfigError: Naming the controller and the keys.
    """
    if seen := [key for key in OF_THE_MAP if key in controller.observation_keys]:
        raise ConfigError(
            f"unknown_map: expected controllers that observe neither path nor costmap, which the env makes of the "
            f"map, got {name}, which observes {' and '.join(seen)}"
        )


def _without_static(costmap: CostmapParams, grid: GridMap) -> CostmapParams:
    """Leave out the static layer; a costmap of the whole map keeps its origin and its size, in whole metres."""
    if STATIC not in costmap.plugins:
        return costmap
    plugins = tuple(name for name in costmap.plugins if name != STATIC)
    if costmap.rolling_window:
        return costmap.replace(plugins=plugins)
    rows, cols = grid.shape
    return costmap.replace(
        plugins=plugins,
        track_unknown_space=True,
        resolution=grid.resolution,
        origin_x=grid.origin[0],
        origin_y=grid.origin[1],
        width=math.ceil(cols * grid.resolution - 1e-9),
        height=math.ceil(rows * grid.resolution - 1e-9),
    )
