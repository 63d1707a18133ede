"""A slow, literal Regulated Pure Pursuit as Lyrical has it, to hold its kernels against."""

from __future__ import annotations

import itertools
import math

from tests.controllers.plain_rpp import PlainRpp


class PlainLyricalRpp(PlainRpp):
    """One call on a local plan with all of section 6 of the reference spelled out."""

    def __init__(self, params, setup, local):
        super().__init__(params, setup, local)
        self.last = 0.0, 0.0

    def __call__(self, pose, velocity, arrived, costmap):
        p = self.p
        x, y, yaw = pose
        if p.use_fixed_curvature_lookahead and p.interpolate_curvature_after_goal and len(self.poses) == 1:
            return "single"
        local = self.seen(x, y, yaw)
        length = sum(math.dist(a[:2], b[:2]) for a, b in itertools.pairwise(local))
        self.carrot = cx, cy = point_at(local, self.lookahead(abs(velocity[0])))
        reach, sign = math.hypot(cx, cy), -1 if p.allow_reversing and cx < 0 else 1
        if p.use_fixed_curvature_lookahead:
            cx, cy = point_at(local, p.curvature_lookahead_dist, p.interpolate_curvature_after_goal)
        bearing = math.atan2(sign * cy, sign * cx)
        if p.use_rotate_to_heading and (arrived or abs(bearing) > p.rotate_to_heading_min_angle):
            v, w = 0.0, self.rotate(local[-1][2] if arrived else bearing, velocity[1])
        else:
            cell = costmap.world_to_map(x, y)
            if cell is None:
                return "off"
            curvature = 2 * cy / (cx**2 + cy**2) if cx**2 + cy**2 > 0.001 else 0.0
            v = sign * self.speed(local, curvature, int(costmap.costs[cell]))
            v, w = self.within_window(v, curvature) if p.use_dynamic_window else (v, v * curvature)
        if p.use_collision_detection and self.collides(pose, v, w, *self.checked(reach, v, length), costmap):
            return "collision"
        self.last = v, w
        return v, w

    def seen(self, x, y, yaw):
        """The local plan from the robot's own frame."""
        cos, sin = math.cos(yaw), math.sin(yaw)
        moved = [(px - x, py - y, math.remainder(pyaw - yaw, math.tau)) for px, py, pyaw in self.poses]
        return [(dx * cos + dy * sin, dy * cos - dx * sin, turned) for dx, dy, turned in moved]

    def checked(self, carrot, v, length):
        """Distance and time within which the arc must be free."""
        p = self.p
        distance, seconds = carrot, p.max_allowed_time_to_collision_up_to_carrot
        if p.min_distance_to_obstacle > 0:
            seconds = max(seconds, p.min_distance_to_obstacle / max(abs(v), p.min_approach_linear_velocity))
            if p.use_velocity_scaled_lookahead_dist:
                limits = [p.min_distance_to_obstacle]
                if not p.allow_obstacle_checking_beyond_goal:
                    limits.append(length)
                distance = min(max(carrot, min(limits)), p.max_lookahead_dist)
        return distance, seconds

    def within_window(self, regulated, curvature):
        p, dt = self.p, self.s.control_period
        top = p.desired_linear_vel
        v_low, v_high = reachable(self.last[0], p.max_linear_accel, p.max_linear_decel, p.min_linear_vel, top, dt)
        window_w = reachable(
            self.last[1], p.max_angular_accel, p.max_angular_decel, p.min_angular_vel, p.max_angular_vel, dt
        )
        v_low, v_high = max(v_low, min(0.0, regulated)), min(v_high, max(0.0, regulated))
        if v_high < v_low:  # all of the window lies on one side of the regulated speeds
            v_low = v_high = v_low if v_low > 0 else v_high
        return fastest_on_line((v_low, v_high), window_w, curvature, 1 if regulated >= 0 else -1)


def reachable(current, accel, decel, lowest, highest, dt):
    """Window of one axis: away from 0 it accelerates, towards 0 it decelerates."""
    if current > 1e-3:
        change = decel, accel
    elif current < -1e-3:
        change = -accel, -decel
    else:
        change = -accel, accel
    return max(current + change[0] * dt, lowest), min(current + change[1] * dt, highest)


def fastest_on_line(window_v, window_w, curvature, sign):
    """The point of the window on ``w = curvature v`` that is farthest in the driving direction, else a corner."""
    forward = window_v[1] if sign > 0 else window_v[0]
    if abs(curvature) < 1e-3:
        return forward, 0.0 if window_w[0] <= 0 <= window_w[1] else min(window_w, key=abs)
    on_line = sorted(w / curvature for w in window_w)
    low, high = max(window_v[0], on_line[0]), min(window_v[1], on_line[1])
    if low <= high and window_w[0] <= window_w[1]:
        v = high if sign > 0 else low
        return v, curvature * v
    best, least = None, math.inf
    for v, w in itertools.product(window_v, window_w):
        away = abs(curvature * v - w) / math.hypot(curvature, 1.0)
        if away < least or (abs(away - least) <= 1e-3 and v * sign > best[0] * sign):
            best, least = (v, w), away
    return best


def point_at(local, length, beyond=False):
    """The point at an arc length from the first pose; past the end the last pose, or straight on."""
    left = length
    for (ax, ay, _), (bx, by, _) in itertools.pairwise(local):
        step = math.hypot(bx - ax, by - ay)
        if step and left <= step:
            return ax + left / step * (bx - ax), ay + left / step * (by - ay)
        left -= step
    if not beyond:
        return local[-1][:2]
    (ax, ay, _), (bx, by, _) = local[-2:]
    heading = math.atan2(by - ay, bx - ax)
    return bx + left * math.cos(heading), by + left * math.sin(heading)
