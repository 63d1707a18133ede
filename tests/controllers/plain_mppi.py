"""MPPI once more, slowly and one trajectory at a time, as the specification tells it: the twin of the kernels."""

from __future__ import annotations

import itertools
import math

import numpy as np

f4 = np.float32
FILTER = np.array([-21, 14, 39, 54, 59, 54, 39, 14, -21], dtype=f4) / f4(231)


def norm(angle):
    wrapped = math.fmod(angle + math.pi, 2 * math.pi)
    return wrapped + math.pi if wrapped <= 0 else wrapped - math.pi


def bresenham(x0, y0, x1, y1):
    dx, dy = abs(x1 - x0), abs(y1 - y0)
    sx, sy = (1 if x1 >= x0 else -1), (1 if y1 >= y0 else -1)
    long, short = max(dx, dy), min(dx, dy)
    error, x, y = long // 2, x0, y0
    for _ in range(long + 1):
        yield x, y
        error += short
        if dx >= dy:
            x += sx
        else:
            y += sy
        if error >= long:
            error -= long
            if dx >= dy:
                y += sy
            else:
                x += sx


class PlainMppi:
    """One call; after :meth:`run` it has ``costs`` by critic, ``total``, ``furthest``, ``failed``, ``v`` and ``w``."""

    def __init__(self, params, setup, pose, velocity, path, costmap, controls, noise, goal=None):
        self.p, self.setup, self.pose, self.costmap = params, setup, pose, costmap
        self.jazzy = params.release != "humble"
        self.px, self.py, self.pyaw = np.asarray(path).T.astype(f4)
        self.v, self.w = (u.astype(f4) for u in controls)
        self.noise_v, self.noise_w = noise
        self.K, self.N = self.noise_v.shape
        self.furthest, self.failed = -1, False
        self.goal = goal or (self.px[-1], self.py[-1])
        self.roll_out(velocity)

    def roll_out(self, velocity):
        dt = f4(self.p.model_dt)
        cv, cw = self.v + self.noise_v, self.w + self.noise_w
        self.vx, self.wz = np.empty_like(cv), np.empty_like(cw)
        self.vx[:, 0], self.wz[:, 0] = velocity
        for t in range(1, self.N):
            if self.jazzy:
                cv[:, t - 1] = [self.reachable_v(c, p) for c, p in zip(cv[:, t - 1], self.vx[:, t - 1], strict=True)]
                cw[:, t - 1] = [self.reachable_w(c, p) for c, p in zip(cw[:, t - 1], self.wz[:, t - 1], strict=True)]
            self.vx[:, t], self.wz[:, t] = cv[:, t - 1], cw[:, t - 1]
        self.cv, self.cw = cv, cw
        self.yaw = np.cumsum(self.wz * dt, axis=1, dtype=f4) + f4(self.pose.yaw)
        heading = np.empty_like(self.yaw)
        heading[:, 0], heading[:, 1:] = f4(self.pose.yaw), self.yaw[:, :-1]
        cos, sin = (f(heading.astype(float)).astype(f4) for f in (np.cos, np.sin))
        self.x = (np.cumsum(self.vx * cos * dt, axis=1, dtype=f4) + np.float64(self.pose.x)).astype(f4)
        self.y = (np.cumsum(self.vx * sin * dt, axis=1, dtype=f4) + np.float64(self.pose.y)).astype(f4)

    def reachable_v(self, speed, before):
        p, dt = self.p, self.p.model_dt
        low, high = (p.ax_min, p.ax_max) if before > 0 else (-p.ax_max, -p.ax_min)
        return f4(min(max(speed, before + dt * low), before + dt * high))

    def reachable_w(self, turn, before):
        change = self.p.model_dt * self.p.az_max
        return f4(min(max(turn, before - change), before + change))

    def run(self):
        self.costs = {}
        for name in self.p.critics:
            own = self.p.critic(name)
            if not own.enabled:
                continue
            scores = np.zeros(self.K) if self.failed else getattr(self, name)(own) ** own.cost_power
            self.costs[name] = np.broadcast_to(scores, (self.K,))
        effort_v = self.p.gamma / self.p.vx_std**2 * (self.v * (self.cv - self.v)).sum(axis=1)
        effort_w = self.p.gamma / self.p.wz_std**2 * (self.w * (self.cw - self.w)).sum(axis=1)
        self.total = sum(self.costs.values()) + effort_v + effort_w
        weights = np.exp(-(self.total - self.total.min()) / self.p.temperature)
        self.update(weights / weights.sum())
        return self

    def update(self, weights):
        self.v = np.clip(weights @ self.cv, self.p.vx_min, self.p.vx_max)
        self.w = np.clip(weights @ self.cw, -self.p.wz_max, self.p.wz_max)
        for t in range(1, self.N if self.jazzy else 0):
            self.v[t] = self.reachable_v(self.v[t], self.v[t - 1])
            self.w[t] = self.reachable_w(self.w[t], self.w[t - 1])
        if self.p.motion_model == "Ackermann":
            radius = self.p.AckermannConstraints.min_turning_r
            tight = np.abs(self.v) < radius * np.abs(self.w)
            self.w = np.where(tight, np.sign(self.w) * np.abs(self.v) / radius, self.w)

    def near(self, distance):
        return (self.pose.x - self.goal[0]) ** 2 + (self.pose.y - self.goal[1]) ** 2 < distance**2

    def cell(self, x, y):
        if x < self.costmap.origin_x or y < self.costmap.origin_y:
            return None
        col = int((x - self.costmap.origin_x) / self.costmap.resolution)
        row = int((y - self.costmap.origin_y) / self.costmap.resolution)
        rows, cols = self.costmap.costs.shape
        return (row, col) if row < rows and col < cols else None

    def cell_single(self, x, y):
        """The cell as Jazzy's Cost critic finds it, in float32 throughout."""
        at_x, at_y, side = (f4(a) for a in (self.costmap.origin_x, self.costmap.origin_y, self.costmap.resolution))
        if f4(x) < at_x or f4(y) < at_y:
            return None
        col, row = int((f4(x) - at_x) / side), int((f4(y) - at_y) / side)
        rows, cols = self.costmap.costs.shape
        return (row, col) if row < rows and col < cols else None

    def cost_at(self, x, y, single=False):
        cell = self.cell_single(x, y) if single else self.cell(float(x), float(y))
        return 255 if cell is None else int(self.costmap.costs[cell])

    def outline(self, x, y, yaw):
        cos, sin = math.cos(yaw), math.sin(yaw)
        corners = [(x + a * cos - b * sin, y + a * sin + b * cos) for a, b in self.setup.footprint.corners]
        cells = [self.cell(*corner) for corner in corners]
        if None in cells:
            return 254
        worst = 0
        for (r0, c0), (r1, c1) in [*itertools.pairwise(cells), (cells[0], cells[-1])]:
            costs = [int(self.costmap.costs[row, col]) for col, row in bresenham(c0, r0, c1, r1)]
            worst = max(worst, 254 if 254 in costs else max(costs))
            if worst == 254:
                break
        return worst

    def threshold(self):
        footprint = self.setup.footprint
        if self.jazzy and self.setup.inflation_radius < footprint.circumscribed_radius:
            return 0
        beyond = footprint.circumscribed_radius - footprint.inscribed_radius
        return int(252 * math.exp(-self.setup.cost_scaling_factor * beyond))

    def collides(self, cost, own):
        if cost == 255:
            return not self.costmap.track_unknown_space
        return cost == 254 or (cost == 253 and not own.consider_footprint)

    def ConstraintCritic(self, own):
        p = self.p
        highest, lowest = math.hypot(p.vx_max, p.vy_max), -math.hypot(p.vx_min, p.vy_max)
        out = np.maximum(self.vx - highest, 0) + np.maximum(lowest - self.vx, 0)
        if p.motion_model == "Ackermann":
            out = out + np.maximum(p.AckermannConstraints.min_turning_r - np.abs(self.vx) / np.abs(self.wz), 0)
        return own.cost_weight * p.model_dt * out.sum(axis=1)

    def CostCritic(self, own):
        values, hits = np.zeros(self.K), 0
        near = self.near(own.near_goal_distance)
        step, critical = (own.trajectory_point_step, own.near_collision_cost) if self.jazzy else (1, 253)
        points = self.looks(step)
        for k in range(self.K):
            for t in range(0, points * step, step):
                x, y, yaw = self.x[k, t], self.y[k, t], self.yaw[k, t]
                cost = self.cost_at(x, y, self.jazzy)
                if cost < 1:
                    continue
                look = own.consider_footprint and cost >= self.threshold()
                if self.collides(self.outline(float(x), float(y), float(yaw)) if look else cost, own):
                    values[k] = own.collision_cost
                    hits += 1
                    break
                values[k] += own.critical_cost if cost >= critical else (0 if near else cost)
        self.failed = hits == self.K
        return own.cost_weight / 254 * values / points

    def looks(self, step):
        return self.N // step

    def ObstaclesCritic(self, own):
        critical, repulsion, hits = np.zeros(self.K), np.zeros(self.K), 0
        near = self.near(own.near_goal_distance)
        of_layer = self.setup.cost_scaling_factor, self.setup.inflation_radius
        scaling, radius = of_layer if self.jazzy else (own.cost_scaling_factor, own.inflation_radius)
        for k in range(self.K):
            for t in range(self.N):
                x, y, yaw = float(self.x[k, t]), float(self.y[k, t]), float(self.yaw[k, t])
                cost = self.cost_at(x, y)
                look = own.consider_footprint and cost >= self.threshold() and self.cell(x, y) is not None
                cost = self.outline(x, y, yaw) if look else cost
                if cost < 1:
                    continue
                if self.collides(cost, own):
                    critical[k] = own.collision_cost
                    hits += 1
                    break
                distance = (math.log(253) - math.log(cost)) / scaling
                distance += self.setup.footprint.inscribed_radius if look else 0
                if distance < own.collision_margin_distance:
                    critical[k] += own.collision_margin_distance - distance
                if not near and (self.jazzy or distance >= own.collision_margin_distance):
                    repulsion[k] += radius - distance
        self.failed = hits == self.K
        repulsion -= repulsion.min() if self.jazzy else 0
        return own.critical_weight * critical + own.repulsion_weight * repulsion / self.N

    def GoalCritic(self, own):
        if not self.near(own.threshold_to_consider):
            return np.zeros(self.K)
        return own.cost_weight * np.hypot(self.x - self.goal[0], self.y - self.goal[1]).mean(axis=1)

    def angles(self, wanted, either_way):
        off = np.abs(np.vectorize(norm)(np.float64(wanted) - self.yaw))
        return (np.minimum(off, math.pi - off) if either_way else off).mean(axis=1)

    def GoalAngleCritic(self, own):
        if not self.near(own.threshold_to_consider):
            return np.zeros(self.K)
        return own.cost_weight * self.angles(self.pyaw[-1], own.symmetric_yaw_tolerance)

    def PreferForwardCritic(self, own):
        if self.near(own.threshold_to_consider):
            return np.zeros(self.K)
        return own.cost_weight * self.p.model_dt * np.maximum(-self.vx, 0).sum(axis=1)

    def TwirlingCritic(self, own):
        if self.near(self.setup.xy_goal_tolerance):
            return np.zeros(self.K)
        return own.cost_weight * np.abs(self.wz).mean(axis=1)

    def VelocityDeadbandCritic(self, own):
        x, _, yaw = own.deadband_velocities
        lacking = np.maximum(abs(x) - np.abs(self.vx), 0) + np.maximum(abs(yaw) - np.abs(self.wz), 0)
        return own.cost_weight * self.p.model_dt * lacking.sum(axis=1)

    def reached(self):
        dx, dy = self.px - self.x[:, -1:], self.py - self.y[:, -1:]
        away = dx * dx + dy * dy
        self.furthest = 0 if self.jazzy else int(away.argmin(axis=1).max())
        for row in away if self.jazzy else ():
            self.furthest += int(row[self.furthest :].argmin())
        return self.furthest

    def valid(self, i):
        if i >= len(self.px) - 1:
            return True
        cell = self.cell(float(self.px[i]), float(self.py[i]))
        cost = 254 if cell is None else self.costmap.costs[cell]
        return cost < 253 or (cost == 255 and self.costmap.track_unknown_space)

    def PathFollowCritic(self, own):
        count = len(self.px)
        if count < 2 or self.near(own.threshold_to_consider):
            return np.zeros(self.K)
        j = min(self.reached() + own.offset_from_furthest, count - 1)
        while j < count - 2 and not self.valid(j):
            j += 1
        return own.cost_weight * np.hypot(self.x[:, -1] - self.px[j], self.y[:, -1] - self.py[j])

    def PathAngleCritic(self, own):
        if self.near(own.threshold_to_consider):
            return np.zeros(self.K)
        j = min(self.reached() + own.offset_from_furthest, len(self.px) - 1)
        if self.jazzy:
            return self.last_angles(own, j)
        either_way = self.p.vx_min != 0 and not own.forward_preference
        off = abs(norm(self.pose.yaw - math.atan2(self.py[j] - self.pose.y, self.px[j] - self.pose.x)))
        if (min(off, math.pi - off) if either_way else off) < own.max_angle_to_furthest:
            return np.zeros(self.K)
        bearing = np.arctan2(self.py[j] - self.y, self.px[j] - self.x)
        return own.cost_weight * self.angles(bearing, either_way)

    def last_angles(self, own, j):
        mode = 0 if own.mode == 1 and self.p.vx_min == 0 else own.mode
        bearing = math.atan2(self.py[j] - self.pose.y, self.px[j] - self.pose.x)
        if mode == 2 and abs(norm(bearing - self.pyaw[j])) > math.pi / 2:
            bearing = norm(bearing + math.pi)
        off = abs(norm(self.pose.yaw - bearing))
        if (min(off, abs(norm(off + math.pi))) if mode == 1 else off) < own.max_angle_to_furthest:
            return np.zeros(self.K)
        angles = np.empty(self.K)
        for k in range(self.K):
            bearing = math.atan2(self.py[j] - self.y[k, -1], self.px[j] - self.x[k, -1])
            angles[k] = abs(norm(bearing - self.yaw[k, -1]))
            of_path = abs(norm(bearing - self.pyaw[j]))
            if (angles[k] if mode == 1 else of_path if mode == 2 else 0) >= math.pi / 2:
                angles[k] = abs(norm(bearing + math.pi - self.yaw[k, -1]))
        return own.cost_weight * angles

    def PathAlignCritic(self, own):
        if self.near(own.threshold_to_consider):
            return np.zeros(self.K)
        furthest = self.reached()
        if furthest < max(own.offset_from_furthest, 1):
            return np.zeros(self.K)
        first = 0 if self.jazzy else int(((self.px - self.x[0, 0]) ** 2 + (self.py - self.y[0, 0]) ** 2).argmin())
        invalid = 0
        for i in range(first, furthest):
            invalid += not self.valid(i)
            if invalid > 2 and invalid / (furthest - first) > own.max_path_occupancy_ratio:
                return np.zeros(self.K)
        steps = np.hypot(np.diff(self.px), np.diff(self.py))
        arc = np.concatenate([[0], np.cumsum(steps, dtype=f4)])[:furthest].astype(f4)
        return own.cost_weight * np.array([self.offset(k, arc, own) for k in range(self.K)])

    def offset(self, k, arc, own):
        length, j, total, count = f4(0), 0, 0.0, 0
        x, y, step = self.x[k], self.y[k], own.trajectory_point_step
        for t in range(step, self.N, step):
            length += np.sqrt((x[t] - x[t - step]) ** 2 + (y[t] - y[t - step]) ** 2)
            j = closest_onwards(arc, length, j) if self.jazzy else closest(arc, length, j, own.humble_search)
            if self.valid(j):
                turn = norm(float(self.yaw[k, t] - self.pyaw[j])) if own.use_path_orientations else 0.0
                total += math.sqrt((self.px[j] - x[t]) ** 2 + (self.py[j] - y[t]) ** 2 + turn**2)
                count += 1
        return total / count if count else 0.0


