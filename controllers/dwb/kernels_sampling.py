"""Kernels that choose the candidate twists and roll them out.

Source: nav2_dwb_controller/dwb_plugins: one_d_velocity_iterator.hpp, xy_theta_iterator.cpp and
standard_traj_generator.cpp. Every sum is made in the order of the source, so that poses agree to
the last bit and fall into the same cells.
"""

from __future__ import annotations

import math

import numpy as np

from gym_mapbench.kernels.geometry import cell_index
from gym_mapbench.kernels.jit import kernel

EPSILON = 1e-5


@kernel
def project_velocity(start, acceleration, deceleration, dt, target):
    """Velocity after ``dt`` on the way from ``start`` to ``target``."""
    if start < target:
        return min(target, start + acceleration * dt)
    return max(target, start + deceleration * dt)


@kernel
def axis_samples(current, lowest, highest, acceleration, deceleration, dt, count):
    """Samples of one velocity axis, ascending; a range across zero also gets an exact 0."""
    current = min(max(current, lowest), highest)
    top = project_velocity(current, acceleration, deceleration, dt, highest)
    bottom = project_velocity(current, acceleration, deceleration, dt, lowest)
    if abs(bottom - top) < EPSILON:
        return np.full(1, bottom)
    step = (top - bottom) / (max(2, count) - 1)
    samples = np.empty(max(0, int((top + EPSILON - bottom) / step)) + 3)
    n = 0
    value = bottom
    while value <= top + EPSILON:
        samples[n] = value
        n += 1
        if value < 0.0 < value + step <= top + EPSILON:
            samples[n] = 0.0
            n += 1
        value += step
    return samples[:n]


@kernel
def candidate_twists(vx, omega, max_speed_xy, min_speed_xy, min_speed_theta):
    """Permitted pairs, vx outermost, and where to find them.

    Returns:
        ``(n, 2)`` twists, and ``(len(vx), len(omega))`` their indices, -1 for a pair that is not permitted.
    """
    twists = np.empty((len(vx) * len(omega), 2))
    index = np.full((len(vx), len(omega)), -1)
    n = 0
    for i in range(len(vx)):
        speed_sq = vx[i] * vx[i]
        if max_speed_xy >= 0.0 and speed_sq > max_speed_xy * max_speed_xy + EPSILON:
            continue
        slow = min_speed_xy >= 0.0 and speed_sq + EPSILON < min_speed_xy * min_speed_xy
        for j in range(len(omega)):
            still = min_speed_theta >= 0.0 and abs(omega[j]) + EPSILON < min_speed_theta
            if (slow and still) or (speed_sq == 0.0 and omega[j] == 0.0):
                continue
            twists[n, 0], twists[n, 1] = vx[i], omega[j]
            index[i, j] = n
            n += 1
    return twists[:n], index


@kernel
def count_steps(twists, sim_time, linear_granularity, angular_granularity):
    """Number of time steps of every candidate, at least 1, when steps are bounded by distance and angle."""
    steps = np.empty(len(twists), dtype=np.int64)
    for i in range(len(twists)):
        linear = abs(twists[i, 0]) * sim_time / linear_granularity
        angular = abs(twists[i, 1]) * sim_time / angular_granularity
        steps[i] = max(1, math.ceil(max(linear, angular)))
    return steps


@kernel
def group_candidates(index, steps):
    """Group the candidates that turn alike: same turn rate, same number of steps, hence the same headings.

    Returns:
        ``order``: candidates, group by group; ``start``: ``(groups + 1,)`` where each group begins in it.
    """
    order = np.empty(len(steps), dtype=np.int64)
    start = np.empty(len(steps) + 1, dtype=np.int64)
    n = groups = 0
    for j in range(index.shape[1]):
        previous = -1
        for i in range(index.shape[0]):
            candidate = index[i, j]
            if candidate < 0:
                continue
            if steps[candidate] != previous:
                start[groups] = n
                groups += 1
                previous = steps[candidate]
            order[n] = candidate
            n += 1
    start[groups] = n
    return order, start[: groups + 1]


