"""One pass over all points of all trajectories: controls, costmap, distance to the goal, heading.

The cell under a point is found in fixed point: float32 displacement times a power of two per cell. Where that
lies within rounding of a cell border it can differ from Nav2's float64 division of the rounded world coordinate,
and the few points of which this is true are looked up again in that way. Nearer still, the last bit of the fast
rollout decides, and the sample is rolled out once more with sine and cosine evaluated at every step.
"""

from __future__ import annotations

import numpy as np

from controllers.mppi.kernels.controls import ANGLE, BEARINGS, CELLS, DISTANCE, add_controls, start_at, start_controls
from controllers.mppi.kernels.elementary import ZERO, angle_of
from controllers.mppi.kernels.rollout import COS, SIN, STATE_ROWS, TURNED, X, Y, retrace, start, step
from gym_mapbench.kernels.geometry import cell_index
from gym_mapbench.kernels.jit import inlined, kernel

# Points are gathered four steps at a time.
RING = 4
# A point is near a cell border if its fixed-point fraction, moved by 2 units, is below this.
NEAR = 5
# Within this distance of one (m), the last bits of the rollout can decide.
LAST_BITS = 1e-6


@inlined
def _locate(rows, grid, scale, ring, i, border):
    """Cell of every sample's point into ``ring[i]``, and whether it lies near a border into ``border``.

    Returns:
        Whether any point does.
    """
    bits, stride_bits = np.uint32(grid[0]), np.uint32(grid[1])
    offset_x, offset_y, last_x, last_y = np.int32(grid[2]), np.int32(grid[3]), np.uint32(grid[4]), np.uint32(grid[5])
    units, start_x, start_y = np.float32(scale[0]), np.float32(scale[1]), np.float32(scale[2])
    mask, near, any_near = np.int32((1 << grid[0]) - 1), np.int32(NEAR), np.int32(0)
    for k in range(rows.shape[1]):
        x = np.int32(np.int32(rows[X, k] * units + start_x) + offset_x)
        y = np.int32(np.int32(rows[Y, k] * units + start_y) + offset_y)
        fraction_x, fraction_y = np.int32(x & mask), np.int32(y & mask)
        nearer = fraction_x if fraction_x < fraction_y else fraction_y
        is_near = np.int32(1 if nearer < near else 0)
        border[k] = is_near
        any_near = np.int32(any_near | is_near)
        ux, uy = np.uint32(x), np.uint32(y)
        ux = ux if ux < last_x else last_x
        uy = uy if uy < last_y else last_y
        ring[i, k] = np.uint32((uy >> bits) << stride_bits) + (ux >> bits)
    return any_near != 0


@kernel
def _off_border(offset, resolution):
    """Distance of a coordinate, m from the map's origin, from the nearest cell border, m."""
    cells = offset / resolution
    return abs(cells - np.rint(cells)) * resolution


@inlined
def _locate_exactly(rows, noise_v, noise_w, t, v, w, dt, call, grid, shape, ring, border):
    """Look up the points near a border as Nav2 does, in the whole costmap of ``shape``."""
    yaw_0, v_0, w_0 = np.float32(call.yaw), np.float32(call.v), np.float32(call.w)
    resolution, origin_x, origin_y = call.resolution, call.origin_x, call.origin_y
    for k in range(rows.shape[1]):
        if border[k] == 0:
            continue
        x, y = np.float32(call.x + rows[X, k]), np.float32(call.y + rows[Y, k])
        if min(_off_border(x - origin_x, resolution), _off_border(y - origin_y, resolution)) < LAST_BITS:
            dx, dy = retrace(noise_v, noise_w, k, t, v, w, v_0, w_0, yaw_0, dt)
            x, y = np.float32(call.x + dx), np.float32(call.y + dy)
        cell = cell_index(np.float64(x), np.float64(y), origin_x, origin_y, resolution, shape[0], shape[1])
        row, col = cell // shape[1] - grid[6] + 1, cell % shape[1] - grid[7] + 1
        ring[t % RING, k] = 0 if cell < 0 else np.uint32((row << grid[1]) + col)


@inlined
def _gather(t, steps, ring, window, b, collected):
    """Add up contributions whenever the ring is full or the steps end."""
    if t % RING == RING - 1:
        for k in range(ring.shape[1]):
            pair = window[ring[0, k]] + window[ring[1, k]]
            collected[CELLS, b, k] += pair + (window[ring[2, k]] + window[ring[3, k]])
    elif t == steps - 1:
        for i in range(t % RING + 1):
            for k in range(ring.shape[1]):
                collected[CELLS, b, k] += window[ring[i, k]]


@inlined
def _keep(rows, call, b, kept, i):
    for k in range(rows.shape[1]):
        kept[0, i, b, k] = np.float32(call.x + rows[X, k])
        kept[1, i, b, k] = np.float32(call.y + rows[Y, k])
    if len(kept) > 2:
        for k in range(rows.shape[1]):
            kept[2, i, b, k] = rows[TURNED, k] + np.float32(call.yaw)


@inlined
def _add_distance(rows, goal_x, goal_y, b, collected):
    for k in range(rows.shape[1]):
        dx = rows[X, k] - goal_x
        dy = rows[Y, k] - goal_y
        collected[DISTANCE, b, k] += np.sqrt(dx * dx + dy * dy)


