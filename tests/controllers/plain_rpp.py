"""A slow, literal Regulated Pure Pursuit, one step of the reference after the other, to hold the kernels against."""

from __future__ import annotations

import itertools
import math

INFINITE = float("inf")


def bresenham(row0, col0, row1, col1):
    cells = []
    d_row, d_col = abs(row1 - row0), abs(col1 - col0)
    s_row, s_col = (1 if row1 >= row0 else -1), (1 if col1 >= col0 else -1)
    long, short = max(d_row, d_col), min(d_row, d_col)
    error = long // 2
    for _ in range(long + 1):
        cells.append((row0, col0))
        error += short
        aside = error >= long
        if aside:
            error -= long
        if d_col >= d_row:
            col0, row0 = col0 + s_col, row0 + s_row * aside
        else:
            row0, col0 = row0 + s_row, col0 + s_col * aside
    return cells


def size_in_meters(costmap):
    """``(x, y)`` extent as Nav2's ``getSizeInMeters`` counts it before Lyrical: half a cell short, m."""
    rows, cols = costmap.costs.shape
    return (cols - 0.5) * costmap.resolution, (rows - 0.5) * costmap.resolution


def outline_cost(costmap, pose, corners):
    x, y, yaw = pose
    at = [
        costmap.world_to_map(
            x + (cx * math.cos(yaw) - cy * math.sin(yaw)), y + (cx * math.sin(yaw) + cy * math.cos(yaw))
        )
        for cx, cy in corners
    ]
    if None in at:
        return 254
    worst = 0
    # The closing edge runs from the first corner to the last.
    for a, b in [*itertools.pairwise(at), (at[0], at[-1])]:
        costs = [int(costmap.costs[cell]) for cell in bresenham(*a, *b)]
        worst = max(worst, 254 if 254 in costs else max(costs))
        if worst == 254:
            break
    return worst


