"""One pass over all points of all trajectories: controls, costmap, distance to the goal, heading.

The cell under a point is found in fixed point: float32 displacement times 2^16 per cell. Within rounding errors of a
cell border this can differ from Nav2, which divides the rounded world coordinate; the few points that are so near are
looked up again in Nav2's way. Still nearer to a border, the last bit of the fast rollout decides; such a sample is
rolled out once more with sine and cosine evaluated at every step.
"""

from __future__ import annotations

import numpy as np

from controllers.mppi.kernels.controls import (
    ANGLE,
    BEARINGS,
    CELLS,
    DISTANCE,
    EFFORT,
    EXCESS,
    REVERSE,
    above_or_below,
    backwards,
    start_at,
)
from controllers.mppi.kernels.elementary import ZERO, angle_of
from controllers.mppi.kernels.rollout import (
    BLOCK,
    COS,
    SIN,
    STATE_SIZE,
    TURNED,
    X,
    Y,
    advance,
    refresh,
    retrace,
    start,
)
from controllers.mppi.kernels.window import FRACTION, FRACTION_BITS
from gym_mapbench.kernels.geometry import cell_index
from gym_mapbench.kernels.jit import inlined, kernel

# Rows after a block's state: sums of the scores of its controls.
EXCESSES, REVERSES, EFFORTS = (STATE_SIZE + BLOCK * row for row in range(3))
ROWS_SIZE = STATE_SIZE + 3 * BLOCK
# Points are gathered four steps at a time.
RING = 4
# Points near a cell border are few; so many samples at once are searched for them.
PART = 32
# Within this distance of a cell border (m), the last bits of the rollout can decide.
LAST_BITS = 1e-6


@inlined
def _fixed_point(x, units, start_x):
    """Cell coordinate in fixed point."""
    return np.int32(x * units + start_x)


@inlined
def _border_distance(x, y):
    """Smaller fraction of two coordinates in fixed point."""
    fraction_x, fraction_y = np.int32(x & FRACTION), np.int32(y & FRACTION)
    return fraction_x if fraction_x < fraction_y else fraction_y


@inlined
def _cell_of(x, y, last_x, last_y, stride):
    """Index of the window's cell at two coordinates in fixed point; one on the border for a point off the map."""
    ux, uy = np.uint32(x), np.uint32(y)
    ux = ux if ux < last_x else last_x
    uy = uy if uy < last_y else last_y
    return np.uint32(np.uint32(np.uint32(uy >> FRACTION_BITS) * stride) + np.uint32(ux >> FRACTION_BITS))


@inlined
def _advance_sample(rows, k, noise_v, noise_w, controls, base_yaw, dt, limits):
    """Advance one sample by a period and add what its controls cost; return its new place."""
    (v, w), (highest, lowest, effort_v, effort_w) = controls, limits
    speed, turn = v + noise_v[k], w + noise_w[k]
    rows[EXCESSES + k] += above_or_below(speed, highest, lowest)
    rows[REVERSES + k] += backwards(speed)
    rows[EFFORTS + k] += effort_v * noise_v[k] + effort_w * noise_w[k]
    x, y, turned, cos, sin = advance(
        rows[X + k], rows[Y + k], rows[TURNED + k], rows[COS + k], rows[SIN + k], speed, turn, base_yaw, dt
    )
    rows[X + k], rows[Y + k], rows[TURNED + k], rows[COS + k], rows[SIN + k] = x, y, turned, cos, sin
    return x, y


@kernel
def step_and_score(rows, noise_v, noise_w, controls, base_yaw, dt, limits):
    """Advance a block by one period and add what its controls cost; see :func:`step_and_locate`."""
    for k in range(BLOCK):
        _advance_sample(rows, k, noise_v, noise_w, controls, base_yaw, dt, limits)


@kernel
def step_and_locate(rows, noise_v, noise_w, controls, base_yaw, dt, limits, scale, last, near, cells):
    """Advance a block by one period, add what its controls cost, and write the cell under every point.

    One loop, so that no state goes to memory more than once a step.

    Args:
        rows: ``(ROWS_SIZE,)`` the block.
        noise_v: ``(BLOCK,)`` noise of this period, m/s.
        noise_w: The same, rad/s.
        controls: ``(v, w)`` of the control sequence.
        base_yaw: Heading that is added to the sum of the turns, rad.
        dt: Period, s.
        limits: Highest and lowest speed that costs nothing, m/s; factors of the two noises in the effort.
        scale: ``(units per m, units of the start x, of the start y)``.
        last: ``(last_x, last_y, stride)`` of the window.
        near: Fraction below which a point is near a cell border.
        cells: ``(BLOCK,)`` written.

    Returns:
        Whether any point is near a border.
    """
    (units, start_x, start_y), (last_x, last_y, stride) = scale, last
    below = np.int32(0)
    for k in range(BLOCK):
        x, y = _advance_sample(rows, k, noise_v, noise_w, controls, base_yaw, dt, limits)
        fixed_x, fixed_y = _fixed_point(x, units, start_x), _fixed_point(y, units, start_y)
        cells[k] = _cell_of(fixed_x, fixed_y, last_x, last_y, stride)
        below = np.int32(below | np.int32(_border_distance(fixed_x, fixed_y) - near))
    return below < 0


