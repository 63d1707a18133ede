"""A slow, literal Rotation Shim of all releases, to hold the follower against."""

from __future__ import annotations

import math

from tests.controllers.plain_rpp import outline_cost

FOLLOWS = None
"""The answer where the primary controller drives."""


def shortest(start, end):
    return math.remainder(end - start, math.tau)


class PlainRotationShim:
    """Section 10 of Jazzy's reference and section 9 of Lyrical's spelled out; ``path`` is the plan that counts.

    In Lyrical ``at_goal`` is what the goal checker says, and the path of a call is the local plan.
    """

    def __init__(self, params, setup):
        self.p, self.s = params, setup
        self.path, self.goal, self.last = [], None, 0.0
        self.is_new = self.rotates = self.latched = False

    def set_plan(self, path):
        changed = self.rotates or self.goal != tuple(path[-1])
        self.is_new = changed or not self.p.rotate_to_heading_once
        self.path, self.goal, self.latched = path, tuple(path[-1]), False

    def end_action(self):
        self.last, self.latched = 0.0, False

    def __call__(self, pose, turn_rate, costmap, at_goal=False, local=None):
        if local is not None:
            self.path = local
            self.is_new = self.is_new or self.rotates or not self.p.rotate_to_heading_once
        else:
            x, y, _ = self.path[-1]
            near = math.hypot(x - pose.x, y - pose.y) <= self.s.xy_goal_tolerance
            # The position is latched only where it is asked for.
            at_goal = self.latched = self.p.rotate_to_goal_heading and (self.latched or near)
        if self.p.rotate_to_goal_heading and at_goal:
            command = self.turn(shortest(pose.yaw, self.goal[2]), pose, turn_rate, costmap)
            if command is not None:
                return command
        if self.is_new:
            angle = self.angle_to_path(pose)
            p = self.p
            if angle is not None and abs(angle) > (
                p.angular_disengage_threshold if self.rotates else p.angular_dist_threshold
            ):
                self.rotates = True
                command = self.turn(angle, pose, turn_rate, costmap)
                if command is not None:
                    return command
            self.is_new = False
        self.rotates = False
        return FOLLOWS

    def angle_to_path(self, pose):
        p, first = self.p, self.path[0]
        if len(self.path) < 2:
            return None
        far = [each for each in self.path[1:] if math.dist(each[:2], first[:2]) >= p.forward_sampling_distance]
        if not far and p.release == "humble":
            return None
        x, y, yaw = far[0] if far else self.path[-1]
        if p.use_path_orientations:
            return shortest(pose.yaw, yaw)
        return shortest(pose.yaw, math.atan2(y - pose.y, x - pose.x))

    def turn(self, angle, pose, turn_rate, costmap):
        """The turn rate, None where the outline would touch something."""
        p, dt = self.p, self.s.control_period
        current = turn_rate if p.closed_loop else self.last
        sign = 1 if angle > 0 else -1
        reach = p.max_angular_accel * dt
        rate = min(max(sign * p.rotate_to_heading_angular_vel, current - reach), current + reach)
        limit = math.sqrt(2 * p.max_angular_accel * abs(angle))
        if p.release != "humble" and abs(rate) > limit:
            rate = sign * limit
        time = 0.0
        while time < p.simulate_ahead_time:
            time += dt
            yaw = pose.yaw + rate * time
            if shortest(yaw, pose.yaw) >= abs(angle) - p.angular_dist_threshold:
                break
            cost = outline_cost(costmap, (pose.x, pose.y, yaw), self.s.footprint.corners)
            if cost >= (254 if p.max_cost_threshold is None else p.max_cost_threshold):
                return None
            if cost == 255 and costmap.track_unknown_space:
                return None
        self.last = rate
        return rate
