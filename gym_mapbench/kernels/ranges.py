"""What a scanner reports of exact distances: noise, and beams without a reading."""

from __future__ import annotations

import numpy as np

from gym_mapbench.kernels.jit import kernel


@kernel
def report_ranges(ranges, normals, lost, deviation, relative, range_min, range_max, no_range):
    """Write what is reported in place of exact ranges, in single precision.

    Args:
        ranges: ``(n,)`` float32 m, in and out; ``range_max`` where nothing was hit, which stays as it is.
        normals: ``(n,)`` float32 standard normal numbers; empty for no noise.
        lost: ``(n,)`` whether a beam is lost; empty where none is.
        deviation: Standard deviation of the noise, m.
        relative: The same as a share of the range; the squares of both add up.
        range_min: Shortest range that is reported, m.
        range_max: Longest range, m; noise does not lead beyond it.
        no_range: What is reported for a beam that is lost or too short, m.
    """
    deviation, relative, no_range = np.float32(deviation), np.float32(relative), np.float32(no_range)
    range_min, range_max = np.float32(range_min), np.float32(range_max)
    for i in range(len(ranges)):
        if len(normals) > 0 and ranges[i] < range_max:
            spread = deviation if relative == 0.0 else np.hypot(deviation, relative * ranges[i])
            ranges[i] = min(max(ranges[i] + spread * normals[i], np.float32(0.0)), range_max)
        if ranges[i] < range_min or (len(lost) > 0 and lost[i]):
            ranges[i] = no_range
