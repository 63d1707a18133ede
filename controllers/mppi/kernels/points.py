"""Scores that look at every point of every trajectory: costmap, distance to the goal, heading.

The cell under a point is found in fixed point: float32 displacement times a power of two per cell. Where that
lies within rounding of a cell border it can differ from Nav2's float64 division, so such samples are marked as
doubtful and :mod:`controllers.mppi.kernels.walk` scores them again exactly, point by point.
"""

from __future__ import annotations

import numpy as np

from controllers.mppi.kernels.elementary import ZERO, angle_of
from controllers.mppi.kernels.rollout import COS, SIN, YAW, X, Y, place, start, step
from gym_mapbench.kernels.jit import kernel

OFF_MAP = 255

# Points are gathered four steps at a time.
RING = 4


@kernel
def open_window(costs, row_0, col_0, rows, cols, stride_bits, contribution, window):
    """Translate a part of a costmap into contributions, with a border of points off the map around it.

    Args:
        costs: ``(rows, cols)`` uint8 of the whole costmap.
        row_0, col_0: First cell of the part.
        rows, cols: Size of the part.
        stride_bits: The window's rows are ``2**stride_bits`` apart.
        contribution: ``(256,)`` float32, what a point on a cell of that cost adds to a trajectory's sum.
        window: Flat float32, written.
    """
    off_map = contribution[OFF_MAP]
    for row in range(rows + 2):
        base = row << stride_bits
        if 0 < row <= rows:
            window[base] = off_map
            window[base + cols + 1] = off_map
            for col in range(cols):
                window[base + 1 + col] = contribution[costs[row_0 + row - 1, col_0 + col]]
        else:
            for col in range(cols + 2):
                window[base + col] = off_map


@kernel
def _locate(rows, scale, start_x, start_y, offset_x, offset_y, last_x, last_y, bits, stride_bits, ring, i, b, doubt):
    """Cell of every sample's point into ``ring[i]``; ``doubt`` keeps the smallest distance from a cell border."""
    mask = np.int32((1 << bits) - 1)
    shift, stride = np.uint32(bits), np.uint32(stride_bits)
    for k in range(rows.shape[1]):
        x = np.int32(np.int32(rows[X, k] * scale + start_x) + offset_x)
        y = np.int32(np.int32(rows[Y, k] * scale + start_y) + offset_y)
        near_x, near_y = np.int32(x & mask), np.int32(y & mask)
        near = near_x if near_x < near_y else near_y
        doubt[b, k] = near if near < doubt[b, k] else doubt[b, k]
        ux, uy = np.uint32(x), np.uint32(y)
        ux = ux if ux < last_x else last_x
        uy = uy if uy < last_y else last_y
        ring[i, k] = ((uy >> shift) << stride) + (ux >> shift)


@kernel
def _gather_four(ring, window, b, sums):
    for k in range(ring.shape[1]):
        pair = window[ring[0, k]] + window[ring[1, k]]
        sums[b, k] += pair + (window[ring[2, k]] + window[ring[3, k]])


@kernel
def _gather_one(ring, i, window, b, sums):
    for k in range(ring.shape[1]):
        sums[b, k] += window[ring[i, k]]


@kernel
def _scan(rows, t, steps, grid, scale, ring, window, b, sums, doubt):
    """Find the cells of step ``t``; add up contributions whenever the ring is full or the steps end."""
    bits, stride_bits, offset_x, offset_y, last_x, last_y = grid
    i = t % RING
    _locate(
        rows, np.float32(scale[0]), np.float32(scale[1]), np.float32(scale[2]), np.int32(offset_x),
        np.int32(offset_y), np.uint32(last_x), np.uint32(last_y), bits, stride_bits, ring, i, b, doubt,
    )  # fmt: skip
    if i == RING - 1:
        _gather_four(ring, window, b, sums)
    elif t == steps - 1:
        for j in range(i + 1):
            _gather_one(ring, j, window, b, sums)


@kernel
def _keep(rows, x_0, y_0, b, kept, i):
    place(rows, X, x_0, kept[0, i, b])
    place(rows, Y, y_0, kept[1, i, b])
    if len(kept) > 2:
        for k in range(rows.shape[1]):
            kept[2, i, b, k] = rows[YAW, k]


@kernel
def _add_distance(rows, goal_x, goal_y, b, sums):
    for k in range(rows.shape[1]):
        dx = rows[X, k] - goal_x
        dy = rows[Y, k] - goal_y
        sums[b, k] += np.sqrt(dx * dx + dy * dy)


