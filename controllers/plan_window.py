"""The part of the plan that lies ahead of the robot."""

from __future__ import annotations

import math

from gym_mapbench.kernels.geometry import cell_index
from gym_mapbench.kernels.jit import kernel


@kernel
def _first_beyond(steps, begin, length):
    """Index of the first pose whose distance along the path from pose ``begin`` exceeds ``length``; else the end."""
    travelled = 0.0
    for i in range(begin, len(steps)):
        travelled += steps[i]
        if travelled > length:
            return i + 1
    return len(steps) + 1


@kernel
def find_window(path, steps, passed, x, y, search, prune, place, shape, last_of_equals, keeps_segment):
    """Return ``(first, end)`` of the local path: from the nearest pose on, as far as ``prune`` and the costmap reach.

    Args:
        path: ``(n, 3)`` plan.
        steps: ``(n - 1,)`` distances between its poses, m.
        passed: Number of poses that the robot has passed.
        x: Position of the robot, m.
        y: Position of the robot, m.
        search: Length of path in which the nearest pose is sought, m.
        prune: Length of the local path, m.
        place: ``(resolution, origin_x, origin_y)`` of the costmap.
        shape: ``(rows, cols)`` of the costmap.
        last_of_equals: Whether of equally near poses the last is taken, rather than the first.
        keeps_segment: Whether the pose before the last is taken if the last is nearest, so that a segment remains.
    """
    best, first = math.inf, passed
    for i in range(passed, _first_beyond(steps, passed, search)):
        distance = math.hypot(path[i, 0] - x, path[i, 1] - y)
        if distance < best or (last_of_equals and distance == best):
            best, first = distance, i
    if keeps_segment and len(path) > 1:
        first = min(first, len(path) - 2)
    end = _first_beyond(steps, first, prune)
    for i in range(first, end):
        if cell_index(path[i, 0], path[i, 1], place[1], place[2], place[0], shape[0], shape[1]) < 0:
            return first, i
    return first, end
