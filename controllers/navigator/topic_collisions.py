"""Collision checks of servers that get a costmap and a footprint as messages: behaviours and smoothers.

Source: nav2_costmap_2d (Humble and Jazzy) src/costmap_topic_collision_checker.cpp.
"""

from __future__ import annotations

from gym_mapbench.costmap import LETHAL_OBSTACLE, Costmap
from gym_mapbench.kernels.footprint import footprint_cost
from gym_mapbench.world.footprint import Footprint
from gym_mapbench.world.scenario import Pose


def is_collision_free(pose: Pose, costmap: Costmap, footprint: Footprint) -> bool:
    """Whether the outline at a pose touches neither an obstacle nor unknown space, and stays on the map."""
    if costmap.world_to_map(pose.x, pose.y) is None:
        return False
    return bool(footprint_cost(*costmap.grid, *pose, footprint.corners) < LETHAL_OBSTACLE)
