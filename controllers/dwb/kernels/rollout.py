"""Kernels that roll the candidates out.

All candidates with the same turn rate and number of steps have the same headings: sines and cosines are computed once
for such a group, and its members advance side by side. Every sum is computed in the order of the source, so that poses
agree to the last bit and fall into the same cells.

``state`` is x, y, yaw, v, omega of the robot; ``limits`` are accelerations and decelerations (negative) of v,
then of omega.

Source: nav2_dwb_controller/dwb_plugins/src/standard_traj_generator.cpp.
"""

from __future__ import annotations

import math

import numpy as np

from controllers.dwb.kernels.sampling import (
    axis_samples,
    count_steps,
    group_candidates,
    permitted_twists,
    project_velocity,
)
from gym_mapbench.kernels.geometry import cell_index
from gym_mapbench.kernels.jit import inlined, kernel


@kernel
def turn(state, target, limits, dt, yaw):
    """Write the headings of one group."""
    heading, omega = state[2], state[4]
    yaw[0] = heading
    for k in range(1, len(yaw)):
        if omega != target:
            omega = project_velocity(omega, limits[2], limits[3], dt, target)
        heading += omega * dt
        yaw[k] = heading


@inlined
def accelerate(v, target, limits, dt):
    """Change the speeds of a group for one step; return whether any is still on its way."""
    acceleration, deceleration = limits[0], limits[1]
    for m in range(len(v)):
        v[m] = project_velocity(v[m], acceleration, deceleration, dt, target[m])
    changing = False
    for m in range(len(v)):
        changing |= v[m] != target[m]
    return changing


@inlined
def move(v, dt, along, x):
    """Move a group by one step on one axis; the compiler vectorises the loop over the members in this form."""
    for m in range(len(v)):
        x[m] += v[m] * along * dt


@inlined
def move_four_times(v, dt, first, second, third, fourth, x):
    """Move a group by four steps on one axis: to load and store positions takes most of the time of a step."""
    for m in range(len(v)):
        x[m] = x[m] + v[m] * first * dt + v[m] * second * dt + v[m] * third * dt + v[m] * fourth * dt


@kernel
def drive(v, target, limits, dt, cos, sin, x, y):
    """Move one group to its last positions."""
    k, changing = 0, True
    while changing and k < len(cos):
        changing = accelerate(v, target, limits, dt)
        move(v, dt, cos[k], x)
        move(v, dt, sin[k], y)
        k += 1
    while k + 4 <= len(cos):
        move_four_times(v, dt, cos[k], cos[k + 1], cos[k + 2], cos[k + 3], x)
        move_four_times(v, dt, sin[k], sin[k + 1], sin[k + 2], sin[k + 3], y)
        k += 4
    for rest in range(k, len(cos)):
        move(v, dt, cos[rest], x)
        move(v, dt, sin[rest], y)


@kernel
def advance(v, x, y, target, limits, dt, cos, sin):
    """Speed and position of one candidate after one step; the arithmetic is that of :func:`drive`."""
    v = project_velocity(v, limits[0], limits[1], dt, target)
    return v, x + v * cos * dt, y + v * sin * dt


@kernel
def turn_all(state, sim_time, limits, twists, steps, order, start):
    """Where the headings of every candidate begin, and the headings of all groups, one after another."""
    total = 0
    for g in range(len(start) - 1):
        total += steps[order[start[g]]] + 1
    headings, yaw = np.empty(len(steps), dtype=np.int64), np.empty(total)
    first = 0
    for g in range(len(start) - 1):
        leader = order[start[g]]
        last = first + steps[leader]
        turn(state, twists[leader, 1], limits, sim_time / steps[leader], yaw[first : last + 1])
        for m in range(start[g], start[g + 1]):
            headings[order[m]] = first
        first = last + 1
    return headings, yaw


@kernel
def drive_all(state, sim_time, limits, twists, steps, order, start, headings, cos, sin):
    """Last positions of all candidates, ``(n, 2)``."""
    n = len(order)
    v, x, y, target = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    for m in range(n):
        v[m], x[m], y[m], target[m] = state[3], state[0], state[1], twists[order[m], 0]
    for g in range(len(start) - 1):
        leader, group = order[start[g]], slice(start[g], start[g + 1])
        way = slice(headings[leader], headings[leader] + steps[leader])
        drive(v[group], target[group], limits, sim_time / steps[leader], cos[way], sin[way], x[group], y[group])
    ends = np.empty((n, 2))
    for m in range(n):
        ends[order[m], 0], ends[order[m], 1] = x[m], y[m]
    return ends


