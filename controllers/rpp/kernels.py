"""One call of Regulated Pure Pursuit: carrot, command and collision check.

``tuning`` is one record of :data:`controllers.rpp.controller.TUNING`: the parameters, and what the robot and the
controller server add to them.

Source: nav2_regulated_pure_pursuit_controller: src/regulated_pure_pursuit_controller.cpp and, in Jazzy,
src/collision_checker.cpp.
"""

from __future__ import annotations

import math

from controllers.local_plan import distance, in_robot_frame, plan_window
from controllers.rpp.regulation import (
    approach_limited,
    circle_segment_intersection,
    cost_limited,
    curvature_limited,
    curvature_to,
    projection_step,
    rotation_speed,
)
from gym_mapbench.kernels.footprint import footprint_cost
from gym_mapbench.kernels.geometry import cell_index, normalize_angle
from gym_mapbench.kernels.jit import kernel

LETHAL = 254
NO_INFORMATION = 255

OK = 0
EMPTY_PLAN = 1
OFF_COSTMAP = 2
COLLISION_AHEAD = 3
SINGLE_POSE = 4


@kernel
def turns_on_the_spot(path, i):
    """Whether a pose and the next are at the same place with different headings."""
    return path[i, 0] == path[i + 1, 0] and path[i, 1] == path[i + 1, 1] and path[i, 2] != path[i + 1, 2]


@kernel
def is_cusp(path, i, tuning):
    """Whether the path turns back at a pose, or turns on the spot where that counts."""
    before = path[i, 0] - path[i - 1, 0], path[i, 1] - path[i - 1, 1]
    after = path[i + 1, 0] - path[i, 0], path[i + 1, 1] - path[i, 1]
    if before[0] * after[0] + before[1] * after[1] < 0.0:
        return True
    return tuning.turns_are_cusps and (turns_on_the_spot(path, i - 1) or turns_on_the_spot(path, i))


@kernel
def cusp_distance(path, first, last, x, y, yaw, tuning):
    """Distance from the robot to the first cusp of the window, infinite without one.

    It is measured in the robot's frame, as in Nav2, so that the carrot search finds exactly the same number.
    """
    for i in range(first + 1, last - 1):
        if is_cusp(path, i, tuning):
            ahead_x, ahead_y = in_robot_frame(path, i, x, y, math.cos(yaw), math.sin(yaw))
            return math.hypot(ahead_x, ahead_y)
    return math.inf


@kernel
def find_lookahead(speed, tuning):
    """Lookahead distance if no cusp is nearer, m."""
    if not tuning.use_velocity_scaled_lookahead_dist:
        return tuning.lookahead_dist
    scaled = abs(speed) * tuning.lookahead_time
    return min(max(scaled, tuning.min_lookahead_dist), tuning.max_lookahead_dist)


@kernel
def find_carrot(path, first, last, x, y, yaw, lookahead, interpolate):
    """The carrot in the robot frame: the first point of the window at the lookahead distance, else its last pose.

    Returns:
        Its x and y, and whether it is at the lookahead distance.
    """
    cos, sin = math.cos(yaw), math.sin(yaw)
    before_x = before_y = 0.0
    for i in range(first, last):
        ahead_x, ahead_y = in_robot_frame(path, i, x, y, cos, sin)
        if math.hypot(ahead_x, ahead_y) >= lookahead:
            if interpolate and i > first:
                ahead_x, ahead_y = circle_segment_intersection(before_x, before_y, ahead_x, ahead_y, lookahead)
            return ahead_x, ahead_y, True
        before_x, before_y = ahead_x, ahead_y
    return before_x, before_y, False


@kernel
def beyond_end(path, last, x, y, yaw, end_x, end_y, lookahead):
    """Point at the lookahead distance on the extended last segment, whose end is given in the robot frame."""
    before_x, before_y = in_robot_frame(path, last - 2, x, y, math.cos(yaw), math.sin(yaw))
    heading = math.atan2(end_y - before_y, end_x - before_x)
    far_x, far_y = end_x + math.cos(heading) * lookahead, end_y + math.sin(heading) * lookahead
    return circle_segment_intersection(end_x, end_y, far_x, far_y, lookahead)


