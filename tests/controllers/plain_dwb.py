"""DWB once more, slowly and one pose at a time, as the specification tells it: the twin of the kernels."""

from __future__ import annotations

import itertools
import math
from collections import deque
from typing import NamedTuple

import numpy as np

EPSILON = 1e-5
OFF = None


class Illegal(Exception):
    pass


class Trajectory(NamedTuple):
    v: float
    w: float
    poses: list


def project(start, acceleration, deceleration, dt, target):
    if start < target:
        return min(target, start + acceleration * dt)
    return max(target, start + deceleration * dt)


def axis(current, low, high, acceleration, deceleration, dt, count):
    current = min(max(current, low), high)
    top = project(current, acceleration, deceleration, dt, high)
    bottom = project(current, acceleration, deceleration, dt, low)
    if abs(top - bottom) < EPSILON:
        return [bottom]
    step = (top - bottom) / (max(2, count) - 1)
    values, value = [], bottom
    while value <= top + EPSILON:
        values.append(value)
        if value < 0 and value + step > 0 and value + step <= top + EPSILON:
            values.append(0.0)
        value += step
    return values


def twists(p, velocity, period):
    limited = "Limited" in p.trajectory_generator_name
    reach = (p.sim_period or period) if limited else p.sim_time
    vs = axis(velocity.v, p.min_vel_x, p.max_vel_x, p.acc_lim_x, p.decel_lim_x, reach, p.vx_samples)
    turn = p.max_vel_theta
    ws = axis(velocity.w, -turn, turn, p.acc_lim_theta, p.decel_lim_theta, reach, p.vtheta_samples)
    return [(v, w) for v in vs for w in ws if permitted(p, v, w)]


def permitted(p, v, w):
    slack = EPSILON if p.release == "humble" else 1.1920929e-7
    if p.max_speed_xy >= 0 and v * v > p.max_speed_xy**2 + slack:
        return False
    slow = p.min_speed_xy >= 0 and v * v + slack < p.min_speed_xy**2
    still = p.min_speed_theta >= 0 and abs(w) + slack < p.min_speed_theta
    return not (slow and still) and (v, w) != (0.0, 0.0)


def roll_out(p, pose, velocity, sample):
    if p.discretize_by_time:
        n = math.ceil(p.sim_time / p.time_granularity)
    else:
        linear = abs(sample[0]) * p.sim_time / p.linear_granularity
        n = math.ceil(max(linear, abs(sample[1]) * p.sim_time / p.angular_granularity))
    n = max(n, 1)
    dt = p.sim_time / n
    x, y, yaw = pose
    v, w = velocity
    told = sample
    poses = [(x, y, yaw)]
    for k in range(n):
        if "Limited" in p.trajectory_generator_name:
            v, w = sample
        else:
            v = project(v, p.acc_lim_x, p.decel_lim_x, dt, sample[0])
            w = project(w, p.acc_lim_theta, p.decel_lim_theta, dt, sample[1])
        if k == 0 and p.limit_vel_cmd_in_traj:
            told = (v, w)
        x, y, yaw = x + v * math.cos(yaw) * dt, y + v * math.sin(yaw) * dt, yaw + w * dt
        poses.append((x, y, yaw))
    if p.include_last_point:
        poses.append(poses[-1])
    return Trajectory(*told, poses)


def distance(a, b):
    return math.hypot(a[0] - b[0], a[1] - b[1])


def near_plan(p, plan, pose, costmap):
    """The plan once pruned, and the part of it near the robot; Lyrical's local plan is both."""
    if p.release == "lyrical":
        return plan, plan
    half = max(costmap.costs.shape) * costmap.resolution / 2
    start = min(half, p.prune_distance) if p.prune_plan else half
    ahead = p.forward_prune_distance if p.forward_prune_distance >= 0 else math.inf
    search = p.prune_distance if p.release == "humble" else ahead
    end = min(half, ahead) if p.shorten_transformed_plan else half
    window, travelled = len(plan), 0.0
    for i in range(1, len(plan)):
        travelled += distance(plan[i - 1], plan[i])
        if travelled > search:
            window = i
            break
    first = next((i for i in range(window) if distance(plan[i], pose) < start), window)
    last = next((i for i in range(first, len(plan)) if distance(plan[i], pose) > end), len(plan))
    return (plan[first:] if p.prune_plan else plan), plan[first:last]


