"""Shapes drawn on a picture, anti-aliased: a pixel is covered by as much as it lies inside the outline.

``pixels`` is ``(height, width, 3)`` float32, changed in place; positions are columns and lines, pixel
centres at whole numbers plus a half; ``colour`` is ``(3,)``.
"""

from __future__ import annotations

import math

import numpy as np

from gym_mapbench.kernels.jit import kernel


@kernel
def blend(pixels, line, column, inside, colour, alpha):
    """Mix a colour into one pixel that lies ``inside`` pixels within a shape (negative: outside)."""
    share = min(max(inside + 0.5, 0.0), 1.0) * alpha
    if share > 0.0:
        for channel in range(3):
            pixels[line, column, channel] += share * (colour[channel] - pixels[line, column, channel])


@kernel
def reach(low, high, size):
    """Range of whole pixels around an interval, cut off at the picture."""
    return max(0, math.floor(low) - 1), min(size, math.ceil(high) + 1)


@kernel
def paint_ring(pixels, column, line, inner, outer, colour, alpha):
    """Fill the area between two circles; ``inner`` below 0 fills the whole disc."""
    top, bottom = reach(line - outer, line + outer, pixels.shape[0])
    left, right = reach(column - outer, column + outer, pixels.shape[1])
    for row in range(top, bottom):
        for col in range(left, right):
            distance = math.hypot(col + 0.5 - column, row + 0.5 - line)
            blend(pixels, row, col, min(outer - distance, distance - inner), colour, alpha)


@kernel
def paint_line(pixels, points, width, colour):
    """Draw a line through ``(n, 2)`` column and line of points."""
    for i in range(len(points) - 1):
        paint_segment(pixels, points[i], points[i + 1], width / 2.0, colour)


@kernel
def paint_segment(pixels, first, second, half, colour):
    """Draw one segment with round ends, ``half`` pixels to either side."""
    top, bottom = reach(min(first[1], second[1]) - half, max(first[1], second[1]) + half, pixels.shape[0])
    left, right = reach(min(first[0], second[0]) - half, max(first[0], second[0]) + half, pixels.shape[1])
    along_x, along_y = second[0] - first[0], second[1] - first[1]
    squared = max(along_x * along_x + along_y * along_y, 1e-12)
    for row in range(top, bottom):
        for col in range(left, right):
            dx, dy = col + 0.5 - first[0], row + 0.5 - first[1]
            share = min(max((dx * along_x + dy * along_y) / squared, 0.0), 1.0)
            distance = math.hypot(dx - share * along_x, dy - share * along_y)
            blend(pixels, row, col, half - distance, colour, 1.0)


@kernel
def paint_convex(pixels, corners, colour):
    """Fill a convex polygon, ``(n, 2)`` column and line, that is clockwise on the picture's y-down axes."""
    top, bottom = reach(corners[:, 1].min(), corners[:, 1].max(), pixels.shape[0])
    left, right = reach(corners[:, 0].min(), corners[:, 0].max(), pixels.shape[1])
    n = len(corners)
    for row in range(top, bottom):
        for col in range(left, right):
            inside = math.inf
            for i in range(n):
                edge_x = corners[(i + 1) % n, 0] - corners[i, 0]
                edge_y = corners[(i + 1) % n, 1] - corners[i, 1]
                dx, dy = col + 0.5 - corners[i, 0], row + 0.5 - corners[i, 1]
                inside = min(inside, (dx * edge_y - dy * edge_x) / math.hypot(edge_x, edge_y))
            blend(pixels, row, col, inside, colour, 1.0)


@kernel
def paint_fan(pixels, column, line, angles, ranges, colour, alpha):
    """Fill what beams pass over: ``angles`` rise over one full turn, closed; ``ranges`` in pixels."""
    longest = ranges.max()
    top, bottom = reach(line - longest, line + longest, pixels.shape[0])
    left, right = reach(column - longest, column + longest, pixels.shape[1])
    for row in range(top, bottom):
        for col in range(left, right):
            dx, dy = col + 0.5 - column, line - row - 0.5
            distance = math.hypot(dx, dy)
            if distance > longest + 1.0:
                continue
            angle = angles[0] + (math.atan2(dy, dx) - angles[0]) % (2.0 * math.pi)
            after = min(max(np.searchsorted(angles, angle), 1), len(angles) - 1)
            gap = max(angles[after] - angles[after - 1], 1e-12)
            share = (angle - angles[after - 1]) / gap
            range_here = ranges[after - 1] + share * (ranges[after] - ranges[after - 1])
            blend(pixels, row, col, range_here - distance, colour, alpha)
