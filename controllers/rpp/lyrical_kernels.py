"""One call of Regulated Pure Pursuit in Lyrical: the carrot by arc length on the local plan, the command and its check.

Source: nav2_regulated_pure_pursuit_controller (Lyrical): src/regulated_pure_pursuit_controller.cpp,
src/collision_checker.cpp; nav2_util/src/controller_utils.cpp.
"""

from __future__ import annotations

import math

from controllers.local_plan import in_robot_frame
from controllers.rpp.dynamic_window import window_command
from controllers.rpp.kernels import (
    COLLISION_AHEAD,
    OK,
    SINGLE_POSE,
    arc_collides,
    choose_command,
    cost_at,
    find_lookahead,
    rotation_angle,
)
from controllers.rpp.regulation import curvature_to
from gym_mapbench.kernels.jit import kernel


@kernel
def point_along(path, steps, x, y, yaw, lookahead, continues):
    """Point of the path at an arc length from its first pose, in the robot's frame (m).

    Past the path's end it is the last pose, or with ``continues`` a point on the extended last segment.
    """
    cos, sin = math.cos(yaw), math.sin(yaw)
    travelled = 0.0
    for i in range(len(steps)):
        if travelled + steps[i] >= lookahead and steps[i] > 0.0:
            return between(path, i, (lookahead - travelled) / steps[i], x, y, cos, sin)
        travelled += steps[i]
    last = len(path) - 1
    end_x, end_y = in_robot_frame(path, last, x, y, cos, sin)
    if not continues:
        return end_x, end_y
    before_x, before_y = in_robot_frame(path, last - 1, x, y, cos, sin)
    heading = math.atan2(end_y - before_y, end_x - before_x)
    missing = lookahead - travelled
    return end_x + missing * math.cos(heading), end_y + missing * math.sin(heading)


@kernel
def between(path, i, share, x, y, cos, sin):
    """Point between pose i of the path and the next, in the robot's frame (m)."""
    from_x, from_y = in_robot_frame(path, i, x, y, cos, sin)
    to_x, to_y = in_robot_frame(path, i + 1, x, y, cos, sin)
    return from_x + share * (to_x - from_x), from_y + share * (to_y - from_y)


@kernel
def checked_way(v, carrot, length, tuning):
    """Distance (m) and time (s) for which the arc of a command is checked."""
    seconds, nearest = tuning.max_allowed_time_to_collision_up_to_carrot, tuning.min_distance_to_obstacle
    if not nearest > 0.0:
        return carrot, seconds
    seconds = max(seconds, nearest / max(abs(v), tuning.min_approach_linear_velocity))
    if tuning.use_velocity_scaled_lookahead_dist:
        wanted = nearest if tuning.allow_obstacle_checking_beyond_goal else min(nearest, length)
        carrot = min(max(carrot, wanted), tuning.max_lookahead_dist)
    return carrot, seconds


@kernel
def follow(path, steps, arrived, last, x, y, yaw, v, w, grid, corners, tunings):
    """One controller call.

    Args:
        path: ``(n, 3)`` local plan, x, y in m and yaw in rad.
        steps: ``(n - 1,)`` distances between consecutive poses, m.
        arrived: Whether the goal's position is reached and the robot shall turn there.
        last: The last command, m/s and rad/s.
        x: Pose of the robot, m.
        y: Pose of the robot, m.
        yaw: Pose of the robot, rad.
        v: Measured speed, m/s.
        w: Measured turn rate, rad/s.
        grid: ``(costs, resolution, origin_x, origin_y, track_unknown)`` of the local costmap.
        corners: ``(k, 2)`` padded footprint, m.
        tunings: ``(1,)`` array with the record of parameters.

    Returns:
        Status, command v and w, carrot x and y in the robot frame.
    """
    tuning, count = tunings[0], len(path)
    if tuning.interpolate_curvature_after_goal and count == 1:
        return SINGLE_POSE, 0.0, 0.0, math.nan, math.nan
    carrot_x, carrot_y = point_along(path, steps, x, y, yaw, find_lookahead(v, tuning), False)
    curve_x, curve_y = carrot_x, carrot_y
    if tuning.use_fixed_curvature_lookahead:
        continues = tuning.interpolate_curvature_after_goal
        curve_x, curve_y = point_along(path, steps, x, y, yaw, tuning.curvature_lookahead_dist, continues)
    sign = -1.0 if tuning.allow_reversing and carrot_x < 0.0 else 1.0
    cost = cost_at(grid[0], grid[1], grid[2], grid[3], x, y)
    status, v, turn = choose_command(path, steps, 0, count, x, y, yaw, w, arrived, sign, curve_x, curve_y, cost, tuning)
    if tuning.use_dynamic_window and not rotation_angle(arrived, sign, curve_x, curve_y, 0.0, tuning)[0]:
        v, turn = window_command(v, curvature_to(curve_x, curve_y), last[0], last[1], tuning)
    if status == OK and tuning.use_collision_detection:
        reach, seconds = checked_way(v, math.hypot(carrot_x, carrot_y), steps.sum(), tuning)
        if arc_collides(grid, corners, x, y, yaw, v, turn, reach, seconds, tuning.circumscribed_radius):
            status = COLLISION_AHEAD
    return status, v, turn, carrot_x, carrot_y
