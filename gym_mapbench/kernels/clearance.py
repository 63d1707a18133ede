"""Exact distances between the robot's outline and walls, which are rectangles along the axes.

``boxes`` is ``(n, 4)`` left, bottom, right and top of every wall; ``area`` is the same of the map,
whose edge is a wall too. All in one unit.
"""

from __future__ import annotations

import math

import numpy as np

from gym_mapbench.kernels.jit import kernel


@kernel
def clearances_of_disc(boxes, area, poses, radius):
    """Clearance ``(n,)`` of a disc at every pose ``(n, 3)``; negative where it overlaps a wall."""
    clearances = np.empty(len(poses))
    for i in range(len(poses)):
        x, y = poses[i, 0], poses[i, 1]
        nearest = min(x - area[0], y - area[1], area[2] - x, area[3] - y)
        for k in range(len(boxes)):
            nearest = min(nearest, box_distance(x, y, boxes[k]))
        clearances[i] = nearest - radius
    return clearances


@kernel
def clearances_of_polygon(boxes, area, poses, footprint):
    """Clearance ``(n,)`` of a convex outline at every pose ``(n, 3)``; 0 where it meets a wall.

    Args:
        boxes: Walls.
        area: The map.
        poses: x, y, yaw.
        footprint: ``(n, 2)`` corners around the robot's origin, counter-clockwise.
    """
    reach = np.sqrt((footprint**2).sum(axis=1).max())
    clearances = np.empty(len(poses))
    for i in range(len(poses)):
        corners = place(footprint, poses[i])
        low_x, high_x = corners[:, 0].min(), corners[:, 0].max()
        low_y, high_y = corners[:, 1].min(), corners[:, 1].max()
        nearest = max(0.0, min(low_x - area[0], low_y - area[1], area[2] - high_x, area[3] - high_y))
        for k in range(len(boxes)):
            # No point of the outline is farther from its origin than `reach`: most walls need no closer look.
            if box_distance(poses[i, 0], poses[i, 1], boxes[k]) - reach < nearest:
                nearest = min(nearest, polygon_box_distance(corners, boxes[k]))
        clearances[i] = nearest
    return clearances


@kernel
def box_distance(x, y, box):
    """Distance from a point to a box; 0 inside."""
    dx = max(box[0] - x, x - box[2], 0.0)
    dy = max(box[1] - y, y - box[3], 0.0)
    return math.sqrt(dx * dx + dy * dy)


@kernel
def place(footprint, pose):
    """Return the corners ``(n, 2)`` of a footprint at a pose."""
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    corners = np.empty_like(footprint)
    for i in range(len(footprint)):
        corners[i, 0] = pose[0] + footprint[i, 0] * cos - footprint[i, 1] * sin
        corners[i, 1] = pose[1] + footprint[i, 0] * sin + footprint[i, 1] * cos
    return corners


@kernel
def polygon_box_distance(corners, box):
    """Distance between a convex counter-clockwise polygon and a box; 0 if they meet.

    Two convex shapes apart are nearest at a corner of one of them.
    """
    if not apart(corners, box):
        return 0.0
    nearest = math.inf
    n = len(corners)
    for i in range(n):
        nearest = min(nearest, box_distance(corners[i, 0], corners[i, 1], box))
        for corner in range(4):
            x, y = box[2 * (corner % 2)], box[1 + 2 * (corner // 2)]
            nearest = min(nearest, segment_distance(x, y, corners[i], corners[(i + 1) % n]))
    return nearest


@kernel
def apart(corners, box):
    """Whether an axis separates a convex counter-clockwise polygon from a box."""
    if corners[:, 0].max() < box[0] or corners[:, 0].min() > box[2]:
        return True
    if corners[:, 1].max() < box[1] or corners[:, 1].min() > box[3]:
        return True
    n = len(corners)
    for i in range(n):
        edge_x = corners[(i + 1) % n, 0] - corners[i, 0]
        edge_y = corners[(i + 1) % n, 1] - corners[i, 1]
        # The box's corner that lies farthest to the left of the edge, that is inwards.
        x = box[2] if edge_y < 0.0 else box[0]
        y = box[3] if edge_x > 0.0 else box[1]
        if edge_x * (y - corners[i, 1]) - edge_y * (x - corners[i, 0]) < 0.0:
            return True
    return False


@kernel
def segment_distance(x, y, first, second):
    """Distance from a point to a segment."""
    dx, dy = second[0] - first[0], second[1] - first[1]
    along = ((x - first[0]) * dx + (y - first[1]) * dy) / (dx * dx + dy * dy)
    along = min(max(along, 0.0), 1.0)
    return math.hypot(x - first[0] - along * dx, y - first[1] - along * dy)
