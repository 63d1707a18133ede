"""Costmaps as in Nav2: cost values on a grid, and the layers that write them.

What comes in is parameters, the static map, laser scans and the robot's pose; what goes out is a
:class:`Costmap`. ``params`` holds the options, ``scan`` turns a scan into points, every layer has a module of
its own, and ``layered_costmap`` lets them write in their order.
"""

from gym_mapbench.costmap.grid import (
    FREE_SPACE,
    INSCRIBED_INFLATED_OBSTACLE,
    LETHAL_OBSTACLE,
    NO_INFORMATION,
    Costmap,
)
from gym_mapbench.costmap.inflation_layer import inflation_costs
from gym_mapbench.costmap.layered_costmap import LayeredCostmap, build_static_costmap
from gym_mapbench.costmap.params import (
    CostmapParams,
    InflationLayer,
    ObservationSource,
    ObstacleLayer,
    StaticLayer,
    VoxelLayer,
)
from gym_mapbench.costmap.scan import LaserScan
from gym_mapbench.costmap.static_layer import static_costs

__all__ = [
    "FREE_SPACE",
    "INSCRIBED_INFLATED_OBSTACLE",
    "LETHAL_OBSTACLE",
    "NO_INFORMATION",
    "Costmap",
    "CostmapParams",
    "InflationLayer",
    "LaserScan",
    "LayeredCostmap",
    "ObservationSource",
    "ObstacleLayer",
    "StaticLayer",
    "VoxelLayer",
    "build_static_costmap",
    "inflation_costs",
    "static_costs",
]
