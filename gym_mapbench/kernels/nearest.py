"""The nearest of some points, by the sum of the differences of their coordinates."""

from __future__ import annotations

import numpy as np

from gym_mapbench.kernels.jit import kernel


@kernel
def nearest(points, others, count):
    """Return the numbers of the other points that are nearest to each point, the nearest first.

    Of equally distant points, the first ones count.

    Args:
        points: ``(n, axes)`` coordinates.
        others: ``(m, axes)`` coordinates of the others.
        count: Number of nearest points.

    Returns:
        ``(n, min(count, m))`` int64.
    """
    most = min(count, len(others))
    found = np.empty((len(points), most), dtype=np.int64)
    distances = np.empty(most + 1)
    for row in range(len(points)):
        for number in range(len(others)):
            distance = 0.0
            for axis in range(points.shape[1]):
                distance += abs(others[number, axis] - points[row, axis])
            place = min(number, most)
            while place > 0 and distances[place - 1] > distance:
                distances[place] = distances[place - 1]
                if place < most:
                    found[row, place] = found[row, place - 1]
                place -= 1
            distances[place] = distance
            if place < most:
                found[row, place] = number
    return found
