"""The denoise layer: small groups of obstacle cells are removed from the costmap.

Source: nav2_costmap_2d/plugins/denoise_layer.cpp, include/nav2_costmap_2d/denoise/image_processing.hpp. The layer came
with Iron and was added to Humble in a later patch release (1.1.x); early installations of Humble lack it.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from gym_mapbench.costmap.grid import NO_INFORMATION
from gym_mapbench.costmap.layer import Box, Cells, Costs, Layer, LayerContext, LayerEntry, Window
from gym_mapbench.kernels.denoise import remove_groups, remove_isolated
from gym_mapbench.ros_params import Keys, RosPlugin, Section, in_every_release
from gym_mapbench.settings import Settings
from gym_mapbench.world.scenario import Pose


class DenoiseLayer(Settings):
    """Nav2's ``DenoiseLayer``: removes groups of obstacle cells that are too small.

    Args:
        enabled: Whether the layer removes anything.
        minimal_group_size: Cells of the smallest group that stays; with 1 or less all groups stay.
        group_connectivity_type: Neighbours of a cell that belong to its group, 4 or 8.
    """

    enabled: bool = True
    minimal_group_size: Annotated[int, Field(lt=2**31)] = 2
    group_connectivity_type: Literal[4, 8] = 8


class Denoise(Layer):
    """Removes small groups of the obstacle cells that the layers before it wrote; a removed cell is free.

    Obstacle cells are those of cost 253 and 254, and of 255 in a costmap whose default is not "unknown". Only the cells
    of an update count: of a group that extends beyond them, only the part inside is counted.

    Args:
        options: The layer's options.
        context: Says whether unknown cells are obstacles.
    """

    def __init__(self, options: DenoiseLayer, context: LayerContext) -> None:
        self._smallest = options.minimal_group_size
        self._kind = options.group_connectivity_type == 8, context.costmap.default_cost != NO_INFORMATION

    def update_bounds(self, window: Window, robot: Pose, box: Box) -> None:
        """Leave the box as it is: the layer writes nothing of its own."""

    def update_costs(self, window: Window, master: Costs, cells: Cells) -> None:
        """Remove the small groups among these cells."""
        if self._smallest == 2:
            remove_isolated(master, *self._kind, *cells)
        elif self._smallest > 2:
            remove_groups(master, self._smallest, *self._kind, *cells)


def adapt(section: Section) -> None:
    """Take 8 for a connectivity that is neither 4 nor 8, as Nav2 does."""
    section.correct("group_connectivity_type", (4, 8), 8)


DENOISE_LAYER = LayerEntry(
    DenoiseLayer,
    Denoise,
    nav2=RosPlugin(
        in_every_release("nav2_costmap_2d::DenoiseLayer"),
        "the denoise layer",
        DenoiseLayer,
        Keys(ros_only=frozenset({"plugin"})),
        adapt=adapt,
    ),
)
