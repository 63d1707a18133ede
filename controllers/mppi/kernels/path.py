"""Scores that compare trajectories with the path."""

from __future__ import annotations

import numpy as np

from controllers.mppi.kernels.elementary import ZERO
from gym_mapbench.kernels.geometry import cell_index
from gym_mapbench.kernels.jit import kernel

FAR = np.float32(np.inf)

# One sample in so many of the first block is searched in full, for a first guess of how far all of them come.
GUESS_EVERY = 32


@kernel
def find_valid(x, y, costs, call, valid):
    """Write whether each path point but the last lies on the map and off obstacles (``setPathCostsIfNotSet``)."""
    rows, cols = costs.shape
    for i in range(len(x) - 1):
        cell = cell_index(np.float64(x[i]), np.float64(y[i]), call.origin_x, call.origin_y, call.resolution, rows, cols)
        cost = 254 if cell < 0 else int(costs[cell // cols, cell % cols])
        valid[i] = cost < 253 or (cost == 255 and call.unknown_is_free)
    valid[len(x) - 1] = True


@kernel
def nearest_point(x, y, point_x, point_y):
    """Index of the first of the path points nearest to a point."""
    best, nearest = FAR, 0
    for i in range(len(x)):
        dx, dy = x[i] - point_x, y[i] - point_y
        distance = dx * dx + dy * dy
        if distance < best:
            best, nearest = distance, i
    return nearest


@kernel
def _last_possible(path_x, path_y, left, right, low, high):
    """Last path point that can be nearest to a point of a box: those after it are never nearer than the one before."""
    i = len(path_x) - 1
    while i > 0:
        dx, dy = path_x[i] - path_x[i - 1], path_y[i] - path_y[i - 1]
        x = right if dx > ZERO else left
        y = high if dy > ZERO else low
        middle_x, middle_y = (path_x[i] + path_x[i - 1]) / 2, (path_y[i] + path_y[i - 1]) / 2
        if dx * (x - middle_x) + dy * (y - middle_y) >= -1e-5 * (abs(dx) + abs(dy)):
            break
        i -= 1
    return i


@kernel
def _nearer_beyond(path_x, path_y, reached, last, x, y, row, nearest):
    """Write the squared distance of each point of a row from the nearest path point after ``reached``."""
    for k in range(len(nearest)):
        nearest[k] = FAR
    for i in range(reached + 1, last + 1):
        for k in range(len(nearest)):
            dx, dy = path_x[i] - x[row, k], path_y[i] - y[row, k]
            distance = dx * dx + dy * dy
            nearest[k] = distance if distance < nearest[k] else nearest[k]


@kernel
def _bounds(x, y):
    """Box around all points: left, right, low, high."""
    left, right, low, high = x[0, 0], x[0, 0], y[0, 0], y[0, 0]
    for b in range(x.shape[0]):
        for k in range(x.shape[1]):
            left = x[b, k] if x[b, k] < left else left
            right = x[b, k] if x[b, k] > right else right
            low = y[b, k] if y[b, k] < low else low
            high = y[b, k] if y[b, k] > high else high
    return left, right, low, high


@kernel
def _is_nearer_beyond(path_x, path_y, reached, last, x, y):
    """Whether one of the path points after ``reached`` is nearer to a point than ``reached`` is."""
    dx, dy = path_x[reached] - x, path_y[reached] - y
    limit = dx * dx + dy * dy
    for i in range(reached + 1, last + 1):
        dx, dy = path_x[i] - x, path_y[i] - y
        if dx * dx + dy * dy < limit:
            return True
    return False


@kernel
def furthest_reached(path_x, path_y, x, y, samples, onwards):
    """Largest index of the path points nearest to the samples' last points.

    Only path points beyond the furthest found so far are compared with all samples; a sample that is nearer to
    one of those than to the furthest itself is then searched in full, so the result is that of a full search.
    With ``onwards`` (Jazzy) each search begins at the furthest point found so far, which can lead further.

    Args:
        path_x: ``(points,)`` m.
        path_y: The same.
        x: ``(blocks, samples)`` last points, m.
        y: The same.
        samples: How many of them count.
        onwards: Whether no sample is compared with path points before the furthest found so far.
    """
    left, right, low, high = _bounds(x, y)
    last = _last_possible(path_x, path_y, left, right, low, high)
    reached, width = np.int64(0), x.shape[1]
    nearest = np.empty(width, dtype=np.float32)
    for k in range(0, min(samples, width), width if onwards else GUESS_EVERY):
        reached = max(reached, nearest_point(path_x, path_y, x[0, k], y[0, k]))
    for b in range(x.shape[0]):
        _nearer_beyond(path_x, path_y, reached, last, x, y, b, nearest)
        for k in range(min(width, samples - b * width)):
            dx, dy = path_x[reached] - x[b, k], path_y[reached] - y[b, k]
            if nearest[k] >= dx * dx + dy * dy:
                continue
            if _is_nearer_beyond(path_x, path_y, reached, last, x[b, k], y[b, k]):
                first = reached if onwards else 0
                reached = max(reached, first + nearest_point(path_x[first:], path_y[first:], x[b, k], y[b, k]))
    return reached


@kernel
def score_follow(x, y, target_x, target_y, scores):
    """Write the distance of each sample's last point from the target."""
    for b in range(x.shape[0]):
        for k in range(x.shape[1]):
            dx, dy = x[b, k] - target_x, y[b, k] - target_y
            scores[b, k] = np.sqrt(dx * dx + dy * dy)
