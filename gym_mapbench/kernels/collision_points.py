"""Measured points inside a polygon or circle around the robot, now and along a command.

Source: nav2_collision_monitor src/polygon.cpp, circle.cpp, kinematics.cpp.
"""

from __future__ import annotations

import math

from gym_mapbench.kernels.jit import kernel

NO_COLLISION = -1.0


@kernel
def is_inside(x, y, corners):
    """Whether a point lies inside a polygon, ``(n, 2)`` corners: a ray along +x crosses its border an odd number."""
    inside = False
    i = len(corners) - 1
    for j in range(len(corners)):
        if (y <= corners[i, 1]) == (y > corners[j, 1]):
            share = (y - corners[i, 1]) * (corners[j, 0] - corners[i, 0]) / (corners[j, 1] - corners[i, 1])
            if corners[i, 0] + share > x:
                inside = not inside
        i = j
    return inside


@kernel
def count_inside(points, corners, radius, x, y, yaw):
    """Number of points inside the shape of a robot that stands at a pose.

    Args:
        points: ``(n, 2)`` m.
        corners: ``(m, 2)`` corners of a polygon in the robot's frame, m; none for a circle.
        radius: Radius of the circle, or of one that holds all corners, m.
        x: Pose of the robot in the frame of the points, m.
        y: The same, m.
        yaw: The same, rad.
    """
    cos, sin = math.cos(yaw), math.sin(yaw)
    count = 0
    for i in range(len(points)):
        east, north = points[i, 0] - x, points[i, 1] - y
        ahead, left = east * cos + north * sin, -east * sin + north * cos
        if ahead * ahead + left * left < radius * radius:
            count += len(corners) == 0 or is_inside(ahead, left, corners)
    return count


@kernel
def collision_time(points, corners, radius, v, w, horizon, step, enough_now, enough):
    """Seconds until enough points are inside the shape of a robot that keeps its command; -1 if that does not happen.

    The pose is projected before each test, so the time is the one before the step, as in Nav2.

    Args:
        points: As for :func:`count_inside`; in the robot's frame.
        corners: As for :func:`count_inside`.
        radius: As for :func:`count_inside`.
        v: Commanded speed, m/s.
        w: Commanded turn rate, rad/s.
        horizon: ``time_before_collision``, s.
        step: ``simulation_time_step``, s.
        enough_now: Number of points that are a collision at once.
        enough: Number of points that are a collision later on.
    """
    if count_inside(points, corners, radius, 0.0, 0.0, 0.0) >= enough_now:
        return 0.0
    x = y = yaw = time = vy = 0.0
    vx = v
    cos, sin = math.cos(w * step), math.sin(w * step)
    while time <= horizon:
        x, y, yaw = x + vx * step, y + vy * step, yaw + w * step
        vx, vy = vx * cos - vy * sin, vx * sin + vy * cos
        if count_inside(points, corners, radius, x, y, yaw) >= enough:
            return time
        time += step
    return NO_COLLISION
