"""Scores that look at the controls alone: speed limits, driving backwards, turning, and the control effort.

The speed at step 0 is the measured one; the speed at step t is the control of step t - 1.
"""

from __future__ import annotations

import numpy as np

from controllers.mppi.kernels.elementary import ZERO
from gym_mapbench.kernels.jit import kernel


@kernel
def _excess(speed, highest, lowest):
    """How far a speed lies outside ``[lowest, highest]``."""
    above, below = speed - highest, lowest - speed
    worse = above if above > below else below
    return worse if worse > ZERO else ZERO


@kernel
def _add_excess(noise, t, v, highest, lowest, b, excess):
    for k in range(noise.shape[1]):
        excess[b, k] += _excess(v + noise[t, k], highest, lowest)


@kernel
def _add_reverse(noise, t, v, b, reverse):
    for k in range(noise.shape[1]):
        speed = v + noise[t, k]
        reverse[b, k] -= speed if speed < ZERO else ZERO


@kernel
def _add_effort(noise_v, noise_w, t, cost_v, cost_w, b, effort):
    for k in range(noise_v.shape[1]):
        effort[b, k] += cost_v * noise_v[t, k] + cost_w * noise_w[t, k]


@kernel
def _start_at(value, b, sums):
    for k in range(sums.shape[1]):
        sums[b, k] = value


@kernel
def score_controls(noise_v, noise_w, v, w, v_0, limits, gains, excess, reverse, effort):
    """Sum up, per sample, what the speeds cost.

    Args:
        noise_v, noise_w: ``(blocks, time_steps, samples)`` noise of the controls, m/s and rad/s.
        v, w: ``(time_steps,)`` control sequence.
        v_0: Measured speed, m/s.
        limits: Highest and lowest speed that is not penalised, m/s.
        gains: gamma / std^2 of v and of w.
        excess: ``(blocks, samples)`` sum of m/s outside the limits, written.
        reverse: ``(blocks, samples)`` sum of m/s backwards, written.
        effort: ``(blocks, samples)`` sum of gain * control * noise, written.
    """
    blocks, steps = noise_v.shape[:2]
    highest, lowest, first = np.float32(limits[0]), np.float32(limits[1]), np.float32(v_0)
    gain_v, gain_w = np.float32(gains[0]), np.float32(gains[1])
    for b in range(blocks):
        _start_at(_excess(first, highest, lowest), b, excess)
        _start_at(-first if first < ZERO else ZERO, b, reverse)
        _start_at(ZERO, b, effort)
        for t in range(steps):
            if t < steps - 1:
                _add_excess(noise_v[b], t, v[t], highest, lowest, b, excess)
                _add_reverse(noise_v[b], t, v[t], b, reverse)
            _add_effort(noise_v[b], noise_w[b], t, gain_v * v[t], gain_w * w[t], b, effort)


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
def add_too_tight(noise_v, noise_w, v, w, v_0, w_0, radius, excess):
    """Add how far each sample's turning radius ``|v| / |w|`` lies below ``radius`` (m) to ``excess``."""
    blocks, steps, samples = noise_v.shape
    smallest = np.float32(radius)
    for b in range(blocks):
        for t in range(steps):
            for k in range(samples):
                speed = np.float32(v_0) if t == 0 else v[t - 1] + noise_v[b, t - 1, k]
                turn = np.float32(w_0) if t == 0 else w[t - 1] + noise_w[b, t - 1, k]
                lacking = smallest - abs(speed) / abs(turn)
                excess[b, k] += lacking if lacking > ZERO else ZERO
