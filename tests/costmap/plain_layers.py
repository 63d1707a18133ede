"""Slow twins of the layers' kernels, cell by cell, as the reference tells it; a voxel is a bool of its own here."""

from __future__ import annotations

import math

import numpy as np

LETHAL = 254
UNKNOWN = 255


def plain_line(start, end):
    """Bresenham's line between two cells of any dimension, both included."""
    deltas = [b - a for a, b in zip(start, end, strict=True)]
    longest = max(abs(delta) for delta in deltas)
    cell, errors, cells = list(start), [longest // 2] * len(start), [tuple(start)]
    for _ in range(longest):
        for axis, delta in enumerate(deltas):
            errors[axis] += abs(delta)
            if errors[axis] >= longest:
                errors[axis] -= longest
                cell[axis] += int(np.sign(delta))
        cells.append(tuple(cell))
    return cells


def cell_of(x, y, resolution, origin, shape):
    """``(row, col)`` of a point, None off the grid."""
    if x < origin[0] or y < origin[1]:
        return None
    row, col = int((y - origin[1]) / resolution), int((x - origin[0]) / resolution)
    return (row, col) if row < shape[0] and col < shape[1] else None


def plain_touch(box, x, y):
    box[:] = min(box[0], x), min(box[1], y), max(box[2], x), max(box[3], y)


def plain_touch_ray(box, sensor, end, ranges):
    distance = math.hypot(end[0] - sensor[0], end[1] - sensor[1])
    if distance >= ranges[0]:
        share = min(1.0, ranges[1] / distance) if distance else 1.0
        plain_touch(box, *(a + (b - a) * share for a, b in zip(sensor, end, strict=True)))


def shortened(start, end, resolution, ranges, length):
    """First cell of a line and how many steps of it count, as two ranges (m) allow; None if it is too short."""
    nearest, farthest = (math.ceil(value / resolution) for value in ranges)
    if length < nearest:
        return None
    share = min(1.0, farthest / length) if length else 1.0
    if length:
        start = tuple(a + (b - a) / length * nearest for a, b in zip(start, end, strict=True))
    return tuple(int(value) for value in start), share


def plain_clear_rays(layer, resolution, origin, sensor, points, ranges, box):
    """The rays of the two-dimensional layer."""
    start = cell_of(*sensor, resolution, origin, layer.shape)
    if start is None:
        return
    plain_touch(box, *sensor)
    top = [origin[axis] + layer.shape[1 - axis] * resolution for axis in (0, 1)]
    for point in points.astype(float):
        end, delta = list(point), point - sensor
        for axis, low in ((0, True), (1, True), (0, False), (1, False)):
            border = origin[axis] if low else top[axis]
            if (end[axis] < border) if low else (end[axis] > border):
                share = (border - sensor[axis]) / delta[axis]
                end[1 - axis] = sensor[1 - axis] + delta[1 - axis] * share
                end[axis] = border if low else border - 0.001
        last = cell_of(*end, resolution, origin, layer.shape)
        if last is None:
            continue
        length = math.hypot(last[0] - start[0], last[1] - start[1])
        counted = shortened(start, last, resolution, ranges, length)
        if counted is not None:
            line = plain_line(counted[0], last)
            for cell in line[: int(counted[1] * (len(line) - 1)) + 1]:
                layer[cell] = 0
        plain_touch_ray(box, sensor, end, ranges)


def plain_mark_hits(layer, resolution, origin, sensor, points, ranges, in_meters, box):
    """The hits of the two-dimensional layer."""
    start = cell_of(*sensor, resolution, origin, layer.shape)
    if start is None:
        return
    nearest, farthest = (math.ceil(value / resolution) for value in ranges)
    for x, y in points.astype(float):
        cell = cell_of(x, y, resolution, origin, layer.shape)
        squared = (x - sensor[0]) ** 2 + (y - sensor[1]) ** 2
        if cell is None or (in_meters and not ranges[0] ** 2 <= squared <= ranges[1] ** 2):
            continue
        if nearest <= int(math.hypot(cell[1] - start[1], cell[0] - start[0])) <= farthest:
            layer[cell] = LETHAL
            plain_touch(box, x, y)


class PlainVoxels:
    """The voxel layer: which voxels are marked, which were never seen."""

    def __init__(self, layer, levels, resolution, z_resolution, origin, thresholds):
        self.layer, self.levels, self.resolution, self.z_resolution = layer, levels, resolution, z_resolution
        self.origin, self.mark_threshold, self.unknown_threshold = origin, *thresholds
        self.marked = np.zeros((*layer.shape, 16), bool)
        self.unknown = np.ones((*layer.shape, 16), bool)

    def place(self, point):
        """Continuous ``(row, col, level)`` of a point, None off the grid."""
        x, y, z = (a - b for a, b in zip(point, self.origin, strict=True))
        if not (x >= 0 and y >= 0 and z >= 0):
            return None
        at = y / self.resolution, x / self.resolution, z / self.z_resolution
        return at if all(a < n for a, n in zip(at, (*self.layer.shape, self.levels), strict=True)) else None

    def clear(self, sensor, points, z, ranges, size, pull_in, box):
        start = self.place(sensor)
        if start is None:
            return
        top = [self.origin[axis] + size[axis] for axis in (0, 1)]
        highest = self.origin[2] + (self.levels - 0.5) * self.z_resolution
        for point in points.astype(float):
            delta = np.array([*point, z]) - sensor
            distance = math.sqrt(delta[0] * delta[0] + delta[1] * delta[1] + delta[2] * delta[2])
            short = max(min(1.0, (distance - 2 * self.resolution) / distance), 0.0) if distance else 0.0
            end = short * delta + sensor
            delta, share, cut = end - sensor, 1.0, False
            with np.errstate(divide="ignore"):
                if end[2] > highest:
                    share, cut = max(0.0, min(share, (highest - 0.01 - sensor[2]) / delta[2])), True
                elif end[2] < self.origin[2]:
                    share, cut = min(share, (self.origin[2] - sensor[2]) / delta[2]), True
            for axis in (0, 1):
                for border, outside in (
                    (self.origin[axis], end[axis] < self.origin[axis]),
                    (top[axis], end[axis] > top[axis]),
                ):
                    if outside:
                        with np.errstate(divide="ignore"):
                            share, cut = min(share, (border - sensor[axis]) / delta[axis]), True
            if cut and pull_in:
                share -= float(np.sign(share)) * 1e-5
            with np.errstate(invalid="ignore"):
                end = np.array(sensor) + delta * share
            last = self.place(end)
            if last is not None:
                self._free_line(start, last, ranges)
                plain_touch_ray(box, sensor[:2], end[:2], ranges)

    def _free_line(self, start, last, ranges):
        length = math.sqrt(
            sum((a - b) ** 2 for a, b in zip((last[1], last[0], last[2]), (start[1], start[0], start[2]), strict=True))
        )
        nearest = math.ceil(ranges[0] / self.resolution)
        if int(length) < nearest:
            return
        share = min(1.0, math.ceil(ranges[1] / self.resolution) / length) if length else 1.0
        first = [a + (b - a) / length * nearest for a, b in zip(start, last, strict=True)] if length else start
        line = plain_line([int(a) for a in first], [int(a) for a in last])
        for row, col, level in line[: int(share * (len(line) - 1)) + 1]:
            self.marked[row, col, level] = self.unknown[row, col, level] = False
            if self.marked[row, col].sum() <= self.mark_threshold:
                free = self.unknown[row, col].sum() <= self.unknown_threshold
                self.layer[row, col] = 0 if free else UNKNOWN

    def mark(self, sensor, points, z, level, ranges, box):
        for x, y in points.astype(float):
            cell = cell_of(x, y, self.resolution, self.origin[:2], self.layer.shape)
            squared = (x - sensor[0]) ** 2 + (y - sensor[1]) ** 2 + (z - sensor[2]) ** 2
            if cell is None or not ranges[0] ** 2 <= squared < ranges[1] ** 2:
                continue
            self.marked[*cell, level], self.unknown[*cell, level] = True, False
            if self.marked[cell].sum() > self.mark_threshold:
                self.layer[cell] = LETHAL
                plain_touch(box, x, y)

    @property
    def columns(self):
        """The voxels as the kernels have them."""
        bits = 1 << np.arange(16)
        return (self.marked * (bits << 16)).sum(axis=2) + ((self.marked | self.unknown) * bits).sum(axis=2)


def plain_combine(master, layer, cells, method):
    """Write one layer into the master grid."""
    row0, col0, row1, col1 = cells
    for row in range(row0, row1):
        for col in range(col0, col1):
            old, new = master[row, col], layer[row, col]
            writes = {
                "true_overwrite": True,
                "overwrite": new != UNKNOWN,
                "max": new != UNKNOWN and (old == UNKNOWN or new > old),
                "max_without_unknown_overwrite": new != UNKNOWN and old != UNKNOWN and new > old,
            }
            if writes[method]:
                master[row, col] = new


def plain_project(ranges, angle_min, increment, range_min, range_max, yaw, x, y):
    """Points of a scan in single precision."""
    single = np.float32
    kept = (ranges >= single(range_min)) & (ranges < single(range_max))
    angles = float(single(angle_min)) + np.arange(len(ranges)) * float(single(increment))
    ahead, left = ((ranges[kept] * part[kept]).astype(single) for part in (np.cos(angles), np.sin(angles)))
    z, w = single(math.sin(yaw / 2)), single(math.cos(yaw / 2))
    cos, sin = single(1) - single(2) * z * z, single(2) * z * w
    return np.stack([cos * ahead - sin * left + single(x), sin * ahead + cos * left + single(y)], axis=1)
