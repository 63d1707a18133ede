"""Where a point lies on a grid, and angles wrapped to one turn."""

from __future__ import annotations

import math

import numpy as np

from gym_mapbench.kernels.jit import kernel

TWO_PI = 2.0 * math.pi


@kernel
def cell_index(x, y, origin_x, origin_y, resolution, rows, cols):
    """Flat index ``row * cols + col`` of the cell that holds a point, -1 off the map (``worldToMap``)."""
    if x < origin_x or y < origin_y:
        return -1
    col = int((x - origin_x) / resolution)
    row = int((y - origin_y) / resolution)
    if col >= cols or row >= rows:
        return -1
    return row * cols + col


@kernel
def normalize_angle(angle):
    """Wrap an angle to (-pi, pi], as ``angles::normalize_angle``."""
    wrapped = np.fmod(angle + math.pi, TWO_PI)
    if wrapped <= 0.0:
        return wrapped + math.pi
    return wrapped - math.pi


@kernel
def wrap_angle(angle):
    """Wrap an angle to (-pi, pi]; one that lies there is returned unchanged, so that saved poses keep their digest."""
    if -math.pi < angle <= math.pi:
        return float(angle)
    return float(-((-angle + math.pi) % TWO_PI - math.pi))
