"""The costmap layers by name: Nav2's own, and those of third parties.

A third party provides a :class:`~gym_mapbench.costmap.layer.LayerEntry`, named ``module:attribute``, registered here or
in the entry point group ``gym_mapbench.costmap_layers`` (see :mod:`gym_mapbench.registry`).
"""

from __future__ import annotations

from typing import Any

from gym_mapbench.costmap.denoise_layer import DENOISE_LAYER
from gym_mapbench.costmap.inflation_layer import INFLATION_LAYER
from gym_mapbench.costmap.layer import LayerEntry
from gym_mapbench.costmap.obstacle_layer import OBSTACLE_LAYER
from gym_mapbench.costmap.static_layer import STATIC_LAYER
from gym_mapbench.costmap.voxel_layer import VOXEL_LAYER
from gym_mapbench.registry import Registry, must_be, must_be_subclass
from gym_mapbench.settings import Settings


def _entry(made: Any) -> LayerEntry:
    """Accept a LayerEntry whose options are Settings."""
    entry = must_be(LayerEntry)(made)
    must_be_subclass(Settings)(entry.params)
    return entry


LAYERS: Registry[LayerEntry] = Registry(
    "costmap layer",
    "costmap_layers",
    {
        "static_layer": STATIC_LAYER,
        "obstacle_layer": OBSTACLE_LAYER,
        "voxel_layer": VOXEL_LAYER,
        "denoise_layer": DENOISE_LAYER,
        "inflation_layer": INFLATION_LAYER,
    },
    check=_entry,
)