class PlainRpp:
    """One call with all of section 6 spelled out; ``poses`` is what is left of the plan."""

    def __init__(self, params, setup, path):
        self.p, self.s = params, setup
        self.jazzy = params.release != "humble"
        self.reverses = params.allow_reversing and (self.jazzy or not params.use_rotate_to_heading)
        self.arrived = False
        self.poses = [tuple(map(float, pose)) for pose in path]
        self.carrot = None

    def __call__(self, pose, velocity, costmap):
        p = self.p
        x, y, yaw = pose
        extent = max(size_in_meters(costmap)) / 2
        search = p.max_robot_pose_search_dist
        if search is None:
            search = size_in_meters(costmap)[0] / 2 if self.jazzy else extent
        search = INFINITE if search < 0 else search
        local = self.local_plan(x, y, yaw, extent, search)
        if p.use_fixed_curvature_lookahead and p.interpolate_curvature_after_goal and len(self.poses) == 1:
            return "single"
        if not local:
            return "empty"
        self.carrot = cx, cy = self.find_carrot(local, self.lookahead(abs(velocity[0])))
        reach, sign = math.hypot(cx, cy), -1 if self.reverses and cx < 0 else 1
        if p.use_fixed_curvature_lookahead:
            cx, cy = self.find_carrot(local, p.curvature_lookahead_dist, p.interpolate_curvature_after_goal)
        bearing = math.atan2(sign * cy, sign * cx)
        arrived = reach < self.s.xy_goal_tolerance
        if p.stateful:
            arrived = self.arrived = arrived or self.arrived
        if p.use_rotate_to_heading and arrived:
            v, w = 0.0, self.rotate(local[-1][2], velocity[1])
        elif p.use_rotate_to_heading and abs(bearing) > p.rotate_to_heading_min_angle:
            v, w = 0.0, self.rotate(bearing, velocity[1])
        else:
            cell = costmap.world_to_map(x, y)
            if cell is None:
                return "off"
            square = cx * cx + cy * cy
            curvature = 2 * cy / square if square > 0.001 else 0.0
            v = sign * self.speed(local, curvature, int(costmap.costs[cell]))
            w = v * curvature
        seconds = p.max_allowed_time_to_collision_up_to_carrot
        if p.use_collision_detection and self.collides(pose, v, w, reach, seconds, costmap):
            return "collision"
        return v, w

    def local_plan(self, x, y, yaw, extent, search):
        length, candidates = 0.0, []
        for i, pose in enumerate(self.poses):
            if i:
                length += math.dist(pose[:2], self.poses[i - 1][:2])
            if length > search:
                break
            candidates.append(math.dist(pose[:2], (x, y)))
        if candidates:
            nearest = candidates.index(min(candidates))
            if self.jazzy:
                nearest = len(candidates) - 1 - candidates[::-1].index(min(candidates))
                if nearest == len(candidates) - 1 and len(self.poses) > 1:
                    nearest = max(nearest - 1, 0)
            self.poses = self.poses[nearest:]
        local = []
        for px, py, pyaw in self.poses:
            dx, dy = px - x, py - y
            if math.hypot(dx, dy) > extent:
                break
            turned = math.atan2(math.sin(pyaw - yaw), math.cos(pyaw - yaw))
            local.append((dx * math.cos(yaw) + dy * math.sin(yaw), -dx * math.sin(yaw) + dy * math.cos(yaw), turned))
        return local

    def lookahead(self, speed):
        p = self.p
        if p.use_velocity_scaled_lookahead_dist:
            return min(max(speed * p.lookahead_time, p.min_lookahead_dist), p.max_lookahead_dist)
        return p.lookahead_dist

    def find_carrot(self, local, lookahead, beyond=False):
        p = self.p
        if self.reverses:
            for (ax, ay, a), (bx, by, b), (cx, cy, c) in zip(local, local[1:], local[2:], strict=False):
                turns = ((ax, ay) == (bx, by) and a != b) or ((bx, by) == (cx, cy) and b != c)
                if (bx - ax) * (cx - bx) + (by - ay) * (cy - by) < 0 or (self.jazzy and turns):
                    lookahead = min(lookahead, math.hypot(bx, by))
                    break
        far = [i for i, (px, py, _) in enumerate(local) if math.hypot(px, py) >= lookahead]
        if not far and beyond and len(local) > 1:
            # Where the line through the last segment meets the circle: ahead, if it leads away from the robot.
            (ax, ay, _), (bx, by, _) = local[-2:]
            heading = math.atan2(by - ay, bx - ax)
            cos, sin = math.cos(heading), math.sin(heading)
            along = bx * cos + by * sin
            root = math.sqrt(along**2 - bx**2 - by**2 + lookahead**2)
            outwards = math.hypot(bx + lookahead * cos, by + lookahead * sin) > math.hypot(bx, by)
            way = -along + (root if outwards else -root)
            return bx + way * cos, by + way * sin
        if not far:
            return local[-1][:2]
        i = far[0]
        if i == 0 or not (p.use_interpolation or self.jazzy):
            return local[i][:2]
        # Bisection instead of the closed form: the segment crosses the circle outwards exactly once.
        (ax, ay, _), (bx, by, _) = local[i - 1], local[i]
        low, high = 0.0, 1.0
        for _ in range(80):
            t = (low + high) / 2
            inside = math.hypot(ax + t * (bx - ax), ay + t * (by - ay)) < lookahead
            low, high = (t, high) if inside else (low, t)
        return ax + low * (bx - ax), ay + low * (by - ay)

    def rotate(self, angle, turn_rate):
        p = self.p
        sign = 1 if angle > 0 else -1
        step = p.max_angular_accel * self.s.control_period
        w = min(max(sign * p.rotate_to_heading_angular_vel, turn_rate - step), turn_rate + step)
        limit = math.sqrt(2 * p.max_angular_accel * abs(angle))
        return sign * limit if abs(w) > limit else w

    def speed(self, local, curvature, cost):
        p = self.p
        base = on_curve = near = p.desired_linear_vel
        if p.use_regulated_linear_velocity_scaling and curvature:
            radius = 1 / abs(curvature)
            if radius < p.regulated_linear_scaling_min_radius:
                on_curve = base * radius / p.regulated_linear_scaling_min_radius
        if p.use_cost_regulated_linear_velocity_scaling and cost not in (0, 255):
            away = (
                self.s.footprint.inscribed_radius
                - math.log(cost / (253 if self.jazzy else 252)) / p.inflation_cost_scaling_factor
            )
            if away < p.cost_scaling_dist:
                near = base * p.cost_scaling_gain * away / p.cost_scaling_dist
        v = max(min(on_curve, near), p.regulated_linear_scaling_min_speed)
        length = sum(math.dist(a[:2], b[:2]) for a, b in itertools.pairwise(local))
        share = 1.0
        if length < p.approach_velocity_scaling_dist:
            share = math.hypot(*local[-1][:2]) / p.approach_velocity_scaling_dist
        return min(v, max(v * share, p.min_approach_linear_velocity), base)

    def collides(self, pose, v, w, reach, seconds, costmap):
        if self.touches(pose, costmap):
            return True
        if abs(v) < 0.01 and abs(w) > 0.01:
            step = 2 * math.sin(costmap.resolution / 2 / self.s.footprint.circumscribed_radius) / abs(w)
        else:
            step = costmap.resolution / abs(v) if v else INFINITE
        x, y, yaw = pose
        i = 1
        while i * step < seconds:
            x, y = x + step * v * math.cos(yaw), y + step * v * math.sin(yaw)
            yaw += step * w
            if math.dist((x, y), pose[:2]) > reach:
                return False
            if self.touches((x, y, yaw), costmap):
                return True
            i += 1
        return False

    def touches(self, pose, costmap):
        if costmap.world_to_map(*pose[:2]) is None:
            return False
        cost = outline_cost(costmap, pose, self.s.footprint.corners)
        return cost >= 254 and not (cost == 255 and costmap.track_unknown_space)
