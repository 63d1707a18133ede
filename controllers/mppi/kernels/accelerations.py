"""Limits of the acceleration, which Jazzy puts on the sampled controls and on the resulting control sequence.

Source: nav2_mppi_controller (Jazzy): motion_models.hpp (predict) and optimizer.cpp (applyControlSequenceConstraints).
"""

from __future__ import annotations

import numpy as np

from controllers.mppi.kernels.elementary import ZERO
from controllers.mppi.kernels.rollout import BLOCK
from gym_mapbench.kernels.jit import inlined, kernel

# Rows of a block: the controls of the step before, and the sum of all speeds and the fastest turn so far.
SPEED, TURN, DRIVEN, FASTEST = (BLOCK * row for row in range(4))
ROWS_SIZE = 4 * BLOCK


@inlined
def within_reach(speed, before, gain, loss):
    """The speed nearest to a wanted one that can be reached within one period.

    Args:
        speed: The wanted speed.
        before: The speed one period before.
        gain: Largest change away from zero within a period; from zero, the largest change backwards.
        loss: Largest change towards zero, negative; from zero, the largest change forwards.
    """
    lowest = before + loss if before > ZERO else before - gain
    highest = before + gain if before > ZERO else before - loss
    raised = lowest if speed < lowest else speed
    return highest if highest < raised else raised


@kernel
def _limits(tuning):
    """Largest changes of v (gain, loss) and of w within a period."""
    dt = np.float32(tuning.model_dt)
    return dt * np.float32(tuning.ax_max), dt * np.float32(tuning.ax_min), dt * np.float32(tuning.az_max)


@kernel
def _limit_step(rows, noise_v, noise_w, v, w, limits, limited_v, limited_w):
    """Write the controls of a block at one step, each within reach of the one before."""
    gain, loss, change = limits
    for k in range(BLOCK):
        speed = within_reach(v + noise_v[k], rows[SPEED + k], gain, loss)
        turn = within_reach(w + noise_w[k], rows[TURN + k], change, -change)
        limited_v[k] = rows[SPEED + k] = speed
        limited_w[k] = rows[TURN + k] = turn
        rows[DRIVEN + k] += abs(speed)
        rows[FASTEST + k] = max(rows[FASTEST + k], abs(turn))


@kernel
def _start(rows, v_0, w_0):
    """Begin a block at the measured speeds."""
    for k in range(BLOCK):
        rows[SPEED + k], rows[TURN + k] = v_0, w_0
        rows[DRIVEN + k] = rows[FASTEST + k] = ZERO


@kernel
def limit_samples(tuning, call, noise_v, noise_w, v, w, limited_v, limited_w):
    """Write the sampled controls, each within reach of the one before; the last, which moves nothing, is free.

    Args:
        tuning: Record of the parameters.
        call: Record of the call.
        noise_v: ``(blocks, time_steps, samples)`` m/s.
        noise_w: The same, rad/s.
        v: ``(time_steps,)`` control sequence, m/s.
        w: The same, rad/s.
        limited_v: ``(blocks, time_steps, samples)`` m/s, written.
        limited_w: The same, rad/s.

    Returns:
        The largest sum of ``|v|`` over the steps of a sample, and the largest ``|w|``.
    """
    limits, last = _limits(tuning), len(v) - 1
    rows = np.empty(ROWS_SIZE, dtype=np.float32)
    longest = fastest = ZERO
    for b in range(len(noise_v)):
        _start(rows, np.float32(call.v), np.float32(call.w))
        for t in range(last):
            _limit_step(rows, noise_v[b, t], noise_w[b, t], v[t], w[t], limits, limited_v[b, t], limited_w[b, t])
        for k in range(BLOCK):
            limited_v[b, last, k], limited_w[b, last, k] = v[last] + noise_v[b, last, k], w[last] + noise_w[b, last, k]
            longest, fastest = max(longest, rows[DRIVEN + k]), max(fastest, rows[FASTEST + k])
    return longest, fastest


@kernel
def limit_sequence(tuning, v, w):
    """Bring every control of the sequence but the first within reach of the one before."""
    gain, loss, change = _limits(tuning)
    for t in range(1, len(v)):
        v[t] = within_reach(v[t], v[t - 1], gain, loss)
        w[t] = within_reach(w[t], w[t - 1], change, -change)
