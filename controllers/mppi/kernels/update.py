"""From costs to the next control sequence: soft-max, weighted mean, limits, Savitzky-Golay filter."""

from __future__ import annotations

import numpy as np

from controllers.mppi.kernels.elementary import ONE, ZERO, exp_negative
from gym_mapbench.kernels.jit import kernel

FAR = np.float32(np.inf)
# Nine points, quadratic (Savitzky and Golay).
FILTER = np.array([-21, 14, 39, 54, 59, 54, 39, 14, -21], dtype=np.float32) / np.float32(231)
HALF_WINDOW = 4
# The same for a line: the mean.
LINEAR_FILTER = np.full(9, np.float32(1) / np.float32(9))
SHORTEST_FILTERED = 21


@kernel
def add_scores(scores, factor, power, applies, out, total):
    """Write ``(factor * scores)^power`` to ``out``, or 0, and add it to ``total``; all ``(blocks, samples)``."""
    gain = np.float32(factor)
    width = scores.shape[1]
    for b in range(scores.shape[0]):
        if not applies:
            for k in range(width):
                out[b, k] = ZERO
            continue
        for k in range(width):
            out[b, k] = gain * scores[b, k]
        for _ in range(power - 1):
            for k in range(width):
                out[b, k] *= gain * scores[b, k]
        for k in range(width):
            total[b, k] += out[b, k]


@kernel
def _smallest(costs, samples):
    best, width = FAR, costs.shape[1]
    for b in range(costs.shape[0]):
        for k in range(min(width, samples - b * width)):
            best = min(best, costs[b, k])
    return best


@kernel
def soft_max(costs, samples, temperature, weights):
    """Write ``exp(-(cost - smallest) / temperature)`` to ``weights``, 0 for padding; return their sum."""
    blocks, width = costs.shape
    smallest = _smallest(costs, samples)
    gain = -ONE / np.float32(temperature)
    for b in range(blocks):
        for k in range(width):
            weights[b, k] = exp_negative(gain * (costs[b, k] - smallest))
        for k in range(max(0, min(width, samples - b * width)), width):
            weights[b, k] = ZERO
    total = 0.0
    for b in range(blocks):
        for k in range(width):
            total += weights[b, k]
    return total


@kernel
def _add_quarters(weights, noise_v, noise_w, b, t, quarter, lanes_v, lanes_w):
    """Add weight times noise of one row to the lanes, four parts of the row side by side."""
    second, third, fourth = quarter, 2 * quarter, 3 * quarter
    for k in range(quarter):
        w_1, w_2 = weights[b, k], weights[b, second + k]
        w_3, w_4 = weights[b, third + k], weights[b, fourth + k]
        lanes_v[k] += (w_1 * noise_v[b, t, k] + w_2 * noise_v[b, t, second + k]) + (
            w_3 * noise_v[b, t, third + k] + w_4 * noise_v[b, t, fourth + k]
        )
        lanes_w[k] += (w_1 * noise_w[b, t, k] + w_2 * noise_w[b, t, second + k]) + (
            w_3 * noise_w[b, t, third + k] + w_4 * noise_w[b, t, fourth + k]
        )


@kernel
def _sum_lanes(lanes):
    """Sum of a row whose length is a multiple of 32; the row is overwritten."""
    width = len(lanes)
    while width % 16 == 0:
        width //= 2
        for k in range(width):
            lanes[k] += lanes[width + k]
    total = 0.0
    for k in range(width):
        total += lanes[k]
    return total


@kernel
def add_mean_noise(noise_v, noise_w, weights, total, v, w):
    """Add the weighted mean of the noise to the control sequence.

    Args:
        noise_v: ``(blocks, time_steps, samples)`` m/s.
        noise_w: The same, rad/s.
        weights: ``(blocks, samples)``.
        total: Sum of the weights.
        v: ``(time_steps,)`` control sequence, m/s, updated.
        w: The same, rad/s.
    """
    quarter = noise_v.shape[2] // 4
    lanes_v, lanes_w = np.empty(quarter, dtype=np.float32), np.empty(quarter, dtype=np.float32)
    for t in range(len(v)):
        for k in range(quarter):
            lanes_v[k] = lanes_w[k] = ZERO
        for b in range(noise_v.shape[0]):
            _add_quarters(weights, noise_v, noise_w, b, t, quarter, lanes_v, lanes_w)
        v[t] += np.float32(_sum_lanes(lanes_v) / total)
        w[t] += np.float32(_sum_lanes(lanes_w) / total)