@kernel
def _add_angle(rows, cos, sin, either_way, b, sums):
    """Add the angle between each sample's heading and one direction; ``either_way``: or its opposite, if nearer."""
    for k in range(rows.shape[1]):
        cross = rows[COS, k] * sin - rows[SIN, k] * cos
        dot = rows[COS, k] * cos + rows[SIN, k] * sin
        forward = -dot if dot < ZERO else dot
        sums[b, k] += angle_of(forward if either_way else dot, -cross if cross < ZERO else cross)


@kernel
def _add_bearing(rows, target_x, target_y, either_way, b, sums):
    """Add the angle between each sample's heading and the bearing of one point from it."""
    for k in range(rows.shape[1]):
        dx = target_x - rows[X, k]
        dy = target_y - rows[Y, k]
        cross = rows[COS, k] * dy - rows[SIN, k] * dx
        dot = rows[COS, k] * dx + rows[SIN, k] * dy
        forward = -dot if dot < ZERO else dot
        sums[b, k] += angle_of(forward if either_way else dot, -cross if cross < ZERO else cross)


@kernel
def sweep(
    noise_v, noise_w, v, w, state, dt, refresh_every, rows, keep, kept,
    scan, grid, scale, ring, window, sums, doubt, wanted, goal, distance, angle,
):  # fmt: skip
    """Roll out all samples once and score them on the way.

    Args:
        noise_v, noise_w: ``(blocks, time_steps, samples)`` noise of the controls, m/s and rad/s.
        v, w: ``(time_steps,)`` control sequence.
        state: ``(x, y, yaw, v, w)`` at the start.
        dt: Period, s.
        refresh_every: Steps between two evaluations of sine and cosine.
        rows: ``(7, samples)`` scratch; see :mod:`controllers.mppi.kernels.rollout`.
        keep: ``(time_steps,)`` row of ``kept`` that takes a step's points, or -1.
        kept: ``(2 or 3, kept steps, blocks, samples)`` world x, y and perhaps yaw, written.
        scan: Whether to sum up the contributions of the cells.
        grid: ``(bits, stride_bits, offset_x, offset_y, last_x, last_y)`` of the fixed-point grid.
        scale: ``(units per m, units of the start x, of the start y)``.
        ring: ``(4, samples)`` uint32 scratch.
        window: From :func:`open_window`.
        sums, doubt: ``(blocks, samples)`` contributions, and units to the nearest cell border, updated.
        wanted: Whether to sum up ``distance`` and ``angle``, and whether an angle may count from behind.
        goal: ``(x, y)`` m from the start, and ``(cos, sin)`` of the heading there.
        distance, angle: ``(blocks, samples)`` sums over the steps, updated.
    """
    blocks, steps = noise_v.shape[:2]
    yaw_0, v_0, w_0 = np.float32(state[2]), np.float32(state[3]), np.float32(state[4])
    period = np.float32(dt)
    for b in range(blocks):
        start(rows, v_0, w_0, yaw_0, period)
        for t in range(steps):
            if t > 0:
                step(rows, noise_v[b], noise_w[b], t - 1, v[t - 1], w[t - 1], yaw_0, period, t % refresh_every == 0)
            if keep[t] >= 0:
                _keep(rows, state[0], state[1], b, kept, keep[t])
            if scan:
                _scan(rows, t, steps, grid, scale, ring, window, b, sums, doubt)
            if wanted[0]:
                _add_distance(rows, np.float32(goal[0]), np.float32(goal[1]), b, distance)
            if wanted[1]:
                _add_angle(rows, np.float32(goal[2]), np.float32(goal[3]), wanted[2], b, angle)


@kernel
def sweep_bearing(noise_v, noise_w, v, w, state, dt, refresh_every, rows, target, either_way, sums):
    """Roll out all samples and sum up the angles between heading and bearing of ``target`` (m from the start)."""
    blocks, steps = noise_v.shape[:2]
    yaw_0, v_0, w_0 = np.float32(state[2]), np.float32(state[3]), np.float32(state[4])
    period = np.float32(dt)
    for b in range(blocks):
        start(rows, v_0, w_0, yaw_0, period)
        for t in range(steps):
            if t > 0:
                step(rows, noise_v[b], noise_w[b], t - 1, v[t - 1], w[t - 1], yaw_0, period, t % refresh_every == 0)
            _add_bearing(rows, np.float32(target[0]), np.float32(target[1]), either_way, b, sums)
