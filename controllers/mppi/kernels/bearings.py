"""How far trajectories face away from a path point: at every point in Humble, at the last point in Jazzy.

Source: nav2_mppi_controller/src/critics/path_angle_critic.cpp (Humble and Jazzy).
"""

from __future__ import annotations

import numpy as np

from controllers.mppi.kernels.controls import BEARINGS, FEASIBLE, start_at
from controllers.mppi.kernels.elementary import HALF_PI, PI, ZERO, angle_of, sin_cos
from controllers.mppi.kernels.rollout import BLOCK, COS, SIN, STATE_SIZE, X, Y, refresh, start, step
from gym_mapbench.kernels.jit import inlined, kernel


@inlined
def _add_bearing(rows, target_x, target_y, either_way, b, collected):
    """Add the angle between each sample's heading and the bearing of one point from it."""
    for k in range(BLOCK):
        dx = target_x - rows[X + k]
        dy = target_y - rows[Y + k]
        cross = rows[COS + k] * dy - rows[SIN + k] * dx
        dot = rows[COS + k] * dx + rows[SIN + k] * dy
        forward = -dot if dot < ZERO else dot
        collected[BEARINGS, b, k] += angle_of(forward if either_way else dot, -cross if cross < ZERO else cross)


@kernel
def sweep_bearings(tuning_of, call_of, rollout, collected):
    """Roll out all samples and sum up the angles between heading and bearing of the call's target (PathAngle)."""
    tuning, call, (refresh_every, noise_v, noise_w, v, w) = tuning_of[0], call_of[0], rollout
    rows, period = np.empty(STATE_SIZE, dtype=np.float32), np.float32(tuning.model_dt)
    base_yaw = np.float32(call.base_yaw)
    target_x, target_y = np.float32(call.target_x), np.float32(call.target_y)
    for b in range(len(noise_v)):
        start(rows, call, period)
        start_at(ZERO, b, collected[BEARINGS])
        for t in range(len(v)):
            if t > 0:
                step(rows, noise_v[b, t - 1], noise_w[b, t - 1], v[t - 1], w[t - 1], base_yaw, period)
                if t % refresh_every == 0:
                    refresh(rows, base_yaw)
            _add_bearing(rows, target_x, target_y, tuning.either_way, b, collected)


@inlined
def _off_by(x, y, cos, sin, target_x, target_y):
    """Angle between a heading and the bearing of a target, from 0 to pi."""
    dx, dy = target_x - x, target_y - y
    cross, dot = cos * dy - sin * dx, cos * dx + sin * dy
    return angle_of(dot, -cross if cross < ZERO else cross)


@kernel
def score_last_bearings(tuning_of, call_of, kept, collected):
    """Write the angle between the last heading and the bearing of the call's target (PathAngle in Jazzy).

    Args:
        tuning_of: ``(1,)`` record of the parameters.
        call_of: ``(1,)`` record of the call.
        kept: Points kept by the sweep.
        collected: ``(12, blocks, samples)``; row BEARINGS holds the last headings and is overwritten.
    """
    tuning, call, last = tuning_of[0], call_of[0], kept.shape[1] - 1
    x, y, row = kept[0, last], kept[1, last], collected[BEARINGS]
    target_x, target_y = np.float32(call.x + call.target_x), np.float32(call.y + call.target_y)
    path_cos, path_sin = np.float32(np.cos(call.target_yaw)), np.float32(np.sin(call.target_yaw))
    feasible = tuning.PathAngleCritic.mode == FEASIBLE
    for b in range(len(row)):
        for k in range(BLOCK):
            sin, cos = sin_cos(row[b, k])
            angle = _off_by(x[b, k], y[b, k], cos, sin, target_x, target_y)
            from_path = _off_by(x[b, k], y[b, k], path_cos, path_sin, target_x, target_y) if feasible else ZERO
            behind = from_path >= HALF_PI or (tuning.either_way and angle >= HALF_PI)
            row[b, k] = PI - angle if behind else angle
