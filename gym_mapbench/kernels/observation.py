"""Observations of the robots of many worlds; rows of worlds that are not ``seen`` keep their values."""

from __future__ import annotations

from gym_mapbench.kernels.frames import compose, in_robot_frame
from gym_mapbench.kernels.jit import kernel
from gym_mapbench.kernels.raycast import cast_rays


@kernel
def read_robots(robots, poses, velocities):
    """Write the true poses ``(n, 3)`` m, rad, and velocities ``(n, 2)`` m/s, rad/s, of ``(n,)`` ROBOT."""
    for i in range(len(robots)):
        robot = robots[i]
        poses[i, 0], poses[i, 1], poses[i, 2] = robot.x, robot.y, robot.yaw
        velocities[i, 0], velocities[i, 1] = robot.v, robot.w


@kernel
def see_goals(tasks, seen, poses, goals):
    """Write the goals ``(n, 3)`` of ``(n,)`` TASK as seen from ``(n, 3)`` poses."""
    for i in range(len(tasks)):
        if seen[i]:
            task = tasks[i]
            see_goal(task.goal_x, task.goal_y, task.goal_yaw, poses[i], goals[i])


@kernel
def see_goal(goal_x, goal_y, goal_yaw, pose, seen):
    """Write a goal ``(3,)`` m, rad, as seen from a pose ``(3,)``."""
    seen[0], seen[1], seen[2] = in_robot_frame(goal_x, goal_y, goal_yaw, pose[0], pose[1], pose[2])


@kernel
def scan_worlds(robots, seen, grounds, walls, place, beams, range_max, ranges):
    """Write the distances to the first walls.

    Args:
        robots: ``(n,)`` ROBOT.
        seen: ``(n,)`` bool.
        grounds: ``(n,)`` GROUND.
        walls: ``(n, cells)`` bool, each row the map in a frame of walls, flat.
        place: ``(3,)`` pose of the scanner on the robot, m, rad.
        beams: ``(beams, 2)`` cosine and sine of every beam's angle.
        range_max: Distance where nothing is hit, m.
        ranges: ``(n, beams)`` out, m.
    """
    centred = place[0] == 0.0 and place[1] == 0.0 and place[2] == 0.0
    for i in range(len(robots)):
        if seen[i]:
            robot, ground = robots[i], grounds[i]
            x, y, yaw = robot.x, robot.y, robot.yaw
            if not centred:
                x, y, yaw = compose(x, y, yaw, place[0], place[1], place[2])
            rows, width = ground.rows + 2, ground.cols + 2
            framed = walls[i, : rows * width].reshape((rows, width))
            cast_rays(
                framed, ground.resolution, ground.origin_x, ground.origin_y, x, y, yaw, beams, range_max, ranges[i]
            )