def without_gaps(plan, resolution):
    points = [tuple(plan[0][:2])]
    for a, b in itertools.pairwise(plan):
        gap = math.sqrt((b[0] - a[0]) ** 2 + (b[1] - a[1]) ** 2)
        parts = int((gap - 2 * resolution) / resolution) - 1 if gap > 2 * resolution else 0
        between = [j * ((b[k] - a[k]) / parts) + a[k] for j in range(1, parts) for k in (0, 1)]
        points += [*zip(between[::2], between[1::2], strict=True), tuple(b[:2])]
    return points


def cells_on_map(plan, costmap):
    run = []
    for x, y in without_gaps(plan, costmap.resolution):
        cell = costmap.world_to_map(x, y)
        if cell is not None and costmap.costs[cell] != 255:
            run.append(cell)
        elif run:
            break
    return run


def flood(seeds, shape):
    """Distances by a queue from cell to neighbour, obstacles ignored."""
    values = np.full(shape, shape[0] * shape[1] + 1)
    queue = deque(seeds)
    for seed in seeds:
        values[seed] = 0
    while queue:
        row, col = queue.popleft()
        for r, c in ((row - 1, col), (row + 1, col), (row, col - 1), (row, col + 1)):
            if 0 <= r < shape[0] and 0 <= c < shape[1] and values[r, c] > values[row, col] + 1:
                values[r, c] = values[row, col] + 1
                queue.append((r, c))
    return values


def line(a, b):
    """Cells of a Bresenham line, both ends included, as (row, col)."""
    (row, col), (row1, col1) = a, b
    d_row, d_col = abs(row1 - row), abs(col1 - col)
    along, across = ((0, 1 if col1 >= col else -1), (1 if row1 >= row else -1, 0))
    if d_col < d_row:
        along, across = across, along
    long, short = max(d_row, d_col), min(d_row, d_col)
    error = long // 2
    for _ in range(long + 1):
        yield row, col
        error += short
        if error >= long:
            error -= long
            row, col = row + across[0], col + across[1]
        row, col = row + along[0], col + along[1]


