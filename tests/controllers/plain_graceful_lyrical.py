"""A slow, literal Graceful Controller as Lyrical has it, to hold its kernels against."""

from __future__ import annotations

import itertools
import math
from typing import NamedTuple

import numpy as np

from tests.controllers.plain_graceful import PlainGraceful, wrap
from tests.controllers.plain_rpp import outline_cost


class Way(NamedTuple):
    """A simulated way to a target."""

    free: bool
    command: tuple
    steps: int
    dearest: int


class PlainLyricalGraceful(PlainGraceful):
    """One call on a local plan, as the reference and the sources say; everything is in the robot's frame."""

    def __init__(self, params, setup, local):
        super().__init__(params, setup, local)
        self.most_valid = 252 if setup.footprint.use_radius else 253
        self.safe = None
        self.fastest = params.v_linear_max

    def dt(self):
        """The step at the highest speed, at lower top speeds too."""
        return self.costmap.resolution / self.fastest

    def __call__(self, pose, arrived, costmap):
        p = self.p
        self.pose, self.costmap = pose, costmap
        local = self.with_headings([self.seen(each) for each in self.poses])
        if arrived and self.can_turn(local[-1][2]):
            return 0.0, self.turn(local[-1][2])
        steps = [math.dist(a[:2], b[:2]) for a, b in itertools.pairwise(local)]
        self.remaining = sum(steps)
        targets = [(self.looked_at(local), min(self.remaining, p.max_lookahead))]
        lengths = itertools.accumulate([math.hypot(*local[0][:2]), *steps])
        targets += reversed(list(zip(local, lengths, strict=True)))
        for target, distance in targets:
            if distance <= p.max_lookahead:
                command = self.command_to(target)
                if command:
                    return command
        return "collision"

    def with_headings(self, local):
        inner = [pose[2] for pose in self.poses[1:-1]]
        if len(local) < 3 or any(wrap(inner[0] - other) > 1e-6 for other in inner):
            return local
        ahead = [math.atan2(b[1] - a[1], b[0] - a[0]) for a, b in itertools.pairwise(local)]
        return [(*each[:2], heading) for each, heading in zip(local, [*ahead, local[-1][2]], strict=True)]

    def can_turn(self, angle):
        if not self.p.use_collision_detection:
            return True
        n = max(1, int(abs(angle) / self.p.in_place_collision_resolution))
        return not any(self.is_blocked(self.cost((0.0, 0.0, i / n * angle))) for i in range(1, n + 1))

    def looked_at(self, local):
        """The point at ``max_lookahead`` along the path, with the direction of its segment."""
        left = self.p.max_lookahead
        for (ax, ay, _), (bx, by, _) in itertools.pairwise(local):
            step = math.dist((ax, ay), (bx, by))
            if step and left <= step:
                share = left / step
                return ax + share * (bx - ax), ay + share * (by - ay), math.atan2(by - ay, bx - ax)
            left -= step
        return local[-1]

    def command_to(self, target):
        p = self.p
        x, y, heading = target
        bearing = math.atan2(y, x)
        if abs(bearing) < p.initial_rotation_tolerance:
            self.turns_first = False
        if p.prefer_final_rotation and self.remaining < p.max_lookahead:
            way = self.tried((x, y, bearing))
            if way.free and way.dearest >= self.most_valid - p.obstacle_cost_margin:
                way = self.way_round(x, y) or way
            if way.free:
                return way.command
        way = self.tried((x, y, heading))
        return way.command if way.free else None

    def way_round(self, x, y):
        """The last way that is safe and has fewer steps than all before, or the one to the last safe heading."""
        step, found, least = self.p.final_rotation_search_step, None, math.inf
        for i in range(math.ceil(math.tau / step)):
            heading = i * step + (self.safe or 0.0)
            way = self.tried((x, y, wrap(heading)))
            if way.free and way.steps < least:
                least = way.steps
                if way.dearest < self.most_valid:
                    found = way
                    if heading == self.safe:
                        break
                    self.safe = heading
        return found

    def tried(self, target):
        """The way at the highest top speed at which it is free."""
        p = self.p
        backward = self.reverses and target[0] < 0
        if backward:
            target = (*target[:2], wrap(target[2] + math.pi))
        top = p.v_linear_max
        while True:
            way = self.way_at(target, backward, top)
            top -= p.footprint_scaling_step
            if way.free or p.footprint_scaling_step <= 0 or top < p.footprint_scaling_linear_vel:
                return way

    def way_at(self, target, backward, top):
        p = self.p
        self.p = p.model_copy(update={"v_linear_max": top})
        try:
            return self.driven(target, backward)
        finally:
            self.p = p

    def grown(self, speed):
        """The outline for a command of that speed."""
        footprint, slowest = self.s.footprint, self.p.footprint_scaling_linear_vel
        if speed <= slowest or self.fastest <= slowest or len(footprint.corners) == 3:
            return footprint.corners
        return footprint.corners * (1 + self.p.footprint_scaling_factor * (speed - slowest) / (self.fastest - slowest))

    def driven(self, target, backward):
        p = self.p
        bearing = math.atan2(target[1], target[0])
        turning = self.turns_first and p.initial_rotation
        most = int(3 * math.hypot(*target[:2]) / self.costmap.resolution)
        pose, first, dearest = (0.0, 0.0, 0.0), None, 0
        step, is_over, free = 0, False, True
        while not is_over:
            step += 1
            if turning:
                command = first or (0.0, self.turn(bearing))
                turning = abs(bearing - pose[2]) >= p.initial_rotation_tolerance
            else:
                command = self.law(pose, target, backward)
            first = first or command
            pose = self.moved(pose, *command)
            cost = self.cost(pose, self.grown(first[0]))
            dearest = max(dearest, self.cost_at_centre(pose))
            free = not (p.use_collision_detection and self.is_blocked(cost))
            arrives = math.dist(pose[:2], target[:2]) <= self.costmap.resolution or step >= most
            is_over = arrives or not free
        return Way(free, first, step, dearest)

    def speed_bound(self, distance):
        """Speed from which the robot can stop at the target."""
        return math.sqrt(2 * distance * self.p.deceleration_max)

    def at(self, pose):
        """Where a pose of the robot's frame lies in the world."""
        x, y, yaw = self.pose
        cos, sin = math.cos(yaw), math.sin(yaw)
        return x + pose[0] * cos - pose[1] * sin, y + pose[0] * sin + pose[1] * cos, yaw + pose[2]

    def cost_at_centre(self, pose):
        cell = self.costmap.world_to_map(*self.at(pose)[:2])
        return -1 if cell is None else int(self.costmap.costs[cell])

    def cost(self, pose, corners=None):
        centre = self.cost_at_centre(pose)
        if centre < 0 or self.s.footprint.use_radius:
            return centre
        corners = self.s.footprint.corners if corners is None else corners
        return int(np.int64(outline_cost(self.costmap, self.at(pose), corners)))

    def is_blocked(self, cost):
        if cost == 255:
            return not self.costmap.track_unknown_space
        return cost > self.most_valid
