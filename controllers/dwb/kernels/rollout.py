"""Kernels that roll the candidates out.

All candidates with the same turn rate and number of steps have the same headings: sines and cosines are made
once for such a group, and its members advance side by side. Every sum is made in the order of the source, so
that poses agree to the last bit and fall into the same cells.

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
from gym_mapbench.kernels.jit import kernel


@kernel
def turn(state, target, limits, dt, yaw, cos, sin):
    """Write the headings of one group."""
    omega = state[4]
    yaw[0] = state[2]
    for k in range(len(yaw) - 1):
        if omega != target:
            omega = project_velocity(omega, limits[2], limits[3], dt, target)
        yaw[k + 1] = yaw[k] + omega * dt
    for k in range(len(yaw)):
        cos[k] = math.cos(yaw[k])
        sin[k] = math.sin(yaw[k])


@kernel
def accelerate(v, target, limits, dt):
    """Change the speeds of a group for one step; return whether any is still on its way."""
    acceleration, deceleration = limits[0], limits[1]
    for m in range(len(v)):
        v[m] = project_velocity(v[m], acceleration, deceleration, dt, target[m])
    for m in range(len(v)):
        if v[m] != target[m]:
            return True
    return False


@kernel
def drive(state, target, limits, dt, cos, sin):
    """Last positions of one group.

    The loops over the members stand here, one for each axis, because the compiler makes vector code of them so.
    """
    width = len(target)
    v, x, y = np.full(width, state[3]), np.full(width, state[0]), np.full(width, state[1])
    changing = True
    for k in range(len(cos) - 1):
        if changing:
            changing = accelerate(v, target, limits, dt)
        for m in range(width):
            x[m] += v[m] * cos[k] * dt
        for m in range(width):
            y[m] += v[m] * sin[k] * dt
    return x, y


@kernel
def trace(state, target, limits, dt, cos, sin, x, y):
    """Write all positions of one candidate, by the arithmetic of :func:`drive`; return their number."""
    v = state[3]
    x[0], y[0] = state[0], state[1]
    for k in range(len(cos) - 1):
        v = project_velocity(v, limits[0], limits[1], dt, target)
        x[k + 1] = x[k] + v * cos[k] * dt
        y[k + 1] = y[k] + v * sin[k] * dt
    return len(cos)


@kernel
def roll_out(state, axes, reach, speeds, sim_time, granularity, limits):
    """Sample the candidates and find where they end.

    Args:
        state: See above.
        axes: ``(2, 5)`` of v and omega; see :func:`~controllers.dwb.kernels.sampling.axis_samples`.
        reach: Time within which a sample must be reachable, s.
        speeds: See :func:`~controllers.dwb.kernels.sampling.permitted_twists`.
        sim_time: Duration of the trajectories, s.
        granularity: See :func:`~controllers.dwb.kernels.sampling.count_steps`.
        limits: See above.

    Returns:
        ``(n, 2)`` twists; ``(n,)`` steps; ``(n,)`` index of the first heading of each; ``(n, 2)`` last positions;
        and the headings of all groups, one after another: yaw, cosine, sine.
    """
    twists, index = permitted_twists(
        axis_samples(state[3], axes[0], reach), axis_samples(state[4], axes[1], reach), speeds
    )
    steps = count_steps(twists, sim_time, granularity)
    order, start = group_candidates(index, steps)
    total = 0
    for g in range(len(start) - 1):
        total += steps[order[start[g]]] + 1
    yaw, cos, sin = np.empty(total), np.empty(total), np.empty(total)
    headings, ends = np.empty(len(steps), dtype=np.int64), np.empty_like(twists)
    first = 0
    for g in range(len(start) - 1):
        members = order[start[g] : start[g + 1]]
        count = steps[members[0]]
        dt, span = sim_time / count, slice(first, first + count + 1)
        turn(state, twists[members[0], 1], limits, dt, yaw[span], cos[span], sin[span])
        x, y = drive(state, twists[members, 0], limits, dt, cos[span], sin[span])
        for m in range(len(members)):
            headings[members[m]] = first
            ends[members[m], 0], ends[members[m], 1] = x[m], y[m]
        first += count + 1
    return twists, steps, headings, ends, yaw, cos, sin


@kernel
def trace_candidate(i, state, limits, sim_time, twists, steps, headings, cos, sin, x, y):
    """Write all positions of candidate ``i``; return their number."""
    span = slice(headings[i], headings[i] + steps[i] + 1)
    return trace(state, twists[i, 0], limits, sim_time / steps[i], cos[span], sin[span], x, y)


@kernel
def first_velocities(state, limits, sim_time, twists, steps):
    """Velocity driven in the first step of every candidate, ``(n, 2)``."""
    first = np.empty_like(twists)
    for i in range(len(twists)):
        dt = sim_time / steps[i]
        first[i, 0] = project_velocity(state[3], limits[0], limits[1], dt, twists[i, 0])
        first[i, 1] = project_velocity(state[4], limits[2], limits[3], dt, twists[i, 1])
    return first
