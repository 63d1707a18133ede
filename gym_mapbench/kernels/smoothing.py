"""Smoothing of paths: points that are pulled towards their neighbours, and a filter along the path.

Source: nav2_smac_planner/src/smoother.cpp and nav2_smoother/src/simple_smoother.cpp, which smooth alike (Humble);
nav2_smoother/src/savitzky_golay_smoother.cpp (Humble, Jazzy and Lyrical).
"""

from __future__ import annotations

from gym_mapbench.kernels.geometry import cell_index
from gym_mapbench.kernels.jit import kernel

MAX_NON_OBSTACLE = 252
UNKNOWN = 255


@kernel
def smooth(path, costs, resolution, origin_x, origin_y, w_data, w_smooth, tolerance, max_iterations):
    """Pull the inner points of ``path`` ``(n, 2)`` m towards their neighbours until they rest.

    Returns:
        The path, and whether it came to rest; else it is that of the last round without a collision.
    """
    smoothed, last = path.copy(), path.copy()
    rows, cols = costs.shape
    for _ in range(max_iterations - 1):
        change = 0.0
        for i in range(1, len(path) - 1):
            for axis in range(2):
                old = smoothed[i, axis]
                bend = smoothed[i + 1, axis] + smoothed[i - 1, axis] - 2.0 * old
                smoothed[i, axis] = old + w_data * (path[i, axis] - old) + w_smooth * bend
                change += abs(smoothed[i, axis] - old)
            cell = cell_index(smoothed[i, 0], smoothed[i, 1], origin_x, origin_y, resolution, rows, cols)
            if cell < 0 or MAX_NON_OBSTACLE < costs[cell // cols, cell % cols] < UNKNOWN:
                return last, False
        for i in range(len(path)):
            last[i, 0], last[i, 1] = smoothed[i, 0], smoothed[i, 1]
        if change < tolerance:
            return smoothed, True
    return last, False


@kernel
def smooth_and_refine(
    path, costs, resolution, origin_x, origin_y, w_data, w_smooth, tolerance, max_iterations, refinements
):
    """Smooth a path ``(n, 2)`` m, then smooth the result as often as wanted, as long as it comes to rest.

    Returns:
        The path, whether it came to rest at first, and the number of refinements that were begun.
    """
    grid = costs, resolution, origin_x, origin_y
    points, first = smooth(path, *grid, w_data, w_smooth, tolerance, max_iterations)
    rests, done = first, 0
    while rests and done < refinements:
        points, rests = smooth(points, *grid, w_data, w_smooth, tolerance, max_iterations)
        done += 1
    return points, first, done


@kernel
def filter_along(points, coefficients, in_place):
    """Return points ``(n, 2)`` m filtered by ``coefficients`` ``(w,)`` along the path; both ends stay.

    Beyond an end the window holds that end. Humble filters ``in_place``: the points before are the filtered ones, and
    it leaves out the fourth point from the end.
    """
    filtered = points.copy()
    source = filtered if in_place else points
    last, half = len(points) - 1, len(coefficients) // 2
    for i in range(1, last):
        if in_place and i == last - 3:
            continue
        x = y = 0.0
        for j in range(len(coefficients)):
            k = min(max(i + j - half, 0), last)
            x += coefficients[j] * source[k, 0]
            y += coefficients[j] * source[k, 1]
        filtered[i, 0], filtered[i, 1] = x, y
    return filtered
