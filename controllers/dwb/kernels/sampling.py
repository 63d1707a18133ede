"""Kernels that choose the candidate twists, and group those with the same turn.

Source: nav2_dwb_controller/dwb_plugins: one_d_velocity_iterator.hpp, xy_theta_iterator.cpp and
standard_traj_generator.cpp.
"""

from __future__ import annotations

import math

import numpy as np

from gym_mapbench.kernels.jit import kernel

EPSILON = 1e-5


@kernel
def project_velocity(start, acceleration, deceleration, dt, target):
    """Velocity ``dt`` seconds after ``start`` on the way to ``target``."""
    faster, slower = start + acceleration * dt, start + deceleration * dt
    rising, falling = faster if faster < target else target, slower if slower > target else target
    return rising if start < target else falling


@kernel
def axis_samples(current, axis, dt):
    """Samples of one velocity axis, ascending; a range across zero also gets an exact 0.

    Args:
        current: Velocity now.
        axis: Lowest and highest velocity, acceleration, deceleration (negative), number of samples.
        dt: Time within which a sample must be reachable, s.
    """
    lowest, highest, acceleration, deceleration, count = axis[0], axis[1], axis[2], axis[3], axis[4]
    current = min(max(current, lowest), highest)
    top = project_velocity(current, acceleration, deceleration, dt, highest)
    bottom = project_velocity(current, acceleration, deceleration, dt, lowest)
    step = (top - bottom) / (max(2.0, count) - 1.0)
    if abs(bottom - top) < EPSILON:
        step = 1.0
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
def permitted_twists(vx, omega, speeds):
    """Permitted pairs, vx outermost, and where to find them.

    Args:
        vx: Samples, m/s.
        omega: Samples, rad/s.
        speeds: ``max_speed_xy``, ``min_speed_xy``, ``min_speed_theta``, of which a negative one does not count, and
            the slack of these limits.

    Returns:
        ``(n, 2)`` twists, and ``(len(vx), len(omega))`` their indices, -1 for a pair that is not permitted.
    """
    slack = speeds[3]
    twists = np.empty((len(vx) * len(omega), 2))
    index = np.empty((len(vx), len(omega)), dtype=np.int64)
    index[:] = -1
    n = 0
    for i in range(len(vx)):
        speed_sq = vx[i] * vx[i]
        if speeds[0] >= 0.0 and speed_sq > speeds[0] * speeds[0] + slack:
            continue
        slow = speeds[1] >= 0.0 and speed_sq + slack < speeds[1] * speeds[1]
        for j in range(len(omega)):
            still = speeds[2] >= 0.0 and abs(omega[j]) + slack < speeds[2]
            if (slow and still) or (speed_sq == 0.0 and omega[j] == 0.0):
                continue
            twists[n, 0], twists[n, 1] = vx[i], omega[j]
            index[i, j] = n
            n += 1
    return twists[:n], index


@kernel
def count_steps(twists, sim_time, granularity):
    """Number of time steps of every candidate, at least 1.

    Args:
        twists: ``(n, 2)`` candidates.
        sim_time: Duration of the trajectories, s.
        granularity: Most that a step may cover: s (infinite for no limit), m, rad.
    """
    steps = np.empty(len(twists), dtype=np.int64)
    for i in range(len(twists)):
        linear = abs(twists[i, 0]) * sim_time / granularity[1]
        angular = abs(twists[i, 1]) * sim_time / granularity[2]
        steps[i] = max(1, math.ceil(max(linear, angular, sim_time / granularity[0])))
    return steps


@kernel
def group_candidates(index, steps):
    """Group the candidates with the same turn: same turn rate, same number of steps, hence the same headings.

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