@kernel
def clip_controls(v, w, v_min, v_max, w_max):
    """Limit the speeds of the control sequence."""
    lowest, highest, fastest = np.float32(v_min), np.float32(v_max), np.float32(w_max)
    for t in range(len(v)):
        v[t] = min(max(v[t], lowest), highest)
        w[t] = min(max(w[t], -fastest), fastest)


@kernel
def clip_turns(v, w, turning_radius):
    """Limit how tightly the control sequence turns, by a turning radius in m."""
    radius = np.float32(turning_radius)
    for t in range(len(v)):
        if abs(v[t]) < radius * abs(w[t]):
            w[t] = np.sign(w[t]) * abs(v[t]) / radius


@kernel
def _filtered(u, i, history, weights):
    """Value ``i`` of a smoothed control sequence; the controls sent go before it, its last value goes on after it."""
    total = ZERO
    for j in range(len(weights)):
        at = i + j - HALF_WINDOW
        total += weights[j] * (history[HALF_WINDOW + at] if at < 0 else u[min(at, len(u) - 1)])
    return total


@kernel
def filter_controls(u, history):
    """Smooth one axis of the control sequence in place, left to right, as Humble does.

    Values already filtered feed the later windows, and the value five before the end stays as it is.

    Args:
        u: ``(time_steps,)`` controls, updated.
        history: ``(4,)`` controls sent before, oldest first.
    """
    steps = len(u)
    if steps < SHORTEST_FILTERED:
        return
    for i in range(steps):
        if i != steps - HALF_WINDOW - 1:
            u[i] = _filtered(u, i, history, FILTER)


@kernel
def filter_copy(u, history, weights):
    """Smooth all values but the last of one axis of the control sequence, each from unsmoothed values (since Jazzy).

    Args:
        u: ``(time_steps,)`` controls, updated.
        history: ``(4,)`` controls before, oldest first.
        weights: ``(9,)`` weights of a window.
    """
    if len(u) >= SHORTEST_FILTERED:
        before = u.copy()
        for i in range(len(u) - 1):
            u[i] = _filtered(before, i, history, weights)


@kernel
def smooth(v, w, history_v, history_w, in_place):
    """Filter both axes of the control sequence; see :func:`filter_controls` and :func:`filter_copy`."""
    if in_place:
        filter_controls(v, history_v)
        filter_controls(w, history_w)
    else:
        filter_copy(v, history_v, FILTER)
        filter_copy(w, history_w, FILTER)


@kernel
def smooth_and_remember(v, w, history_v, history_w, weights, shifts):
    """Filter both axes and remember the filtered control that would be sent, which limits may still change (Lyrical).

    Arguments as in :func:`filter_copy` and :func:`send`.
    """
    filter_copy(v, history_v, weights)
    filter_copy(w, history_w, weights)
    _remember(v, history_v, shifts)
    _remember(w, history_w, shifts)


@kernel
def _remember(u, history, shifts):
    """Put the control that is sent at the end of the history of one axis."""
    if len(u) >= SHORTEST_FILTERED:
        for i in range(HALF_WINDOW - 1):
            history[i] = history[i + 1]
        history[HALF_WINDOW - 1] = u[1] if shifts else u[0]


@kernel
def send(v, w, history_v, history_w, shifts, remembers):
    """Return the controls that are sent.

    Args:
        v: ``(time_steps,)`` m/s, updated.
        w: The same, rad/s.
        history_v: ``(4,)`` speeds sent before, oldest first, updated.
        history_w: The same for turn rates.
        shifts: Whether the sequence is moved on by a period.
        remembers: Whether the controls are put into the histories.
    """
    if remembers:
        _remember(v, history_v, shifts)
        _remember(w, history_w, shifts)
    return _send(v, shifts), _send(w, shifts)


@kernel
def _send(u, shifts):
    """Return the control of one axis that is sent."""
    sent = u[1] if shifts else u[0]
    if shifts:
        for t in range(len(u) - 1):
            u[t] = u[t + 1]
    return sent