@inlined
def _add_heading(rows, cos, sin, either_way, b, collected):
    """Add the angle between each sample's heading and one direction; ``either_way``: or its opposite, if nearer."""
    for k in range(rows.shape[1]):
        cross = rows[COS, k] * sin - rows[SIN, k] * cos
        dot = rows[COS, k] * cos + rows[SIN, k] * sin
        forward = -dot if dot < ZERO else dot
        collected[ANGLE, b, k] += angle_of(forward if either_way else dot, -cross if cross < ZERO else cross)


@inlined
def _add_bearing(rows, target_x, target_y, either_way, b, collected):
    """Add the angle between each sample's heading and the bearing of one point from it."""
    for k in range(rows.shape[1]):
        dx = target_x - rows[X, k]
        dy = target_y - rows[Y, k]
        cross = rows[COS, k] * dy - rows[SIN, k] * dx
        dot = rows[COS, k] * dx + rows[SIN, k] * dy
        forward = -dot if dot < ZERO else dot
        collected[BEARINGS, b, k] += angle_of(forward if either_way else dot, -cross if cross < ZERO else cross)


@kernel
def sweep(
    call_of, dt, rollout, speeds, keep, kept, scan, grid, scale, shape, window, measure, look, either_way, collected
):
    """Roll out all samples once and score them on the way.

    Args:
        call_of: ``(1,)`` record of the call.
        dt: Period, s.
        rollout: ``(refresh_every, noise_v, noise_w, v, w)``: steps between two evaluations of sine and cosine;
            ``(blocks, time_steps, samples)`` noise, m/s and rad/s; ``(time_steps,)`` control sequence, the same.
        speeds: See :func:`~controllers.mppi.kernels.controls.add_controls`.
        keep: ``(time_steps,)`` row of ``kept`` that takes a step's points, or -1.
        kept: ``(2 or 3, kept steps, blocks, samples)`` world x, y and perhaps yaw, written.
        scan: Whether to sum up the contributions of the cells.
        grid: ``(bits, stride_bits, offset_x, offset_y, last_x, last_y, first_row, first_col)`` of the fixed-point grid.
        scale: ``(units per m, units of the start x, of the start y)``.
        shape: ``(rows, cols)`` of the costmap.
        window: Contributions of the cells; see :mod:`controllers.mppi.kernels.window`.
        measure: Whether to sum up distances from the end of the local path.
        look: Whether to sum up angles from the heading there.
        either_way: Whether an angle may count from behind.
        collected: ``(12, blocks, samples)`` sums over the steps, written.
    """
    call, (refresh_every, noise_v, noise_w, v, w) = call_of[0], rollout
    blocks, steps, samples = noise_v.shape
    rows = np.empty((STATE_ROWS, samples), dtype=np.float32)
    ring, border = np.empty((RING, samples), dtype=np.uint32), np.empty(samples, dtype=np.int32)
    yaw_0, v_0, w_0, period = np.float32(call.yaw), np.float32(call.v), np.float32(call.w), np.float32(dt)
    goal_x, goal_y = np.float32(call.end_x - call.x), np.float32(call.end_y - call.y)
    cos, sin = np.float32(np.cos(call.end_yaw)), np.float32(np.sin(call.end_yaw))
    for b in range(blocks):
        block_v, block_w = noise_v[b], noise_w[b]
        start(rows, v_0, w_0, yaw_0, period)
        start_controls(v_0, speeds, b, collected)
        for row in (CELLS, DISTANCE, ANGLE):
            start_at(ZERO, b, collected, row)
        for t in range(steps):
            if t > 0:
                step(rows, block_v, block_w, t - 1, v[t - 1], w[t - 1], yaw_0, period, t % refresh_every == 0)
            if keep[t] >= 0:
                _keep(rows, call, b, kept, keep[t])
            add_controls(block_v, block_w, t, v, w, speeds, b, collected)
            if scan:
                if _locate(rows, grid, scale, ring, t % RING, border):
                    _locate_exactly(rows, block_v, block_w, t, v, w, period, call, grid, shape, ring, border)
                _gather(t, steps, ring, window, b, collected)
            if measure:
                _add_distance(rows, goal_x, goal_y, b, collected)
            if look:
                _add_heading(rows, cos, sin, either_way, b, collected)


@kernel
def sweep_bearings(tuning_of, call_of, rollout, collected):
    """Roll out all samples and sum up the angles between heading and bearing of the call's target (PathAngle)."""
    tuning, call, (refresh_every, noise_v, noise_w, v, w) = tuning_of[0], call_of[0], rollout
    blocks, steps, samples = noise_v.shape
    rows, period = np.empty((STATE_ROWS, samples), dtype=np.float32), np.float32(tuning.model_dt)
    yaw_0, v_0, w_0 = np.float32(call.yaw), np.float32(call.v), np.float32(call.w)
    target_x, target_y = np.float32(call.target_x), np.float32(call.target_y)
    for b in range(blocks):
        start(rows, v_0, w_0, yaw_0, period)
        start_at(ZERO, b, collected, BEARINGS)
        for t in range(steps):
            if t > 0:
                step(rows, noise_v[b], noise_w[b], t - 1, v[t - 1], w[t - 1], yaw_0, period, t % refresh_every == 0)
            _add_bearing(rows, target_x, target_y, tuning.either_way, b, collected)