@kernel
def find_carrots(path, first, last, x, y, yaw, speed, tuning):
    """The carrot, and the one for curvature and heading, which is mostly the same, as ``x, y, x, y``."""
    cusp = cusp_distance(path, first, last, x, y, yaw, tuning) if tuning.allow_reversing else math.inf
    lookahead = min(find_lookahead(speed, tuning), cusp)
    carrot_x, carrot_y, _ = find_carrot(path, first, last, x, y, yaw, lookahead, tuning.use_interpolation)
    if not tuning.use_fixed_curvature_lookahead:
        return carrot_x, carrot_y, carrot_x, carrot_y
    lookahead = min(tuning.curvature_lookahead_dist, cusp)
    curve_x, curve_y, found = find_carrot(path, first, last, x, y, yaw, lookahead, tuning.use_interpolation)
    if tuning.interpolate_curvature_after_goal and not found and last - first > 1:
        curve_x, curve_y = beyond_end(path, last, x, y, yaw, curve_x, curve_y, lookahead)
    return carrot_x, carrot_y, curve_x, curve_y


@kernel
def tracking_speed(path, steps, first, last, x, y, curvature, cost, tuning):
    """Regulated speed along the path, m/s, without sign."""
    base = tuning.desired_linear_vel
    on_curve = near_obstacle = base
    if tuning.use_regulated_linear_velocity_scaling:
        on_curve = curvature_limited(base, curvature, tuning.regulated_linear_scaling_min_radius)
    if tuning.use_cost_regulated_linear_velocity_scaling:
        near_obstacle = cost_limited(
            base,
            cost,
            tuning.cost_at_radius,
            tuning.inscribed_radius,
            tuning.inflation_cost_scaling_factor,
            tuning.cost_scaling_dist,
            tuning.cost_scaling_gain,
        )
    speed = max(min(on_curve, near_obstacle), tuning.regulated_linear_scaling_min_speed)
    remaining = 0.0
    for i in range(first, last - 1):
        remaining += steps[i]
    to_end = distance(path, last - 1, x, y)
    speed = approach_limited(
        speed, remaining, to_end, tuning.approach_velocity_scaling_dist, tuning.min_approach_linear_velocity
    )
    return min(abs(speed), base)


@kernel
def is_clear(costs, row, col, reach):
    """Whether the square of cells within ``reach`` of a cell lies on the map and holds no obstacle."""
    rows, cols = costs.shape
    if row < reach or col < reach or row + reach >= rows or col + reach >= cols:
        return False
    for near_row in range(row - reach, row + reach + 1):
        worst = 0
        for near_col in range(col - reach, col + reach + 1):
            worst = max(worst, costs[near_row, near_col])
        if worst >= LETHAL:
            return False
    return True


