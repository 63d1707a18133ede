"""Kernels that roll the candidates out and look under them.

Source: nav2_dwb_controller/dwb_plugins/src/standard_traj_generator.cpp. Every sum is made in the order of the
source, so that poses agree to the last bit and fall into the same cells.
"""

from __future__ import annotations

import math

import numpy as np

from controllers.dwb.kernels.sampling import project_velocity
from gym_mapbench.kernels.geometry import cell_index
from gym_mapbench.kernels.jit import kernel

OFF_MAP = 256


@kernel
def turn(start_yaw, omega, target, limits, dt, yaw, cos, sin):
    """Headings of one group; ``limits``: accelerations and decelerations (negative) of v, then of omega."""
    yaw[0] = start_yaw
    for k in range(len(yaw) - 1):
        omega = project_velocity(omega, limits[2], limits[3], dt, target)
        yaw[k + 1] = yaw[k] + omega * dt
    for k in range(len(yaw)):
        cos[k] = math.cos(yaw[k])
        sin[k] = math.sin(yaw[k])


@kernel
def accelerate(v, target, limits, dt):
    """Change the speeds of a group for one step; return whether any is still on its way."""
    changing = False
    for m in range(len(v)):
        v[m] = project_velocity(v[m], limits[0], limits[1], dt, target[m])
        changing |= v[m] != target[m]
    return changing


@kernel
def move(position, v, direction, dt, row):
    """Move a group along one axis by one step, and keep its positions in ``row``."""
    for m in range(len(v)):
        position[m] += v[m] * direction * dt
        row[m] = position[m]


@kernel
def drive(start_x, start_y, v, target, limits, dt, cos, sin, x, y):
    """Positions of one group, row after row; ``v`` is left at its last value."""
    width = len(v)
    at_x, at_y = np.full(width, start_x), np.full(width, start_y)
    x[:width], y[:width] = start_x, start_y
    changing = True
    for k in range(len(cos) - 1):
        if changing:
            changing = accelerate(v, target, limits, dt)
        row = slice((k + 1) * width, (k + 2) * width)
        move(at_x, v, cos[k], dt, x[row])
        move(at_y, v, sin[k], dt, y[row])


@kernel
def roll_out(state, limits, sim_time, twists, steps, order, start, places, x, y, yaw, cos, sin):
    """Roll every candidate out from the robot's ``state``: x, y, yaw, v, omega.

    ``x``, ``y`` and ``yaw``, ``cos``, ``sin`` are written; see
    :class:`~controllers.dwb.trajectories.Trajectories` for what they and the others hold.
    """
    for g in range(len(start) - 1):
        members = order[start[g] : start[g + 1]]
        leader, width = members[0], len(members)
        count = steps[leader]
        dt = sim_time / count
        first, heading = places[leader, 0], places[leader, 2]
        headings = slice(heading, heading + count + 1)
        positions = slice(first, first + (count + 1) * width)
        turn(state[2], state[4], twists[leader, 1], limits, dt, yaw[headings], cos[headings], sin[headings])
        v, target = np.full(width, state[3]), twists[members, 0]
        drive(state[0], state[1], v, target, limits, dt, cos[headings], sin[headings], x[positions], y[positions])


@kernel
def first_velocities(state, limits, sim_time, twists, steps):
    """Velocity driven in the first step of every candidate, ``(n, 2)``."""
    first = np.empty_like(twists)
    for i in range(len(twists)):
        dt = sim_time / steps[i]
        first[i, 0] = project_velocity(state[3], limits[0], limits[1], dt, twists[i, 0])
        first[i, 1] = project_velocity(state[4], limits[2], limits[3], dt, twists[i, 1])
    return first


@kernel
def find_cells(x, y, origin_x, origin_y, resolution, rows, cols, cells):
    """Write the flat cell index of every position, -1 off the map."""
    for i in range(len(x)):
        cells[i] = cell_index(x[i], y[i], origin_x, origin_y, resolution, rows, cols)


@kernel
def find_worst(steps, places, cells, costs, worst):
    """Write the dearest cell under every trajectory, ``OFF_MAP`` if it leaves the map."""
    flat = costs.ravel()
    for i in range(len(steps)):
        first, width = places[i, 0], places[i, 1]
        dearest = 0
        for k in range(steps[i] + 1):
            cell = cells[first + k * width]
            if cell < 0:
                dearest = OFF_MAP
                break
            dearest = max(dearest, flat[cell])
        worst[i] = dearest


@kernel
def look_under(costs, origin_x, origin_y, resolution, x, y, steps, places, cells, worst):
    """Find the cells of all positions and the dearest of every trajectory."""
    rows, cols = costs.shape
    find_cells(x, y, origin_x, origin_y, resolution, rows, cols, cells)
    find_worst(steps, places, cells, costs, worst)