class Twin:
    """All critics on one scene, without memory: nothing has oscillated yet, RotateToGoal was just reset."""

    def __init__(self, params, corners, period):
        self.p, self.corners, self.period = params, corners, period

    def evaluate(self, plan, pose, velocity, costmap, goal=None):
        """Totals, raw scores, rejecting critics and the choice, by Nav2's own loop with its short circuit.

        The goal is the plan's last pose; Lyrical's local plan may end before it.
        """
        self.costmap, self.pose, self.velocity = costmap, pose, velocity
        plan, near = near_plan(self.p, plan, pose, costmap)
        self.goal = plan[-1] if goal is None else goal
        self.is_far = self.p.release == "lyrical" and sum(itertools.starmap(distance, itertools.pairwise(plan))) > 1.0
        self.prepare(near)
        rows, best, best_total = [], -1, np.float32(-1)
        for i, sample in enumerate(twists(self.p, velocity, self.period)):
            trajectory = roll_out(self.p, pose, velocity, sample)
            rows.append((sample, *self.judge(trajectory, None)))
            _, total, rejected = self.judge(trajectory, best_total)
            if rejected < 0 and (best_total < 0 or total < best_total):
                best, best_total = i, total
        return rows, best

    def prepare(self, near):
        shape = self.costmap.costs.shape
        path = cells_on_map(near, self.costmap)
        ahead = [tuple(pose) for pose in near]
        bearing = math.atan2(self.goal[1] - self.pose.y, self.goal[0] - self.pose.x)
        forward = self.p.GoalAlign.forward_point_distance
        x, y = ahead[-1][:2]
        ahead[-1] = (x + forward * math.cos(bearing), y + forward * math.sin(bearing))
        self.grids = {
            "PathDist": flood(path, shape),
            "PathAlign": flood(path, shape),
            "GoalDist": flood(path[-1:], shape),
            "GoalAlign": flood(cells_on_map(ahead, self.costmap)[-1:], shape),
        }

    def judge(self, trajectory, best_total):
        """Raw scores, total, first rejecting critic; stops early as Nav2 does when told of a best total."""
        scores, total = [], np.float32(0)
        for index, name in enumerate(self.p.critics):
            scale = np.float32(self.scale(name))
            raw = 0.0
            if scale != 0:
                try:
                    raw = self.score(name, trajectory)
                except Illegal:
                    return [-1.0] * len(self.p.critics), np.float32(-1), index
            scores.append(raw)
            with np.errstate(over="ignore"):  # products over many poses leave float32
                total = np.float32(np.float64(total) + raw * np.float64(scale))
            if best_total is not None and self.p.short_circuit_trajectory_evaluation and 0 < best_total < total:
                break
        return scores, total, -1

    def scale(self, name):
        scale = self.p.critic(name).scale
        if name in self.grids:
            near = distance(self.pose, self.goal) <= self.p.PathAlign.forward_point_distance
            return 0.0 if name == "PathAlign" and near else scale * self.costmap.resolution * 0.5
        return scale * self.costmap.resolution if name == "ObstacleFootprint" else scale

    def score(self, name, trajectory):
        if name in self.grids:
            return self.map_grid(name, trajectory)
        return getattr(self, name)(trajectory)

    def map_grid(self, name, trajectory):
        params, grid = self.p.critic(name), self.grids[name]
        forward = getattr(params, "forward_point_distance", 0.0)
        strict = not name.endswith("Align")
        only_last = params.aggregation_type == "last" and not strict
        score = 1.0 if params.aggregation_type == "product" else 0.0
        for x, y, yaw in trajectory.poses[-1:] if only_last else trajectory.poses:
            cell = self.costmap.world_to_map(x + forward * math.cos(yaw), y + forward * math.sin(yaw))
            if cell is OFF or (strict and grid[cell] == grid.size + 1):
                raise Illegal
            if params.aggregation_type == "last":
                score = float(grid[cell])
            elif params.aggregation_type == "sum":
                score += float(grid[cell])
            elif score > 0:
                score *= float(grid[cell])
        return score

    def BaseObstacle(self, trajectory):
        return self.obstacle("BaseObstacle", trajectory, self.centre_cost)

    def ObstacleFootprint(self, trajectory):
        return self.obstacle("ObstacleFootprint", trajectory, self.outline_cost)

    def obstacle(self, name, trajectory, cost_of):
        costs = [cost_of(*pose) for pose in trajectory.poses]
        return float(sum(costs) if self.p.critic(name).sum_scores else costs[-1])

    def centre_cost(self, x, y, yaw):
        cell = self.costmap.world_to_map(x, y)
        if cell is OFF or self.costmap.costs[cell] >= 253:
            raise Illegal
        return int(self.costmap.costs[cell])

    def outline_cost(self, x, y, yaw):
        cos, sin = math.cos(yaw), math.sin(yaw)
        points = [(x + (a * cos - b * sin), y + (a * sin + b * cos)) for a, b in self.corners]
        cells = [self.costmap.world_to_map(*point) for point in points]
        if OFF in cells or self.costmap.world_to_map(x, y) is OFF:
            raise Illegal
        edges = zip(cells, cells[1:] + cells[:1], strict=True)
        worst = max(int(self.costmap.costs[cell]) for a, b in edges for cell in line(a, b))
        if worst >= 254:
            raise Illegal
        return worst

    def RotateToGoal(self, trajectory):
        p, speed = self.p, self.velocity.v**2
        if distance(self.pose, self.goal) > p.xy_goal_tolerance or self.is_far:
            return 0.0
        end = trajectory.poses[-1][2]
        error = abs(math.remainder(self.goal[2] - end, math.tau))
        if speed <= p.trans_stopped_velocity**2:
            if trajectory.v != 0:
                raise Illegal
            return error
        if trajectory.v**2 >= speed:
            raise Illegal
        return trajectory.v**2 * p.RotateToGoal.slowing_factor + error

    def Oscillation(self, trajectory):
        return 0.0

    def PreferForward(self, trajectory):
        p = self.p.PreferForward
        if trajectory.v < 0 or (trajectory.v < p.strafe_x and abs(trajectory.w) < p.strafe_theta):
            return p.penalty
        return abs(trajectory.w) * p.theta_scale

    def Twirling(self, trajectory):
        return abs(trajectory.w)