@kernel
def pose_collides(grid, corners, circumscribed_radius, x, y, yaw):
    """Whether the outline touches an obstacle; off the map it never does, and unknown is one unless it is tracked.

    ``grid`` is ``(costs, resolution, origin_x, origin_y, track_unknown)``.
    """
    costs, resolution, origin_x, origin_y, track_unknown = grid
    rows, cols = costs.shape
    cell = cell_index(x, y, origin_x, origin_y, resolution, rows, cols)
    if cell < 0:
        return False
    # The outline cannot leave this square. If the square is clear, which is ten times cheaper to find out, so is it.
    if is_clear(costs, cell // cols, cell % cols, int(circumscribed_radius / resolution + 1e-6) + 1):
        return False
    cost = footprint_cost(costs, resolution, origin_x, origin_y, x, y, yaw, corners)
    if cost == NO_INFORMATION and track_unknown:
        return False
    return cost >= LETHAL


@kernel
def arc_collides(grid, corners, x, y, yaw, v, w, reach, seconds, radius):
    """Whether the robot collides now, or on the arc of a command within a distance (m) and a time (s).

    ``radius`` is the circumscribed one, m.
    """
    if pose_collides(grid, corners, radius, x, y, yaw):
        return True
    step = projection_step(v, w, grid[1], radius)
    at_x, at_y, heading = x, y, yaw
    i = 1
    while i * step < seconds:
        i += 1
        at_x += step * (v * math.cos(heading))
        at_y += step * (v * math.sin(heading))
        heading += step * w
        if math.hypot(at_x - x, at_y - y) > reach:
            return False
        if pose_collides(grid, corners, radius, at_x, at_y, heading):
            return True
    return False


@kernel
def rotation_angle(arrived, sign, curve_x, curve_y, end_yaw, tuning):
    """Whether to turn on the spot, and by what angle (rad): to the goal's heading, or towards the path."""
    if not tuning.use_rotate_to_heading:
        return False, 0.0
    if arrived:
        return True, end_yaw
    bearing = math.atan2(curve_y, curve_x)
    if sign < 0.0:
        bearing = normalize_angle(bearing + math.pi)
    return abs(bearing) > tuning.rotate_to_heading_min_angle, bearing


@kernel
def cost_at(costs, resolution, origin_x, origin_y, x, y):
    """Cost of the cell that holds a point, -1 off the map."""
    rows, cols = costs.shape
    cell = cell_index(x, y, origin_x, origin_y, resolution, rows, cols)
    return int(costs[cell // cols, cell % cols]) if cell >= 0 else -1


@kernel
def choose_command(path, steps, first, last, x, y, yaw, w, arrived, sign, curve_x, curve_y, cost, tuning):
    """Status and command ``(v, w)``: a turn on the spot, or along the arc to the carrot."""
    end_yaw = normalize_angle(path[last - 1, 2] - yaw)
    rotates, angle = rotation_angle(arrived, sign, curve_x, curve_y, end_yaw, tuning)
    if rotates:
        top = tuning.rotate_to_heading_angular_vel
        return OK, 0.0, rotation_speed(angle, w, top, tuning.max_angular_accel, tuning.control_period)
    if cost < 0:
        return OFF_COSTMAP, 0.0, 0.0
    curvature = curvature_to(curve_x, curve_y)
    speed = sign * tracking_speed(path, steps, first, last, x, y, curvature, cost, tuning)
    return OK, speed, speed * curvature


@kernel
def follow(
    path, steps, begin, arrived, x, y, yaw, v, w, costs, resolution, origin_x, origin_y, track_unknown, corners, tunings
):
    """One controller call.

    Args:
        path: ``(n, 3)`` x, y in m and yaw in rad; poses before ``begin`` are already pruned.
        steps: ``(n - 1,)`` distances between consecutive poses, m.
        begin: First pose of the plan.
        arrived: Whether the goal's position was reached in an earlier call and that still counts.
        x: Pose of the robot, m.
        y: Pose of the robot, m.
        yaw: Pose of the robot, rad.
        v: Measured speed, m/s.
        w: Measured turn rate, rad/s.
        costs: ``(rows, cols)`` uint8 local costmap.
        resolution: Side of its cells, m.
        origin_x: Its lower-left corner, m.
        origin_y: Its lower-left corner, m.
        track_unknown: Whether 255 means unknown there.
        corners: ``(k, 2)`` padded footprint, m.
        tunings: ``(1,)`` array with the record of parameters.

    Returns:
        Status, command v and w, carrot x and y in the robot frame, new first pose of the plan, whether the goal's
        position is reached for later calls as well.
    """
    tuning = tunings[0]
    first, last = plan_window(path, steps, begin, x, y, costs, resolution, tuning)
    if tuning.interpolate_curvature_after_goal and len(path) - first == 1:
        return SINGLE_POSE, 0.0, 0.0, math.nan, math.nan, first, arrived
    if first == last:
        return EMPTY_PLAN, 0.0, 0.0, math.nan, math.nan, first, arrived
    carrot_x, carrot_y, curve_x, curve_y = find_carrots(path, first, last, x, y, yaw, v, tuning)
    reach = math.hypot(carrot_x, carrot_y)
    arrived = arrived or reach < tuning.xy_goal_tolerance
    sign = -1.0 if tuning.allow_reversing and carrot_x < 0.0 else 1.0
    cost = cost_at(costs, resolution, origin_x, origin_y, x, y)
    status, v, w = choose_command(path, steps, first, last, x, y, yaw, w, arrived, sign, curve_x, curve_y, cost, tuning)
    grid = costs, resolution, origin_x, origin_y, track_unknown
    if status == OK and tuning.use_collision_detection:
        seconds, radius = tuning.max_allowed_time_to_collision_up_to_carrot, tuning.circumscribed_radius
        if arc_collides(grid, corners, x, y, yaw, v, w, reach, seconds, radius):
            status = COLLISION_AHEAD
    return status, v, w, carrot_x, carrot_y, first, arrived and tuning.stateful
