"""Ghosts: cells that a person marked and has left. Which parameters clear them, as users of Nav2 report."""

from __future__ import annotations

import math

import numpy as np
import pytest

from gym_mapbench.costmap import (
    LETHAL_OBSTACLE,
    CostmapParams,
    LaserScan,
    LayeredCostmap,
    ObservationSource,
    ObstacleLayer,
    VoxelLayer,
)
from gym_mapbench.world.bodies import Body
from gym_mapbench.world.footprint import Footprint
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.lidar import Lidar, LidarSettings
from gym_mapbench.world.scenario import Pose
from gym_mapbench.world.world import World

OPEN = GridMap(np.zeros((160, 160), bool))
"""The edge of the map is a wall; it is 4 m away from the robot."""
ROBOT = Pose(4.0, 4.0)
RADIUS = 0.25
WALK = {"name": "scripted", "options": {"waypoints": [[5.0, 2.6], [5.0, 7.5]], "speed": 1.0}}
"""A person crosses 1 m in front of the robot within 3 s."""
BETWEEN = 3
"""Cells of the trail that may lie between two rays of one scan."""
KINDS = {"obstacle_layer": ObstacleLayer, "voxel_layer": VoxelLayer}


def ghosts(range_max, name="obstacle_layer", period=0.2, seconds=3.0, **options):
    """Number of marked cells that are more than two cells away from the person, after every update."""
    source = ObservationSource(max_obstacle_height=2.0, **{"clearing": True, **options})
    layers = {"plugins": (name,), name: KINDS[name](scan=source)}
    costmap = LayeredCostmap(CostmapParams.example_local(**layers), OPEN, Footprint.from_radius(0.22))
    world = World(OPEN, [Body(motion=WALK)])
    settings = LidarSettings(range_max=range_max)
    lidar, left = Lidar(settings, world), []
    for _ in range(round(seconds / period)):
        ranges = lidar.scan(ROBOT)
        ranges = np.where(ranges >= range_max, np.inf, ranges)
        costmap.observe(LaserScan(ranges, 0.0, 2 * math.pi / 360, 0.12, range_max), ROBOT, 0.132)
        seen = costmap.update(ROBOT)
        rows, cols = np.nonzero(seen.costs == LETHAL_OBSTACLE)
        x = seen.origin_x + (cols + 0.5) * seen.resolution
        y = seen.origin_y + (rows + 0.5) * seen.resolution
        away = np.hypot(x - world.poses[0, 0], y - world.poses[0, 1]) - RADIUS
        left.append(int((away > 2 * seen.resolution).sum()))
        world.advance(round(period * world.physics_hz))
    return left


@pytest.mark.parametrize("name", KINDS)
def test_rays_without_return_leave_a_trail_unless_inf_is_valid(name):
    trail = ghosts(3.5, name)
    assert trail[-1] > 20, "the walls are out of range, so no ray clears the cells"
    assert max(ghosts(3.5, name, inf_is_valid=True)) <= BETWEEN


@pytest.mark.parametrize("name", KINDS)
def test_rays_that_end_at_a_wall_clear_the_trail_as_far_as_they_are_traced(name):
    assert max(ghosts(20.0, name)) <= BETWEEN
    assert ghosts(20.0, name, raytrace_max_range=0.7)[-1] > 20
    assert ghosts(20.0, name, clearing=False)[-1] > 20


def test_nothing_is_left_where_hits_are_marked_no_farther_than_rays_are_traced():
    assert ghosts(20.0, raytrace_max_range=0.7, obstacle_max_range=0.7) == [0] * 15
