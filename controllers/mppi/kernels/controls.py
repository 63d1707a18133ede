"""Scores that look at the controls alone: speed limits, driving backwards, turning, and the control effort.

The speed at step 0 is the measured one; the speed at step t is the control of step t - 1.
"""

from __future__ import annotations

import numpy as np

from controllers.mppi.kernels.elementary import ZERO
from gym_mapbench.kernels.jit import inlined, kernel

# Rows of what is collected per sample: speed outside the limits, speed backwards, control effort, contributions of
# cells, distance from the goal, angle from the heading at the end of the local path, angle from a bearing, closeness to
# obstacles, distance from the path and from a point on it, turn rate, and how far speeds are within the deadband.
EXCESS, REVERSE, EFFORT, CELLS, DISTANCE, ANGLE, BEARINGS, CLOSENESS, ALIGNED, FOLLOWED, TURNING, DEADBANDS = range(12)
COLLECTED_ROWS = 12

SLOWEST_TURN = np.float32(1e-6)
"""Turn rate by which Lyrical's Constraint divides at least, rad/s."""

FEASIBLE = 2
"""PathAngle's mode in which the path's own headings say whether it is driven forwards or backwards."""


@inlined
def above_or_below(speed, highest, lowest):
    """How far a speed lies outside its limits."""
    above, below = speed - highest, lowest - speed
    worse = above if above > below else below
    return worse if worse > ZERO else ZERO


@inlined
def backwards(speed):
    """Speed backwards of a signed speed, 0 for one forwards."""
    return -speed if speed < ZERO else ZERO


@kernel
def start_at(value, b, scores):
    """Begin the sums of a block, of ``scores`` ``(blocks, samples)``, with ``value``."""
    for k in range(scores.shape[1]):
        scores[b, k] = value


@kernel
def score_turning(call_of, rollout, collected):
    """Write each sample's sum of ``|w|`` over the steps (Twirling)."""
    _, _, noise_w, _, w = rollout
    blocks, steps, samples = noise_w.shape
    for b in range(blocks):
        start_at(np.float32(abs(call_of[0].w)), b, collected[TURNING])
        for t in range(steps - 1):
            for k in range(samples):
                collected[TURNING, b, k] += abs(w[t] + noise_w[b, t, k])


@kernel
def _add_below(noise, u, u_0, limit, collected):
    """Add how far ``|u|`` lies below ``limit``, summed up over the steps."""
    blocks, steps, samples = noise.shape
    for b in range(blocks):
        for t in range(steps):
            for k in range(samples):
                lacking = limit - abs(u_0 if t == 0 else u[t - 1] + noise[b, t - 1, k])
                collected[DEADBANDS, b, k] += lacking if lacking > ZERO else ZERO


@kernel
def score_deadband(tuning_of, call_of, rollout, collected):
    """Write how far each sample's speeds are below the lowest that the base can drive (VelocityDeadband)."""
    call, limits = call_of[0], tuning_of[0].VelocityDeadbandCritic.deadband_velocities
    _, noise_v, noise_w, v, w = rollout
    for b in range(noise_v.shape[0]):
        start_at(ZERO, b, collected[DEADBANDS])
    _add_below(noise_v, v, np.float32(call.v), np.float32(abs(limits[0])), collected)
    _add_below(noise_w, w, np.float32(call.w), np.float32(abs(limits[2])), collected)


@kernel
def add_too_tight(tuning_of, call_of, rollout, collected):
    """Add how far each sample's turning radius ``|v| / |w|`` lies below Ackermann's to its excess (Constraint)."""
    smallest, call = np.float32(tuning_of[0].AckermannConstraints.min_turning_r), call_of[0]
    least = SLOWEST_TURN if tuning_of[0].lyrical else ZERO
    _, noise_v, noise_w, v, w = rollout
    blocks, steps, samples = noise_v.shape
    for b in range(blocks):
        for t in range(steps):
            for k in range(samples):
                speed = np.float32(call.v) if t == 0 else v[t - 1] + noise_v[b, t - 1, k]
                turn = np.float32(call.w) if t == 0 else w[t - 1] + noise_w[b, t - 1, k]
                lacking = smallest - abs(speed) / max(abs(turn), least)
                collected[EXCESS, b, k] += lacking if lacking > ZERO else ZERO


@kernel
def write_effort(noise_v, noise_w, factors_v, factors_w, collected):
    """Write each sample's control effort, the sum of factor times noise over the steps and both axes.

    Args:
        noise_v: ``(blocks, time_steps, samples)`` m/s.
        noise_w: The same, rad/s.
        factors_v: ``(time_steps,)``.
        factors_w: The same.
        collected: ``(12, blocks, samples)``; row EFFORT is written.
    """
    blocks, steps, samples = noise_v.shape
    for b in range(blocks):
        start_at(ZERO, b, collected[EFFORT])
        for t in range(steps):
            factor_v, factor_w = factors_v[t], factors_w[t]
            for k in range(samples):
                collected[EFFORT, b, k] += factor_v * noise_v[b, t, k] + factor_w * noise_w[b, t, k]
