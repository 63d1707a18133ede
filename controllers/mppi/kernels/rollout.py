"""Rolling out a batch of trajectories: one time step of a block of samples at once.

The layout makes this fast. Arrays are ``(blocks, time_steps, samples)`` with the samples innermost. The state of a
block is one flat array whose rows are a constant apart, so that LLVM sees that they do not overlap, and vectorises
loops over them.

The arithmetic follows Nav2's order of float32 operations (``Optimizer::integrateStateVelocities``). Up to Jazzy,
displacement and turn are summed up from zero and the start pose is added last; in Lyrical the sums begin at the start
pose. The record of a call holds both: the sums begin at ``sum_x``, ``sum_y`` and ``sum_yaw``, and ``base_x``,
``base_y`` and ``base_yaw`` are added.
"""

from __future__ import annotations

import numpy as np

from controllers.mppi.kernels.elementary import COS_4, HALF, SIN_3, SIN_5, sin_cos
from gym_mapbench.kernels.jit import inlined, kernel

BLOCK = 512
"""Samples of a block."""

# Where the rows of a block's state begin: sums of the displacements (m) and of the turns (rad), cosine and sine of the
# heading.
X, Y, TURNED, COS, SIN = (BLOCK * row for row in range(5))
STATE_SIZE = 5 * BLOCK

# Up to this change of heading per step (rad), rotating sine and cosine by a polynomial is exact to float32.
SMALL_CHANGE = 0.25
# Number of rotations after which they are evaluated afresh, before rounding errors add up.
REFRESH_EVERY = 16


@inlined
def advance(x, y, turned, cos, sin, v, w, base_yaw, dt):
    """State of one sample a period later at the speeds ``v`` (m/s) and ``w`` (rad/s), its heading rotated."""
    total = turned + w * dt
    a = (total + base_yaw) - (turned + base_yaw)
    z = a * a
    s = a + (a * z) * (SIN_3 + z * SIN_5)
    c = z * (z * COS_4 - HALF)
    moved_x, moved_y = x + (v * cos) * dt, y + (v * sin) * dt
    return moved_x, moved_y, total, cos + (cos * c - sin * s), sin + (sin * c + cos * s)


@kernel
def first_state(call, dt):
    """State at step 0: one period at the speeds of the start, the same for all samples."""
    v, turned = np.float32(call.v), np.float32(call.sum_yaw) + np.float32(call.w) * dt
    sin, cos = sin_cos(np.float32(call.yaw))
    sin_1, cos_1 = sin_cos(turned + np.float32(call.base_yaw))
    return np.float32(call.sum_x) + (v * cos) * dt, np.float32(call.sum_y) + (v * sin) * dt, turned, cos_1, sin_1


@kernel
def next_state(state, v, w, base_yaw, dt, refresh):
    """State of one sample a period later; with ``refresh``, sine and cosine are evaluated afresh."""
    x, y, turned, cos, sin = state
    x, y, turned, cos, sin = advance(x, y, turned, cos, sin, v, w, base_yaw, dt)
    if refresh:
        sin, cos = sin_cos(turned + base_yaw)
    return x, y, turned, cos, sin


@kernel
def start(rows, call, dt):
    """Set a block to step 0; see :func:`first_state`."""
    x, y, turned, cos, sin = first_state(call, dt)
    for k in range(BLOCK):
        rows[X + k], rows[Y + k], rows[TURNED + k], rows[COS + k], rows[SIN + k] = x, y, turned, cos, sin


@kernel
def step(rows, noise_v, noise_w, v, w, base_yaw, dt):
    """Advance a block by one period with the controls ``v + noise_v`` and ``w + noise_w``."""
    for k in range(BLOCK):
        x, y, turned, cos, sin = advance(
            rows[X + k], rows[Y + k], rows[TURNED + k], rows[COS + k], rows[SIN + k], v + noise_v[k], w + noise_w[k],
            base_yaw, dt,
        )  # fmt: skip
        rows[X + k], rows[Y + k], rows[TURNED + k], rows[COS + k], rows[SIN + k] = x, y, turned, cos, sin


@kernel
def refresh(rows, base_yaw):
    """Evaluate sine and cosine of a block's headings afresh."""
    for k in range(BLOCK):
        rows[SIN + k], rows[COS + k] = sin_cos(rows[TURNED + k] + base_yaw)


@kernel
def retrace(noise_v, noise_w, k, end, v, w, call, dt):
    """Sums ``(x, y)`` of one sample at step ``end``, sine and cosine evaluated at every step."""
    state, base_yaw = first_state(call, dt), np.float32(call.base_yaw)
    for t in range(end):
        state = next_state(state, v[t] + noise_v[t, k], w[t] + noise_w[t, k], base_yaw, dt, np.bool_(True))
    return state[0], state[1]
