"""Costmaps as in Nav2: cost values on a grid, and the layers that write them.

A :class:`LayeredCostmap` takes parameters, the static map, laser scans and the robot's pose, and returns a
:class:`Costmap`. Every layer has a module of its own with its options, its code and its names in Nav2; ``layers`` is
the registry of the layers, ``params`` holds the options, and ``scan`` turns a scan into points.
"""

from gym_mapbench.costmap.denoise_layer import DenoiseLayer
from gym_mapbench.costmap.filter_mask import FILTER_SERVERS, INFO_SERVERS, MASK_SERVERS, FilterMask
from gym_mapbench.costmap.grid import (
    FREE_SPACE,
    INSCRIBED_INFLATED_OBSTACLE,
    LETHAL_OBSTACLE,
    NO_INFORMATION,
    Costmap,
)
from gym_mapbench.costmap.inflation_layer import InflationLayer, inflation_costs
from gym_mapbench.costmap.keepout_filter import KeepoutFilter
from gym_mapbench.costmap.layer import Layer, LayerContext, LayerEntry, Window
from gym_mapbench.costmap.layered_costmap import LayeredCostmap, build_static_costmap
from gym_mapbench.costmap.layers import LAYERS
from gym_mapbench.costmap.obstacle_layer import OBSERVATION_SOURCE, ObservationSource, ObstacleLayer
from gym_mapbench.costmap.params import COSTMAPS, FILTERS, CostmapParams
from gym_mapbench.costmap.scan import LaserScan
from gym_mapbench.costmap.speed_filter import SpeedFilter, SpeedLimit
from gym_mapbench.costmap.static_layer import StaticLayer, static_costs
from gym_mapbench.costmap.voxel_layer import VoxelLayer

__all__ = [
    "COSTMAPS",
    "FILTERS",
    "FILTER_SERVERS",
    "FREE_SPACE",
    "INFO_SERVERS",
    "INSCRIBED_INFLATED_OBSTACLE",
    "LAYERS",
    "LETHAL_OBSTACLE",
    "MASK_SERVERS",
    "NO_INFORMATION",
    "OBSERVATION_SOURCE",
    "Costmap",
    "CostmapParams",
    "DenoiseLayer",
    "FilterMask",
    "InflationLayer",
    "KeepoutFilter",
    "LaserScan",
    "Layer",
    "LayerContext",
    "LayerEntry",
    "LayeredCostmap",
    "ObservationSource",
    "ObstacleLayer",
    "SpeedFilter",
    "SpeedLimit",
    "StaticLayer",
    "VoxelLayer",
    "Window",
    "build_static_costmap",
    "inflation_costs",
    "static_costs",
]