@kernel
def lay_out(order, start, steps):
    """Place the poses of all candidates in flat arrays.

    Within a group pose ``k`` of all members lies side by side, so that one loop advances them together.

    Returns:
        ``(n, 3)`` per candidate: index of its first pose, distance to its next pose, index of its first
        heading; then the numbers of poses and of headings.
    """
    places = np.empty((len(steps), 3), dtype=np.int64)
    poses = headings = 0
    for g in range(len(start) - 1):
        width = start[g + 1] - start[g]
        for m in range(width):
            candidate = order[start[g] + m]
            places[candidate, 0] = poses + m
            places[candidate, 1] = width
            places[candidate, 2] = headings
        rows = steps[order[start[g]]] + 1
        poses += rows * width
        headings += rows
    return places, poses, headings


@kernel
def _roll_headings(yaw0, omega, target, acceleration, deceleration, dt, yaw, cos, sin):
    """Headings of one group, and the first turn rate it drives."""
    yaw[0] = yaw0
    first = project_velocity(omega, acceleration, deceleration, dt, target)
    for k in range(len(yaw) - 1):
        omega = project_velocity(omega, acceleration, deceleration, dt, target)
        yaw[k + 1] = yaw[k] + omega * dt
    for k in range(len(yaw)):
        cos[k] = math.cos(yaw[k])
        sin[k] = math.sin(yaw[k])
    return first


@kernel
def _advance(x, y, x_next, y_next, v, cos, sin, dt):
    """Move all members of a group by one step."""
    for m in range(len(v)):
        x_next[m] = x[m] + v[m] * cos * dt
        y_next[m] = y[m] + v[m] * sin * dt


@kernel
def _accelerate(v, target, acceleration, deceleration, dt):
    """Change the speeds of all members of a group for one step."""
    for m in range(len(v)):
        v[m] = project_velocity(v[m], acceleration, deceleration, dt, target[m])


@kernel
def roll_out(twists, steps, order, start, places, state, limits, sim_time, x, y, yaw, cos, sin, first):
    """Roll every candidate out from the robot's state.

    Args:
        twists: ``(n, 2)`` candidates; ``steps``, ``order``, ``start``, ``places`` as made above.
        state: x, y, yaw, v, omega of the robot.
        limits: Accelerations and decelerations (negative) of v, then of omega.
        sim_time: Duration of every trajectory, s.
        x: Written, as ``y``: flat positions.
        yaw: Written, as ``cos`` and ``sin``: flat headings.
        first: Written: ``(n, 2)`` velocity driven in the first step.
    """
    for g in range(len(start) - 1):
        members = order[start[g] : start[g + 1]]
        place, width, heading = places[members[0]]
        count = steps[members[0]]
        dt = sim_time / count
        headings = slice(heading, heading + count + 1)
        target = twists[members, 0]
        omega = _roll_headings(
            state[2],
            state[4],
            twists[members[0], 1],
            limits[2],
            limits[3],
            dt,
            yaw[headings],
            cos[headings],
            sin[headings],
        )
        v = np.full(width, state[3])
        x[place : place + width] = state[0]
        y[place : place + width] = state[1]
        for k in range(count):
            _accelerate(v, target, limits[0], limits[1], dt)
            if k == 0:
                first[members, 0] = v
                first[members, 1] = omega
            here, there = slice(place, place + width), slice(place + width, place + 2 * width)
            _advance(x[here], y[here], x[there], y[there], v, cos[heading + k], sin[heading + k], dt)
            place += width


@kernel
def find_cells(x, y, origin_x, origin_y, resolution, rows, cols, cells):
    """Write the flat cell index of every position, -1 off the map."""
    for i in range(len(x)):
        cells[i] = cell_index(x[i], y[i], origin_x, origin_y, resolution, rows, cols)