@kernel
def last_cells(steps, headings, ends, cos, sin, forwards, origin_x, origin_y, resolution, shape):
    """Flat indices of the cells at distances ``forwards`` ahead of every last pose, ``(distances, n)``, -1 off the map.

    Also returns the box around these points: lowest and highest x, lowest and highest y.
    """
    cells = np.empty((len(forwards), len(steps)), dtype=np.int64)
    left, right, bottom, top = np.inf, -np.inf, np.inf, -np.inf
    for d in range(len(forwards)):
        for i in range(len(steps)):
            last = headings[i] + steps[i]
            x, y = ends[i, 0] + forwards[d] * cos[last], ends[i, 1] + forwards[d] * sin[last]
            left, right, bottom, top = min(left, x), max(right, x), min(bottom, y), max(top, y)
            cells[d, i] = cell_index(x, y, origin_x, origin_y, resolution, shape[0], shape[1])
    return cells, (left, right, bottom, top)


@kernel
def roll_out(
    state, axes, reach, speeds, sim_time, granularity, limits, forwards, origin_x, origin_y, resolution, shape
):
    """Sample the candidates and find where they end.

    Args:
        state: See the top of this module.
        axes: ``(2, 5)`` of v and omega; see :func:`~controllers.dwb.kernels.sampling.axis_samples`.
        reach: Time within which a sample must be reachable, s.
        speeds: See :func:`~controllers.dwb.kernels.sampling.permitted_twists`.
        sim_time: Duration of the trajectories, s.
        granularity: See :func:`~controllers.dwb.kernels.sampling.count_steps`.
        limits: See the top of this module.
        forwards: Distances ahead of the last poses at which points are looked up, m.
        origin_x: Lower-left corner of the costmap, m.
        origin_y: Lower-left corner of the costmap, m.
        resolution: Side of the costmap's cells, m.
        shape: Rows and columns of the costmap.

    Returns:
        ``(n, 2)`` twists; ``(n,)`` steps; ``(n,)`` index of the first heading of each; ``(n, 2)`` last positions;
        the headings of all groups, one after another: yaw, cosine, sine; and what :func:`last_cells` returns.
    """
    twists, index = permitted_twists(
        axis_samples(state[3], axes[0], reach), axis_samples(state[4], axes[1], reach), speeds
    )
    steps = count_steps(twists, sim_time, granularity)
    order, start = group_candidates(index, steps)
    headings, yaw = turn_all(state, sim_time, limits, twists, steps, order, start)
    cos, sin = np.empty_like(yaw), np.empty_like(yaw)
    for k in range(len(yaw)):
        cos[k], sin[k] = math.cos(yaw[k]), math.sin(yaw[k])
    ends = drive_all(state, sim_time, limits, twists, steps, order, start, headings, cos, sin)
    cells, box = last_cells(steps, headings, ends, cos, sin, forwards, origin_x, origin_y, resolution, shape)
    return twists, steps, headings, ends, yaw, cos, sin, cells, box


@kernel
def trace(state, target, limits, dt, cos, sin, poses):
    """Write all positions of one candidate into ``(steps + 1, 3)`` poses."""
    v, x, y = state[3], state[0], state[1]
    for k in range(len(poses)):
        poses[k, 0], poses[k, 1] = x, y
        v, x, y = advance(v, x, y, target, limits, dt, cos[k], sin[k])


@kernel
def first_velocities(state, limits, sim_time, twists, steps):
    """Velocity driven in the first step of every candidate, ``(n, 2)``."""
    first = np.empty_like(twists)
    for i in range(len(twists)):
        dt = sim_time / steps[i]
        first[i, 0] = project_velocity(state[3], limits[0], limits[1], dt, twists[i, 0])
        first[i, 1] = project_velocity(state[4], limits[2], limits[3], dt, twists[i, 1])
    return first
