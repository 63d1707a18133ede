"""How far along the path the trajectories reach, by their own lengths (Lyrical).

Source: nav2_mppi_controller (Lyrical): tools/utils.hpp (findPathFurthestReachedPoint).
"""

from __future__ import annotations

import numpy as np

from controllers.mppi.kernels.align import measure_path
from controllers.mppi.kernels.elementary import ONE, ZERO
from gym_mapbench.kernels.jit import kernel

FAR = np.float32(np.inf)


@kernel
def _write_lengths(speeds, dt, lengths):
    """Write the length of each trajectory of a block between its first and its last point, m; return the largest.

    Args:
        speeds: ``(time_steps, samples)`` m/s; the last moves nothing.
        dt: Period, s.
        lengths: ``(samples,)`` written.
    """
    longest = ZERO
    for k in range(len(lengths)):
        lengths[k] = ZERO
    for t in range(len(speeds) - 1):
        for k in range(len(lengths)):
            lengths[k] += abs(speeds[t, k]) * dt
    for k in range(len(lengths)):
        longest = max(longest, lengths[k])
    return longest


@kernel
def _find_nearest(path_x, path_y, arc, x, y, lengths, longest, best, nearest):
    """Write the first of the path points nearest to each point, among those that its trajectory is long enough for."""
    for k in range(len(x)):
        best[k], nearest[k] = FAR, 0
    before = -ONE
    for i in range(len(path_x)):
        if before >= longest:
            return
        for k in range(len(x)):
            dx, dy = path_x[i] - x[k], path_y[i] - y[k]
            distance = dx * dx + dy * dy
            nearer = (distance < best[k]) & (before < lengths[k])
            best[k] = distance if nearer else best[k]
            nearest[k] = np.int32(i) if nearer else nearest[k]
        before = arc[i]


@kernel
def furthest_within_length(path_x, path_y, x, y, speeds, dt, samples):
    """Largest index of the path points nearest to the samples' last points.

    A sample is compared with the path points up to the first that is as far along the path as the sample's trajectory
    is long.

    Args:
        path_x: ``(points,)`` m.
        path_y: The same.
        x: ``(blocks, samples)`` last points, m.
        y: The same.
        speeds: ``(blocks, time_steps, samples)`` m/s.
        dt: Period, s.
        samples: How many samples count.
    """
    width, furthest = x.shape[1], np.int64(0)
    arc, lengths = np.empty(len(path_x), dtype=np.float32), np.empty(width, dtype=np.float32)
    best, nearest = np.empty(width, dtype=np.float32), np.empty(width, dtype=np.int32)
    measure_path(path_x, path_y, arc)
    for b in range(len(x)):
        longest = _write_lengths(speeds[b], dt, lengths)
        _find_nearest(path_x, path_y, arc, x[b], y[b], lengths, longest, best, nearest)
        for k in range(min(width, samples - b * width)):
            furthest = max(furthest, np.int64(nearest[k]))
    return furthest
