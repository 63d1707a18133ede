"""Scores that look at the controls alone: speed limits, driving backwards, turning, and the control effort.

The speed at step 0 is the measured one; the speed at step t is the control of step t - 1.
"""

from __future__ import annotations

import numpy as np

from controllers.mppi.kernels.elementary import ZERO
from gym_mapbench.kernels.jit import inlined, kernel

# Rows of what a sweep collects per sample: speed outside the limits, speed backwards, control effort, contributions of
# cells, distances from the end of the local path, angles; and one to spare.
EXCESS, REVERSE, EFFORT, CELLS, DISTANCE, ANGLE, SPARE = range(7)
COLLECTED_ROWS = 7


@inlined
def _add_costs(noise_v, noise_w, t, v, highest, lowest, cost_v, cost_w, b, collected):
    for k in range(noise_v.shape[1]):
        speed = v + noise_v[t, k]
        above, below = speed - highest, lowest - speed
        worse = above if above > below else below
        collected[EXCESS, b, k] += worse if worse > ZERO else ZERO
        collected[REVERSE, b, k] -= speed if speed < ZERO else ZERO
        collected[EFFORT, b, k] += cost_v * noise_v[t, k] + cost_w * noise_w[t, k]


@inlined
def _add_effort(noise_v, noise_w, t, cost_v, cost_w, b, collected):
    for k in range(noise_v.shape[1]):
        collected[EFFORT, b, k] += cost_v * noise_v[t, k] + cost_w * noise_w[t, k]


@kernel
def _start_at(value, b, sums):
    for k in range(sums.shape[1]):
        sums[b, k] = value


@kernel
def start_controls(v_0, speeds, b, collected):
    """Begin the sums of a block with the measured speed ``v_0``."""
    highest, lowest = np.float32(speeds[0]), np.float32(speeds[1])
    _start_at(max(max(v_0 - highest, lowest - v_0), ZERO), b, collected[EXCESS])
    _start_at(max(-v_0, ZERO), b, collected[REVERSE])
    _start_at(ZERO, b, collected[EFFORT])


@inlined
def add_controls(noise_v, noise_w, t, v, w, speeds, b, collected):
    """Add what the controls of one step cost.

    Args:
        noise_v: ``(time_steps, samples)`` noise of the controls, m/s.
        noise_w: The same, rad/s.
        t: The step; the last control moves nothing and costs effort only.
        v: ``(time_steps,)`` control sequence, m/s.
        w: The same, rad/s.
        speeds: Highest and lowest speed that costs nothing, m/s; gamma / std^2 of v and of w.
        b: Block.
        collected: ``(7, blocks, samples)`` sums.
    """
    effort_v, effort_w = np.float32(speeds[2]) * v[t], np.float32(speeds[3]) * w[t]
    if t < len(v) - 1:
        highest, lowest = np.float32(speeds[0]), np.float32(speeds[1])
        _add_costs(noise_v, noise_w, t, v[t], highest, lowest, effort_v, effort_w, b, collected)
    else:
        _add_effort(noise_v, noise_w, t, effort_v, effort_w, b, collected)


@kernel
def add_turning(noise_w, w, w_0, turning):
    """Write each sample's sum of ``|w|`` over the steps."""
    blocks, steps, samples = noise_w.shape
    for b in range(blocks):
        _start_at(np.float32(abs(w_0)), b, turning)
        for t in range(steps - 1):
            for k in range(samples):
                turning[b, k] += abs(w[t] + noise_w[b, t, k])


@kernel
def add_below(noise, u, u_0, threshold, below):
    """Add each sample's sum of how far ``|u|`` lies below ``threshold`` to ``below``."""
    blocks, steps, samples = noise.shape
    limit, first = np.float32(threshold), np.float32(abs(u_0))
    for b in range(blocks):
        for k in range(samples):
            below[b, k] += limit - first if first < limit else ZERO
        for t in range(steps - 1):
            for k in range(samples):
                lacking = limit - abs(u[t] + noise[b, t, k])
                below[b, k] += lacking if lacking > ZERO else ZERO


@kernel
def add_too_tight(rollout, v_0, w_0, radius, excess):
    """Add how far each sample's turning radius ``|v| / |w|`` lies below ``radius`` (m) to ``excess``."""
    _, noise_v, noise_w, v, w = rollout
    blocks, steps, samples = noise_v.shape
    smallest = np.float32(radius)
    for b in range(blocks):
        for t in range(steps):
            for k in range(samples):
                speed = np.float32(v_0) if t == 0 else v[t - 1] + noise_v[b, t - 1, k]
                turn = np.float32(w_0) if t == 0 else w[t - 1] + noise_w[b, t - 1, k]
                lacking = smallest - abs(speed) / abs(turn)
                excess[b, k] += lacking if lacking > ZERO else ZERO
