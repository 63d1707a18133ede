"""A slow, literal Graceful Controller, one step after the other, to hold the kernels against."""

from __future__ import annotations

import itertools
import math

import numpy as np

from tests.controllers.plain_rpp import outline_cost, size_in_meters


def wrap(angle):
    return math.atan2(math.sin(angle), math.cos(angle))


def single(number):
    return float(np.float32(number))


class PlainGraceful:
    """Both releases' call spelled out; ``poses`` is what is left of the plan."""

    def __init__(self, params, setup, path):
        self.p, self.s = params, setup
        self.jazzy = params.release == "jazzy"
        self.sharpness = getattr(params, "lambda")
        self.reverses = params.allow_backward and not params.initial_rotation
        self.poses = [tuple(map(float, pose)) for pose in path]
        self.arrived, self.turns_first = False, True

    def __call__(self, pose, costmap):
        self.pose, self.costmap = pose, costmap
        local = self.local_plan()
        if not local:
            return "empty"
        remaining = sum(math.dist(a[:2], b[:2]) for a, b in itertools.pairwise(local))
        return self.jazzys(local, remaining) if self.jazzy else self.humbles(local, remaining)

    def local_plan(self):
        x, y, _ = self.pose
        width, height = size_in_meters(self.costmap)
        search = self.p.max_robot_pose_search_dist
        search = width / 2 if search is None else math.inf if search < 0 else search
        length, away = 0.0, []
        for i, pose in enumerate(self.poses):
            length += math.dist(pose[:2], self.poses[i - 1][:2]) if i else 0.0
            if length > search:
                break
            away.append(math.dist(pose[:2], (x, y)))
        if away:
            nearest = [i for i, distance in enumerate(away) if distance == min(away)]
            self.poses = self.poses[nearest[-1 if self.jazzy else 0] :]
        near = list(itertools.takewhile(lambda p: math.dist(p[:2], (x, y)) <= max(width, height) / 2, self.poses))
        local = [self.seen(p) for p in near]
        inner = [p[2] for p in near[1:-1]]
        if self.jazzy and len(near) > 2 and all(wrap(inner[0] - other) <= 1e-6 for other in inner):
            ahead = [math.atan2(b[1] - a[1], b[0] - a[0]) for a, b in itertools.pairwise(local)]
            local = [(*p[:2], heading) for p, heading in zip(local, [*ahead, local[-1][2]], strict=True)]
        return local

    def seen(self, p):
        x, y, yaw = self.pose
        dx, dy = p[0] - x, p[1] - y
        return dx * math.cos(yaw) + dy * math.sin(yaw), dy * math.cos(yaw) - dx * math.sin(yaw), wrap(p[2] - yaw)

    def humbles(self, local, remaining):
        p = self.p
        far = [pose for pose in local if math.hypot(*pose[:2]) >= p.motion_target_dist]
        x, y, heading = far[0] if far else local[-1]
        if p.final_rotation and remaining < p.motion_target_dist and len(local) > 1:
            (ax, ay, _), (bx, by, _) = local[-2:]
            heading = math.atan2(by - ay, bx - ax)
        backward = self.reverses and x < 0
        target = (x, y, wrap(heading + math.pi) if backward else heading)
        if p.final_rotation and remaining < self.s.xy_goal_tolerance:
            self.arrived = True
        # The list of simulated poses begins with the robot's own, and may hold so many.
        most = int(2 * math.hypot(x, y) / self.costmap.resolution)
        if self.touches((0.0, 0.0, 0.0)):
            return "collision"
        pose, count = (0.0, 0.0, 0.0), 1
        while True:
            pose, count = self.moved(pose, *self.law(pose, target, backward)), count + 1
            if self.touches(pose):
                return "collision"
            if math.dist(pose[:2], (x, y)) <= self.costmap.resolution or count >= most:
                break
        bearing = math.atan2(y, x)
        if self.arrived:
            return 0.0, p.rotation_scaling_factor * local[-1][2] * p.v_angular_max
        if p.initial_rotation and abs(bearing) > p.initial_rotation_min_angle:
            return 0.0, p.rotation_scaling_factor * bearing * p.v_angular_max
        return self.law((0.0, 0.0, 0.0), target, backward)

    def jazzys(self, local, remaining):
        p = self.p
        self.arrived = self.arrived or remaining < self.s.xy_goal_tolerance
        if self.arrived:
            angle = local[-1][2]
            n = max(1, int(abs(angle) / p.in_place_collision_resolution))
            if not any(self.touches((0.0, 0.0, i / n * angle)) for i in range(1, n + 1)):
                return 0.0, self.turn(angle)
        lengths = list(
            itertools.accumulate(
                [math.hypot(*local[0][:2]), *(math.dist(a[:2], b[:2]) for a, b in itertools.pairwise(local))]
            )
        )
        for length, (x, y, yaw) in reversed(list(zip(lengths, local, strict=True))):
            if length > p.max_lookahead:
                continue
            if remaining >= p.max_lookahead and length < p.min_lookahead:
                break
            bearing_counts = remaining < p.max_lookahead and p.prefer_final_rotation
            heading = math.atan2(y, x) if bearing_counts else yaw
            backward = self.reverses and x < 0
            command = self.simulated((x, y, wrap(heading + math.pi) if backward else heading), backward)
            if command:
                return command
        return "collision"

    def simulated(self, target, backward):
        bearing = math.atan2(target[1], target[0])
        if abs(bearing) < self.p.initial_rotation_tolerance:
            self.turns_first = False
        turning = self.turns_first and self.p.initial_rotation
        most = int(3 * math.hypot(*target[:2]) / self.costmap.resolution)
        pose, command = (0.0, 0.0, 0.0), None
        step = 0
        while True:
            step += 1
            if turning:
                command = command or (0.0, self.turn(bearing))
                if abs(bearing - pose[2]) < self.p.initial_rotation_tolerance:
                    turning = False
                pose = self.moved(pose, *command)
            else:
                driven = self.law(pose, target, backward)
                command = command or driven
                pose = self.moved(pose, *driven)
            if self.touches(pose):
                return None
            if math.dist(pose[:2], target[:2]) <= self.costmap.resolution or step >= most:
                return command

    def law(self, pose, target, backward):
        """Park and Kuipers' law in Nav2's form."""
        p = self.p
        dx, dy = single(target[0] - pose[0]), single(target[1] - pose[1])
        sight = single(single(math.atan2(-dy, dx)) + (math.pi if backward else 0.0))
        r, phi, delta = single(math.hypot(dx, dy)), single(wrap(target[2] + sight)), single(wrap(pose[2] + sight))
        if r == 0:
            return (-p.v_linear_min if backward else p.v_linear_min), 0.0
        reference = math.atan(-p.k_phi * phi)
        kappa = -(p.k_delta * (delta - reference) + (1 + p.k_phi / (1 + (p.k_phi * phi) ** 2)) * math.sin(delta)) / r
        v = min(p.v_linear_max * r / p.slowdown_radius, p.v_linear_max / (1 + p.beta * abs(kappa) ** self.sharpness))
        v = min(max(min(v, self.speed_bound(r)), p.v_linear_min), p.v_linear_max)
        # Backwards both the speed and the curvature change sign, and the turn rate does not.
        w = min(max(kappa * v, -p.v_angular_max), p.v_angular_max)
        v = w / kappa if kappa else v
        return (-v if backward else v), w

    def speed_bound(self, distance):
        return math.inf

    def turn(self, angle):
        rate = self.p.rotation_scaling_factor * angle * self.p.v_angular_max
        return math.copysign(max(abs(rate), self.p.v_angular_min_in_place), rate)

    def dt(self):
        return self.costmap.resolution / self.p.v_linear_max

    def moved(self, pose, v, w):
        x, y, yaw = pose
        dt = self.dt()
        return x + v * dt * math.cos(yaw), y + v * dt * math.sin(yaw), wrap(yaw + w * dt)

    def touches(self, pose):
        x, y, yaw = self.pose
        at = (
            x + pose[0] * math.cos(yaw) - pose[1] * math.sin(yaw),
            y + pose[0] * math.sin(yaw) + pose[1] * math.cos(yaw),
        )
        cell = self.costmap.world_to_map(*at)
        if cell is None:
            return False
        if self.s.footprint.use_radius:
            cost, limit = int(self.costmap.costs[cell]), 253
        else:
            cost, limit = outline_cost(self.costmap, (*at, yaw + pose[2]), self.s.footprint.corners), 254
        return not self.costmap.track_unknown_space if cost == 255 else cost >= limit
