"""Ray casting: the distance from a scanner to the first wall along a beam.

The traversal visits exactly the cells a ray passes (Amanatides and Woo, "A Fast Voxel Traversal
Algorithm for Ray Tracing", 1987), so the distances are those of exact geometry.
"""

from __future__ import annotations

import math

import numpy as np

from gym_mapbench.kernels.jit import kernel


@kernel
def cast_rays(walls, resolution, origin_x, origin_y, x, y, yaw, beams, range_max, ranges):
    """Write the distance to the first wall along every beam.

    Args:
        walls: ``(rows + 2, cols + 2)`` bool, C-contiguous: the map in a frame of walls, which ends every ray.
        resolution: Side of a cell, m.
        origin_x: World x of the lower-left corner of the map inside the frame, m.
        origin_y: World y of the same corner, m.
        x: Sensor, m; off the map is inside a wall.
        y: Sensor, m.
        yaw: Heading of the sensor, rad.
        beams: ``(n, 2)`` cosine and sine of every beam's angle to the heading.
        range_max: Distance where nothing is hit, m.
        ranges: ``(n,)`` out, m; 0 inside a wall.
    """
    cells = walls.ravel()
    stride = walls.shape[1]
    column, line = (x - origin_x) / resolution + 1.0, (y - origin_y) / resolution + 1.0
    if not (0.0 <= column < stride and 0.0 <= line < len(walls)):
        ranges[:] = 0.0
        return
    cos, sin = math.cos(yaw), math.sin(yaw)
    for i in range(len(beams)):
        along_x = beams[i, 0] * cos - beams[i, 1] * sin
        along_y = beams[i, 0] * sin + beams[i, 1] * cos
        cells_max = range_max / resolution
        ranges[i] = min(range_max, resolution * cast_ray(cells, stride, column, line, along_x, along_y, cells_max))


@kernel
def cast_ray(cells, stride, column, line, along_x, along_y, longest):
    """Distance in cells from ``(column, line)`` to the first true cell of a flat grid, more than ``longest`` if none.

    Cells are indexed unsigned, and runs along x have their own loop: half the time of the plain form.
    """
    cell = int(line) * stride + int(column)
    if cells[cell]:
        return 0.0
    to_x, per_x, step_x = crossings(column, along_x)
    to_y, per_y, step_y = crossings(line, along_y)
    step_y *= stride
    flown = 0.0
    while flown <= longest:
        while to_x < to_y:
            flown = to_x
            to_x += per_x
            cell += step_x
            if cells[np.uint64(cell)] or flown > longest:
                return flown
        flown = to_y
        to_y += per_y
        cell += step_y
        if cells[np.uint64(cell)]:
            return flown
    return flown


@kernel
def crossings(position, direction):
    """Distance to the first cell border along one axis, distance between two borders, and the step in cells."""
    if direction > 0.0:
        return (math.floor(position) + 1.0 - position) / direction, 1.0 / direction, 1
    if direction < 0.0:
        return (position - math.floor(position)) / -direction, -1.0 / direction, -1
    return math.inf, math.inf, 0
