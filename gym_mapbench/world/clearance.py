"""Clearance: the distance from the robot's outline to walls, and room for it beside walls and bodies."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gym_mapbench.errors import ConfigError
from gym_mapbench.kernels.clearance import clearances_of_disc, clearances_of_polygon
from gym_mapbench.kernels.motion import GROUND, MARGIN, is_clear
from gym_mapbench.world.courses import check_courses
from gym_mapbench.world.crowd import place_crowd
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.noise import NoiseSettings, disturb_pose
from gym_mapbench.world.proximity import Proximity, counter_clockwise
from gym_mapbench.world.robot import RobotSpec
from gym_mapbench.world.scenario import Pose, Scenario
from gym_mapbench.world.state import ground_of

MAX_SAMPLES = 1000
CLEAR_SECONDS = 3.0
"""Seconds from the start on for which a body with a course must leave start and goal clear."""
CLEAR_TIMES = np.linspace(0.0, CLEAR_SECONDS, 31)


def measure_clearance(grid: GridMap, robot: RobotSpec, poses: ArrayLike) -> NDArray[np.float64]:
    """Return the exact distance from the robot's outline to the nearest wall, ``(n,)`` m.

    The map's edge is a wall; unknown cells are free. The clearance of a disc that overlaps a wall is minus the depth of
    the overlap; the clearance of a polygon is then 0.

    Args:
        grid: The map.
        robot: Its shape.
        poses: ``(n, 3)`` or more columns, x, y (m), yaw (rad); on the map.
    """
    states = np.ascontiguousarray(np.atleast_2d(np.asarray(poses, dtype=np.float64))[:, :3])
    area: NDArray[np.float64] = np.array(grid.bounds)
    clearances: NDArray[np.float64]
    if robot.footprint is None:
        clearances = clearances_of_disc(grid.boxes, area, states, robot.radius)
    else:
        clearances = clearances_of_polygon(grid.boxes, area, states, counter_clockwise(np.asarray(robot.footprint)))
    return clearances


def check_clearance(scenario: Scenario, robot: RobotSpec) -> None:
    """Refuse a task whose start or goal the robot cannot stand on, or whose bodies walk through walls.

    Raises:
        ConfigError: If the robot would touch a wall there, or a body at time 0; a body with a course must stay away for
            :data:`CLEAR_SECONDS`, and its course clear of walls.
    """
    if scenario.bodies:
        check_courses(scenario.map, scenario.bodies)
    for what, pose in (("start", scenario.start), ("goal", scenario.goal)):
        obstacle = find_obstacle(scenario, robot, pose)
        if obstacle:
            raise ConfigError(
                f"{what}: expected room for the robot ({robot.name}), got {obstacle} that touches it at "
                f"({pose.x:g}, {pose.y:g}, {pose.yaw:g})"
            )


def find_obstacle(scenario: Scenario, robot: RobotSpec, pose: Pose) -> str:
    """Name what the robot touches at a pose on the map while it has not left; empty if the robot has room.

    Bodies count at time 0, and bodies with a course for :data:`CLEAR_SECONDS`.
    """
    if not has_room(scenario.map, robot, pose):
        return "a wall"
    if not scenario.bodies:
        return ""
    for number in np.flatnonzero(_gaps_at_first(scenario, robot, pose) <= 0.0)[:1].tolist():
        return f"body {number} ({scenario.bodies[number].motion.name})"
    return ""


def _gaps_at_first(scenario: Scenario, robot: RobotSpec, pose: Pose) -> NDArray[np.float64]:
    """Return the smallest distance from the robot's outline to every body while it has not left, ``(bodies,)`` m."""
    bodies = scenario.bodies
    places = np.ascontiguousarray(place_crowd(scenario.map, bodies, CLEAR_TIMES).swapaxes(0, 1))
    radii = np.empty(places.shape[:2])
    radii[:] = np.array([body.shape.radius for body in bodies])[:, None]
    radii[[not body.motion.keeps_to_course for body in bodies], 1:] = 0.0
    return Proximity(robot).gaps(np.tile(np.array(pose), (len(bodies), 1)), places, radii)


def has_room(grid: GridMap, robot: RobotSpec, pose: Pose) -> bool:
    """Whether the robot touches no wall at a pose on the map; walls are measured only where some are near."""
    walls, reach = grid.framed.reshape(-1), robot.circumscribed_radius + MARGIN
    if is_clear(walls, np.array([ground_of(grid)], GROUND), 0, pose.x, pose.y, reach):
        return True
    return bool(measure_clearance(grid, robot, [pose])[0] > 0)


def sample_start(scenario: Scenario, robot: RobotSpec, noise: NoiseSettings, rng: np.random.Generator) -> Pose:
    """Sample the true start pose: the scenario's start plus noise, at a place where the robot touches nothing.

    Raises:
        ConfigError: If the robot touches a wall or a body in each of 1000 samples.
    """
    if not (noise.start_xy or noise.start_yaw):
        return scenario.start
    for _ in range(MAX_SAMPLES):
        pose = disturb_pose(scenario.start, noise.start_xy, noise.start_yaw, rng)
        if scenario.map.world_to_cell(pose.x, pose.y) and not find_obstacle(scenario, robot, pose):
            return pose
    raise ConfigError(f"noise: expected room around the start, got obstacles in {MAX_SAMPLES} samples")
