"""Rolling out a batch of trajectories, row by row: one time step of many samples at once.

Layout is what makes this fast. Arrays are ``(blocks, time_steps, samples)`` with the samples innermost, and a
block of samples is carried through time with its state in rows that stay in the first cache level. Every loop
below runs over one such row, has no indirect load beside a store and no call, so that LLVM vectorises it.

The arithmetic follows Nav2's order of float32 operations: displacement and turn are summed up from zero and the
start pose is added last (``Optimizer::integrateStateVelocities``).
"""

from __future__ import annotations

from controllers.mppi.kernels.elementary import COS_4, HALF, SIN_3, SIN_5, sin_cos
from gym_mapbench.kernels.jit import inlined, kernel

BLOCK = 512
# Rows are padded to a multiple of this, so that sums over a row can run in four parts side by side.
ROW_UNIT = 128

# Rows of the state of a block: displacement from the start (m), turn since the start and its last change (rad), and the
# heading's cosine and sine.
X, Y, TURNED, CHANGE, COS, SIN = range(6)
STATE_ROWS = 6

# Rotating by a small angle instead of evaluating sine and cosine: exact to float32 below this change per step.
SMALL_CHANGE = 0.25
# Evaluate them afresh after so many rotations, before rounding adds up.
REFRESH_EVERY = 16


@inlined
def _move(rows, noise, t, v, dt):
    for k in range(rows.shape[1]):
        speed = v + noise[t, k]
        rows[X, k] += (speed * rows[COS, k]) * dt
        rows[Y, k] += (speed * rows[SIN, k]) * dt


@inlined
def _turn(rows, noise, t, w, dt, yaw_0):
    for k in range(rows.shape[1]):
        total = rows[TURNED, k] + (w + noise[t, k]) * dt
        rows[CHANGE, k] = (total + yaw_0) - (rows[TURNED, k] + yaw_0)
        rows[TURNED, k] = total


@inlined
def _rotate(rows):
    for k in range(rows.shape[1]):
        a = rows[CHANGE, k]
        z = a * a
        s = a + (a * z) * (SIN_3 + z * SIN_5)
        c = z * (z * COS_4 - HALF)
        cos, sin = rows[COS, k], rows[SIN, k]
        rows[COS, k] = cos + (cos * c - sin * s)
        rows[SIN, k] = sin + (sin * c + cos * s)


@inlined
def _refresh(rows, yaw_0):
    for k in range(rows.shape[1]):
        rows[SIN, k], rows[COS, k] = sin_cos(rows[TURNED, k] + yaw_0)


@kernel
def start(rows, v, w, yaw_0, dt):
    """Set ``rows`` to step 0: one period at the measured speeds ``v`` and ``w``, the same for all samples."""
    sin, cos = sin_cos(yaw_0)
    sin_1, cos_1 = sin_cos(w * dt + yaw_0)
    for k in range(rows.shape[1]):
        rows[X, k] = (v * cos) * dt
        rows[Y, k] = (v * sin) * dt
        rows[TURNED, k] = w * dt
        rows[COS, k] = cos_1
        rows[SIN, k] = sin_1


@inlined
def step(rows, noise_v, noise_w, t, v, w, yaw_0, dt, refresh):
    """Advance ``rows`` by one period with the controls ``v + noise_v[t]`` and ``w + noise_w[t]``."""
    _move(rows, noise_v, t, v, dt)
    _turn(rows, noise_w, t, w, dt, yaw_0)
    if refresh:
        _refresh(rows, yaw_0)
    else:
        _rotate(rows)


@kernel
def retrace(noise_v, noise_w, k, end, v, w, v_0, w_0, yaw_0, dt):
    """Displacement ``(x, y)`` of one sample at step ``end``, sine and cosine evaluated at every step."""
    sin, cos = sin_cos(yaw_0)
    x, y, turned = (v_0 * cos) * dt, (v_0 * sin) * dt, w_0 * dt
    for t in range(end):
        sin, cos = sin_cos(turned + yaw_0)
        speed = v[t] + noise_v[t, k]
        x += (speed * cos) * dt
        y += (speed * sin) * dt
        turned += (w[t] + noise_w[t, k]) * dt
    return x, y
