"""The laws of Regulated Pure Pursuit, each a small pure function.

Source: nav2_regulated_pure_pursuit_controller: src/regulated_pure_pursuit_controller.cpp (Humble),
include/.../regulation_functions.hpp (Jazzy).
"""

from __future__ import annotations

import math

from gym_mapbench.kernels.jit import kernel

FREE_SPACE = 0
NO_INFORMATION = 255


@kernel
def curvature_to(x, y):
    """Curvature (1/m) of the arc that leaves along +x and meets a point of the robot frame, m."""
    distance2 = x * x + y * y
    return 2.0 * y / distance2 if distance2 > 0.001 else 0.0


@kernel
def circle_segment_intersection(x1, y1, x2, y2, radius):
    """Point of a segment at ``radius`` (m) from (0, 0); its first end lies inside, its second outside."""
    dx, dy = x2 - x1, y2 - y1
    length2 = dx * dx + dy * dy
    cross = x1 * y2 - x2 * y1
    outwards = 1.0 if x2 * x2 + y2 * y2 > x1 * x1 + y1 * y1 else -1.0
    root = outwards * math.sqrt(radius * radius * length2 - cross * cross)
    return (cross * dy + dx * root) / length2, (-cross * dx + dy * root) / length2


@kernel
def curvature_limited(speed, curvature, min_radius):
    """Speed (m/s) on an arc: in proportion to its radius where that is below ``min_radius`` (m)."""
    if curvature == 0.0:
        return speed
    radius = abs(1.0 / curvature)
    return speed * (1.0 - abs(radius - min_radius) / min_radius) if radius < min_radius else speed


@kernel
def cost_limited(
    speed, cost, cost_at_radius, inscribed_radius, inflation_cost_scaling_factor, cost_scaling_dist, cost_scaling_gain
):
    """Speed (m/s) near obstacles: the cost at the robot's centre tells how far away they are.

    ``cost_at_radius`` is the cost that is assumed for an obstacle at the inscribed radius.
    """
    if cost in (FREE_SPACE, NO_INFORMATION):
        return speed
    distance = inscribed_radius - math.log(cost / cost_at_radius) / inflation_cost_scaling_factor
    return speed * cost_scaling_gain * distance / cost_scaling_dist if distance < cost_scaling_dist else speed


@kernel
def approach_limited(speed, remaining_length, distance_to_end, approach_velocity_scaling_dist, min_approach_velocity):
    """Speed (m/s) near the path's end: its remaining length (m) says if it falls, the straight distance (m) how far."""
    factor = 1.0
    if remaining_length < approach_velocity_scaling_dist:
        factor = distance_to_end / approach_velocity_scaling_dist
    return min(speed, max(speed * factor, min_approach_velocity))


@kernel
def reachable_turn_rate(angle, turn_rate, top_turn_rate, max_angular_accel, control_period):
    """Turn rate (rad/s) on the spot towards ``angle`` (rad) that can be reached within one period."""
    reach = max_angular_accel * control_period
    wanted = top_turn_rate if angle > 0.0 else -top_turn_rate
    return min(max(wanted, turn_rate - reach), turn_rate + reach)


@kernel
def rotation_speed(angle, turn_rate, top_turn_rate, max_angular_accel, control_period):
    """Turn rate (rad/s) on the spot by ``angle`` (rad): reachable within one period, and able to stop in time."""
    command = reachable_turn_rate(angle, turn_rate, top_turn_rate, max_angular_accel, control_period)
    stoppable = math.sqrt(2.0 * max_angular_accel * abs(angle))
    if abs(command) <= stoppable:
        return command
    return stoppable if angle > 0.0 else -stoppable


@kernel
def projection_step(speed, turn_rate, resolution, circumscribed_radius):
    """Seconds in which the robot, or its outermost corner when turning on the spot, moves by one cell."""
    if abs(speed) < 0.01 and abs(turn_rate) > 0.01:
        return 2.0 * math.sin((resolution / 2.0) / circumscribed_radius) / abs(turn_rate)
    return resolution / abs(speed)
