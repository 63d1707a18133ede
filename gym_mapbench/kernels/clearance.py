"""Exact distances between the robot's outline and the squares of occupied cells."""

from __future__ import annotations

import math

import numpy as np

from gym_mapbench.kernels.jit import kernel


@kernel
def clearances_of_disc(occupancy, resolution, origin_x, origin_y, poses, radius):
    """Clearance ``(n,)`` of a disc at every pose ``(n, 3)``, m; negative where it overlaps a wall."""
    clearances = np.empty(len(poses))
    for i in range(len(poses)):
        distance = point_clearance(occupancy, resolution, origin_x, origin_y, poses[i, 0], poses[i, 1])
        clearances[i] = distance - radius
    return clearances


@kernel
def clearances_of_polygon(occupancy, resolution, origin_x, origin_y, poses, footprint):
    """Clearance ``(n,)`` of a convex outline at every pose ``(n, 3)``, m; 0 where it meets a wall."""
    clearances = np.empty(len(poses))
    for i in range(len(poses)):
        x, y, yaw = poses[i]
        clearances[i] = polygon_clearance(occupancy, resolution, origin_x, origin_y, x, y, yaw, footprint)
    return clearances


@kernel
def point_clearance(occupancy, resolution, origin_x, origin_y, x, y):
    """Distance from a point on the map to the nearest occupied cell's square or the map's edge, m.

    Rings of cells are searched from the point outwards until no further one can be nearer.
    """
    rows, cols = occupancy.shape
    across, up = (x - origin_x) / resolution, (y - origin_y) / resolution
    nearest = min(across, cols - across, up, rows - up)
    row, col = int(up), int(across)
    ring = 0
    while ring - 1 < nearest:
        for r in range(max(0, row - ring), min(rows, row + ring + 1)):
            step = 1 if abs(r - row) == ring or ring == 0 else 2 * ring
            for c in range(col - ring, col + ring + 1, step):
                if 0 <= c < cols and occupancy[r, c]:
                    nearest = min(nearest, square_distance(across, up, c, r))
        ring += 1
    return nearest * resolution


@kernel
def square_distance(x, y, left, bottom):
    """Distance from a point to the unit square whose lower-left corner is ``(left, bottom)``."""
    dx = max(left - x, x - left - 1.0, 0.0)
    dy = max(bottom - y, y - bottom - 1.0, 0.0)
    return math.sqrt(dx * dx + dy * dy)


@kernel
def polygon_clearance(occupancy, resolution, origin_x, origin_y, x, y, yaw, footprint):
    """Distance from a convex outline to the nearest occupied cell's square or the map's edge, m; 0 if they meet.

    Args:
        occupancy: ``(rows, cols)`` bool.
        resolution: Side of a cell, m.
        origin_x: World x of the map's lower-left corner, m.
        origin_y: World y of it, m.
        x: Robot on the map, m.
        y: Robot, m.
        yaw: Robot, rad.
        footprint: ``(n, 2)`` corners around the robot's origin, counter-clockwise, m.
    """
    rows, cols = occupancy.shape
    corners = place(footprint, (x - origin_x) / resolution, (y - origin_y) / resolution, yaw, 1.0 / resolution)
    left, right = corners[:, 0].min(), corners[:, 0].max()
    bottom, top = corners[:, 1].min(), corners[:, 1].max()
    nearest = max(0.0, min(left, cols - right, bottom, rows - top))
    # The outline is around the robot's origin, so no wall is farther from it than from the origin.
    nearest = min(nearest, point_clearance(occupancy, resolution, origin_x, origin_y, x, y) / resolution)
    reach = int(nearest) + 1
    for row in range(max(0, int(bottom) - reach), min(rows, int(top) + reach + 1)):
        for col in range(max(0, int(left) - reach), min(cols, int(right) + reach + 1)):
            if occupancy[row, col]:
                nearest = min(nearest, polygon_square_distance(corners, col, row))
    return nearest * resolution


@kernel
def place(footprint, x, y, yaw, scale):
    """Return the corners ``(n, 2)`` of a footprint, scaled, turned and moved."""
    cos, sin = math.cos(yaw) * scale, math.sin(yaw) * scale
    corners = np.empty_like(footprint)
    for i in range(len(footprint)):
        corners[i, 0] = x + footprint[i, 0] * cos - footprint[i, 1] * sin
        corners[i, 1] = y + footprint[i, 0] * sin + footprint[i, 1] * cos
    return corners


@kernel
def polygon_square_distance(corners, left, bottom):
    """Distance between a convex counter-clockwise polygon and a unit square; 0 if they meet.

    Two convex shapes apart are nearest at a corner of one of them.
    """
    if not apart(corners, left, bottom):
        return 0.0
    nearest = math.inf
    n = len(corners)
    for i in range(n):
        nearest = min(nearest, square_distance(corners[i, 0], corners[i, 1], left, bottom))
        x0, y0 = corners[i, 0], corners[i, 1]
        x1, y1 = corners[(i + 1) % n, 0], corners[(i + 1) % n, 1]
        for corner in range(4):
            nearest = min(nearest, segment_distance(left + corner % 2, bottom + corner // 2, x0, y0, x1, y1))
    return nearest


@kernel
def apart(corners, left, bottom):
    """Whether an axis separates a convex counter-clockwise polygon from a unit square."""
    if corners[:, 0].max() < left or corners[:, 0].min() > left + 1:
        return True
    if corners[:, 1].max() < bottom or corners[:, 1].min() > bottom + 1:
        return True
    n = len(corners)
    for i in range(n):
        edge_x = corners[(i + 1) % n, 0] - corners[i, 0]
        edge_y = corners[(i + 1) % n, 1] - corners[i, 1]
        # The square's corner that lies farthest to the left of the edge, that is inwards.
        x = left + (1 if edge_y < 0.0 else 0)
        y = bottom + (1 if edge_x > 0.0 else 0)
        if edge_x * (y - corners[i, 1]) - edge_y * (x - corners[i, 0]) < 0.0:
            return True
    return False


@kernel
def segment_distance(x, y, x0, y0, x1, y1):
    """Distance from a point to a segment."""
    dx, dy = x1 - x0, y1 - y0
    along = ((x - x0) * dx + (y - y0) * dy) / (dx * dx + dy * dy)
    along = min(max(along, 0.0), 1.0)
    return math.hypot(x - x0 - along * dx, y - y0 - along * dy)