@kernel
def _locate_start(rows, scale, last, cells):
    """Write the cell under the points of step 0, which are one point."""
    x, y = _fixed_point(rows[X], scale[0], scale[1]), _fixed_point(rows[Y], scale[0], scale[2])
    cells[:] = _cell_of(x, y, last[0], last[1], last[2])


@kernel
def _any_near(rows, first, scale, near):
    """Whether the point of any sample of a part of a block lies near a cell border."""
    units, start_x, start_y = scale
    below = np.int32(0)
    for k in range(PART):
        x = _fixed_point(rows[X + first + k], units, start_x)
        y = _fixed_point(rows[Y + first + k], units, start_y)
        below = np.int32(below | np.int32(_border_distance(x, y) - near))
    return below < 0


@kernel
def _off_border(offset, resolution):
    """Distance of a coordinate, m from the map's origin, from the nearest cell border, m."""
    cells = offset / resolution
    return abs(cells - np.rint(cells)) * resolution


@kernel
def _cell_exactly(rows, k, rollout, b, t, dt, call, grid):
    """Index of the window's cell under one point, found as Nav2 does, in the whole costmap."""
    (_, noise_v, noise_w, v, w), (_, _, stride, _, first_row, first_col, map_rows, map_cols, single) = rollout, grid
    x, y = np.float32(call.base_x + rows[X + k]), np.float32(call.base_y + rows[Y + k])
    resolution, origin_x, origin_y = call.resolution, call.origin_x, call.origin_y
    if min(_off_border(x - origin_x, resolution), _off_border(y - origin_y, resolution)) < LAST_BITS:
        sum_x, sum_y = retrace(noise_v[b], noise_w[b], k, t, v, w, call, dt)
        x, y = np.float32(call.base_x + sum_x), np.float32(call.base_y + sum_y)
    if single:
        place = np.float32(origin_x), np.float32(origin_y), np.float32(resolution)
        cell = cell_index(x, y, *place, map_rows, map_cols)
    else:
        cell = cell_index(np.float64(x), np.float64(y), origin_x, origin_y, resolution, map_rows, map_cols)
    if cell < 0:
        return np.uint32(0)
    return np.uint32((cell // map_cols - first_row + 1) * stride + cell % map_cols - first_col + 1)


@kernel
def _locate_exactly(rows, rollout, b, t, dt, call, scale, near, grid, cells):
    """Look up the points near a cell border as Nav2 does; arguments as in :func:`sweep`."""
    for first in range(0, BLOCK, PART):
        if not _any_near(rows, first, scale, near):
            continue
        for k in range(first, first + PART):
            x, y = _fixed_point(rows[X + k], scale[0], scale[1]), _fixed_point(rows[Y + k], scale[0], scale[2])
            if _border_distance(x, y) < near:
                cells[k] = _cell_exactly(rows, k, rollout, b, t, dt, call, grid)


@inlined
def _gather(i, last, ring, window, b, collected):
    """Add up contributions whenever the ring is full or look ``i`` is the last."""
    if i % RING == RING - 1:
        for k in range(BLOCK):
            pair = window[ring[0, k]] + window[ring[1, k]]
            collected[CELLS, b, k] += pair + (window[ring[2, k]] + window[ring[3, k]])
    elif i == last:
        for j in range(i % RING + 1):
            for k in range(BLOCK):
                collected[CELLS, b, k] += window[ring[j, k]]


@inlined
def _keep(rows, call, b, kept, i):
    for k in range(BLOCK):
        kept[0, i, b, k] = np.float32(call.base_x + rows[X + k])
        kept[1, i, b, k] = np.float32(call.base_y + rows[Y + k])
    if len(kept) > 2:
        for k in range(BLOCK):
            kept[2, i, b, k] = rows[TURNED + k] + np.float32(call.base_yaw)


@inlined
def _add_distance(rows, goal_x, goal_y, b, collected):
    for k in range(BLOCK):
        dx = rows[X + k] - goal_x
        dy = rows[Y + k] - goal_y
        collected[DISTANCE, b, k] += np.sqrt(dx * dx + dy * dy)


@inlined
def _add_heading(rows, cos, sin, either_way, b, collected):
    """Add the angle between each sample's heading and a direction, or with ``either_way`` its opposite, if nearer."""
    for k in range(BLOCK):
        cross = rows[COS + k] * sin - rows[SIN + k] * cos
        dot = rows[COS + k] * cos + rows[SIN + k] * sin
        forward = -dot if dot < ZERO else dot
        collected[ANGLE, b, k] += angle_of(forward if either_way else dot, -cross if cross < ZERO else cross)


@kernel
def _start_sums(rows, v_0, speeds, effort, b, collected):
    """Begin all sums of a block; the speed at step 0 is the measured one."""
    excess, reverse = above_or_below(v_0, speeds[0], speeds[1]), backwards(v_0)
    for k in range(BLOCK):
        rows[EXCESSES + k], rows[REVERSES + k], rows[EFFORTS + k] = excess, reverse, effort
    for row in (CELLS, DISTANCE, ANGLE):
        start_at(ZERO, b, collected[row])


@kernel
def _finish(rows, noise_v, noise_w, effort_v, effort_w, base_yaw, b, collected):
    """Write the scores of a block's controls, and its last headings.

    The last control moves nothing and adds effort only. The headings are left in the row of PathAngle, which may need
    them.
    """
    for k in range(BLOCK):
        collected[EFFORT, b, k] = rows[EFFORTS + k] + (effort_v * noise_v[k] + effort_w * noise_w[k])
    for k in range(BLOCK):
        collected[EXCESS, b, k], collected[REVERSE, b, k] = rows[EXCESSES + k], rows[REVERSES + k]
        collected[BEARINGS, b, k] = rows[TURNED + k] + base_yaw


@kernel
def sweep(
    call_of, dt, rollout, efforts, speeds, keep, kept, looked, grid, scale, window, measure, look, either_way,
    collected,
):  # fmt: skip
    """Roll out all samples once and score them on the way.

    Args:
        call_of: ``(1,)`` record of the call.
        dt: Period, s.
        rollout: ``(refresh_every, noise_v, noise_w, v, w)``: steps between two evaluations of sine and cosine;
            ``(blocks, time_steps, samples)`` noise and ``(time_steps,)`` control sequence, both m/s and rad/s.
        efforts: ``(time_steps,)`` factors of the two noises in the effort, and the effort of a noise of zero.
        speeds: Highest and lowest speed that costs nothing, m/s; float32.
        keep: ``(time_steps,)`` row of ``kept`` that takes a step's points, or -1.
        kept: ``(2 or 3, kept steps, blocks, samples)`` world x, y and perhaps yaw, written.
        looked: ``(time_steps,)`` number of the look-up of the cells under a step's points, or -1 for a step without
            one; contributions are summed over the look-ups.
        grid: Last coordinates and stride of the window; fraction below which a point is near a cell border; first row
            and column of the window; rows and columns of the costmap; whether Nav2 looks up its cells in float32.
        scale: ``(units per m, units of the start x, of the start y)``.
        window: Contributions of the cells; see :mod:`controllers.mppi.kernels.window`.
        measure: Whether to sum up distances from the goal.
        look: Whether to sum up angles from the heading at the end of the local path.
        either_way: Whether the opposite heading is as good.
        collected: ``(12, blocks, samples)`` sums over the steps, written.
    """
    call, (refresh_every, noise_v, noise_w, v, w), steps = call_of[0], rollout, len(rollout[3])
    scale = np.float32(scale[0]), np.float32(scale[1]), np.float32(scale[2])
    last, near = (np.uint32(grid[0]), np.uint32(grid[1]), np.uint32(grid[2])), np.int32(grid[3])
    rows, ring = np.empty(ROWS_SIZE, dtype=np.float32), np.empty((RING, BLOCK), dtype=np.uint32)
    yaw_0, period = np.float32(call.base_yaw), np.float32(dt)
    goal_x, goal_y = np.float32(call.goal_x - call.base_x), np.float32(call.goal_y - call.base_y)
    cos, sin = np.float32(np.cos(call.end_yaw)), np.float32(np.sin(call.end_yaw))
    (highest, lowest), (effort_v, effort_w, effort), last_look = speeds, efforts, looked.max()
    for b in range(len(noise_v)):
        start(rows, call, period)
        _start_sums(rows, np.float32(call.v), speeds, effort, b, collected)
        for t in range(steps):
            looks, is_near, cells = looked[t] >= 0, True, ring[looked[t] % RING]
            if t == 0:
                _locate_start(rows, scale, last, cells)
            else:
                controls, limits = (v[t - 1], w[t - 1]), (highest, lowest, effort_v[t - 1], effort_w[t - 1])
                noise = noise_v[b, t - 1], noise_w[b, t - 1]
                if looks:
                    is_near = step_and_locate(rows, *noise, controls, yaw_0, period, limits, scale, last, near, cells)
                else:
                    step_and_score(rows, *noise, controls, yaw_0, period, limits)
                if t % refresh_every == 0:
                    refresh(rows, yaw_0)
            if keep[t] >= 0:
                _keep(rows, call, b, kept, keep[t])
            if looks:
                if is_near:
                    _locate_exactly(rows, rollout, b, t, period, call, scale, near, grid, cells)
                _gather(looked[t], last_look, ring, window, b, collected)
            if measure:
                _add_distance(rows, goal_x, goal_y, b, collected)
            if look:
                _add_heading(rows, cos, sin, either_way, b, collected)
        final = steps - 1
        _finish(rows, noise_v[b, final], noise_w[b, final], effort_v[final], effort_w[final], yaw_0, b, collected)