def closest(arc, length, start, humble):
    start = start if humble else 0
    bound = next((i for i in range(start, len(arc)) if arc[i] >= length), len(arc))
    if bound == start and humble:
        return 0
    if bound == len(arc):
        return len(arc) if humble else len(arc) - 1
    return bound - 1 if bound > 0 and length - arc[bound - 1] < arc[bound] - length else bound


def closest_onwards(arc, length, start):
    before = arc[start] if start else 0.0
    for i in range(start + 1, len(arc)):
        if arc[i] > length:
            return i - 1 if length - before < arc[i] - length else i
        before = arc[i]
    return len(arc) - 1


def smooth_copy(u, history, weights=None):
    """Savitzky-Golay from the values as they were, all but the last (since Jazzy)."""
    weights = FILTER if weights is None else weights
    u, count = u.astype(f4), len(u)
    padded = np.concatenate([history, u, np.full(4, u[-1])])
    if count - 1 < 20:
        return u
    return np.array([*(padded[i : i + 9] @ weights for i in range(count - 1)), u[-1]], dtype=f4)


def smooth(u, history):
    """Savitzky-Golay in place, left to right, all but the value five before the end."""
    u, count = u.astype(f4), len(u)
    if count - 1 < 20:
        return u
    for i in range(count):
        if i != count - 5:
            window = [history[4 + j] if j < 0 else u[min(j, count - 1)] for j in range(i - 4, i + 5)]
            u[i] = sum(c * value for c, value in zip(FILTER, window, strict=True))
    return u
