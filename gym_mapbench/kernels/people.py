"""The robot among bodies: how far the nearest one is, and the nearest ones as a policy sees them.

``places`` is ``(n, bodies, 3)`` x, y (m), yaw (rad) of every body in ``n`` worlds, or at ``n`` times; ``radii`` is
``(n, bodies)`` m. A radius of 0 is no body. ``states`` is ``(n, 3)`` x, y (m), yaw (rad) of the robot.
"""

from __future__ import annotations

import math

import numpy as np

from gym_mapbench.kernels.bodies import is_near
from gym_mapbench.kernels.clearance import place, polygon_box_distance
from gym_mapbench.kernels.jit import kernel


@kernel
def nearest_gaps(states, places, radii, radius, footprint):
    """Return the distance from the robot's outline to that of the nearest body, ``(n,)`` m; inf without bodies.

    The gap of a disc that overlaps a body is minus the depth of the overlap; a polygon counts as far as its outline.

    Args:
        states: Robot.
        places: Bodies.
        radii: Bodies.
        radius: Radius of a robot that is a disc, m.
        footprint: ``(k, 2)`` corners of a robot that is a polygon, counter-clockwise; empty for a disc.
    """
    gaps = np.empty(len(states))
    for i in range(len(states)):
        gaps[i] = nearest_gap(states[i], places[i], radii[i], radius, footprint)
    return gaps


@kernel
def nearest_gap(state, places, radii, radius, footprint):
    """Return the distance of one robot, m, as :func:`nearest_gaps` for many."""
    if len(footprint) == 0:
        return gap_of_disc(state, places, radii, radius)
    return gap_of_polygon(place(footprint, state), places, radii)


@kernel
def gap_of_disc(state, places, radii, radius):
    """Return the distance from a disc to the nearest of bodies, m; ``hypot`` only where one may be nearer."""
    gap = math.inf
    for k in range(len(radii)):
        dx, dy = places[k, 0] - state[0], places[k, 1] - state[1]
        if radii[k] > 0.0 and is_near(dx, dy, max(gap + radius + radii[k], 0.0)):
            gap = min(gap, math.hypot(dx, dy) - radius - radii[k])
    return gap


@kernel
def gap_of_polygon(corners, places, radii):
    """Return the distance from a polygon to the nearest of bodies, m."""
    gap = math.inf
    for k in range(len(radii)):
        if radii[k] > 0.0:
            x, y = places[k, 0], places[k, 1]
            gap = min(gap, polygon_box_distance(corners, np.array([x, y, x, y])) - radii[k])
    return gap


@kernel
def see_people(state, places, velocities, radii, seen):
    """Write the nearest bodies in the robot's frame, the nearest first.

    Args:
        state: ``(3,)`` the robot.
        places: ``(bodies, 3)`` bodies.
        velocities: ``(bodies, 2)`` of the bodies, m/s.
        radii: ``(bodies,)`` m.
        seen: ``(k, 6)`` float32, out: x, y (m), velocity along x and y (m/s), radius (m), and 1; zeros without body.
    """
    cos, sin = math.cos(state[2]), math.sin(state[2])
    dx, dy = places[:, 0] - state[0], places[:, 1] - state[1]
    order = np.argsort(np.sqrt(dx * dx + dy * dy) - radii)
    for row in range(len(seen)):
        for column in range(6):
            seen[row, column] = 0.0
        if row < len(order):
            k = order[row]
            seen[row, 0], seen[row, 1] = dx[k] * cos + dy[k] * sin, dy[k] * cos - dx[k] * sin
            seen[row, 2] = velocities[k, 0] * cos + velocities[k, 1] * sin
            seen[row, 3] = velocities[k, 1] * cos - velocities[k, 0] * sin
            seen[row, 4], seen[row, 5] = radii[k], 1.0
