"""Scores that follow single trajectories point by point, as Nav2's critics do.

Slower than a sweep over all samples, and needed for few: those whose footprint has to be looked at, and the whole
batch for the Obstacles critic. The chosen samples are rolled out again by the same kernels, so their points are the
same to the last bit.
"""

from __future__ import annotations

import math

import numpy as np

from controllers.mppi.kernels.rollout import STATE_ROWS, TURNED, X, Y, start, step
from controllers.mppi.kernels.window import INSCRIBED, LETHAL, MARKED
from gym_mapbench.kernels.footprint import footprint_cost
from gym_mapbench.kernels.geometry import cell_index
from gym_mapbench.kernels.jit import kernel

NO_INFORMATION = 255
NEVER = 256.0


@kernel
def footprint_threshold(consider_footprint, circumscribed_cost):
    """Cost of the centre from which on the outline of the footprint is looked at."""
    if not consider_footprint:
        return NEVER
    return circumscribed_cost if circumscribed_cost >= 1.0 else 0.0


@kernel
def collides(cost, unknown_is_free, inscribed_is_free):
    """Whether a cost value means contact."""
    if cost == NO_INFORMATION:
        return not unknown_is_free
    return cost == LETHAL or (cost == INSCRIBED and not inscribed_is_free)


@kernel
def _centre_cost(costs, call, x, y):
    """Cost of the cell under a point; 255 off the map."""
    rows, cols = costs.shape
    cell = cell_index(x, y, call.origin_x, call.origin_y, call.resolution, rows, cols)
    return NO_INFORMATION if cell < 0 else int(costs[cell // cols, cell % cols])


@kernel
def _outline_cost(costs, call, corners, x, y, yaw):
    """Largest cost under the outline of the footprint at a pose; 254 if it reaches off the map."""
    return int(footprint_cost(costs, call.resolution, call.origin_x, call.origin_y, x, y, yaw, corners))


@kernel
def _pose(rows, call, j):
    """Pose of one sample as Nav2 rounds it."""
    x, y = np.float32(call.x + rows[X, j]), np.float32(call.y + rows[Y, j])
    return np.float64(x), np.float64(y), np.float64(rows[TURNED, j] + np.float32(call.yaw))


@kernel
def _add_costs(rows, call, costs, corners, own, near_goal, threshold, value, hit):
    """Add the points of one step to the Cost critic's sums."""
    for j in range(len(hit)):
        if hit[j]:
            continue
        x, y, yaw = _pose(rows, call, j)
        cost = _centre_cost(costs, call, x, y)
        if cost < 1:
            continue
        worst = _outline_cost(costs, call, corners, x, y, yaw) if cost >= threshold else cost
        if collides(worst, call.unknown_is_free, own.consider_footprint):
            hit[j] = True
            value[j] = own.collision_cost
        elif cost >= INSCRIBED:
            value[j] += np.float32(own.critical_cost)
        elif not near_goal:
            value[j] += np.float32(cost)


@kernel
def _add_distances(rows, call, costs, corners, own, near_goal, threshold, inscribed_radius, repulsion, critical, hit):
    """Add the points of one step to the Obstacles critic's two sums."""
    for j in range(len(hit)):
        if hit[j]:
            continue
        x, y, yaw = _pose(rows, call, j)
        cost = _centre_cost(costs, call, x, y)
        by_footprint = cost >= threshold
        if by_footprint:
            cost = _outline_cost(costs, call, corners, x, y, yaw)
        if cost < 1:
            continue
        if collides(cost, call.unknown_is_free, own.consider_footprint):
            hit[j] = True
            critical[j] = own.collision_cost
            continue
        if own.cost_scaling_factor == 0.0 or own.inflation_radius == 0.0:
            continue
        distance = (math.log(253.0) - math.log(cost)) / own.cost_scaling_factor
        distance += inscribed_radius if by_footprint else 0.0
        if distance < own.collision_margin_distance:
            critical[j] += np.float32(own.collision_margin_distance - distance)
        elif not near_goal:
            repulsion[j] += np.float32(own.inflation_radius - distance)


@kernel
def _pick(noise, chosen, out):
    """Copy the noise of the ``chosen`` samples to ``(time_steps, len(chosen))``."""
    samples = noise.shape[2]
    for t in range(out.shape[0]):
        for j in range(len(chosen)):
            out[t, j] = noise[chosen[j] // samples, t, chosen[j] % samples]


@kernel
def _walk(call, dt, rollout, chosen, costs, corners, cost, obstacles, radius, near, sums):
    """Walk some samples for the Cost critic (``obstacles`` False) or the Obstacles critic.

    Args:
        call: The call.
        dt: Period, s.
        rollout: ``(refresh_every, noise_v, noise_w, v, w)``, as in the sweep.
        chosen: Indices of the samples.
        costs: ``(rows, cols)`` uint8 costmap.
        corners: ``(n, 2)`` footprint.
        cost: Parameters of the Cost critic.
        obstacles: Parameters of the Obstacles critic.
        radius: Inscribed radius, m; negative for the Cost critic.
        near: ``(near_goal, threshold)``: whether the robot is near the end of the local path, and the cost of the
            centre from which on the outline is looked at.
        sums: ``(2, len(chosen))`` results, 0 before: value, or repulsion and critical term.

    Returns:
        ``(len(chosen),)`` whether each collided.
    """
    refresh_every, noise_v, noise_w, v, w = rollout
    count, steps = len(chosen), noise_v.shape[1]
    part_v, part_w = np.empty((steps, count), dtype=np.float32), np.empty((steps, count), dtype=np.float32)
    _pick(noise_v, chosen, part_v)
    _pick(noise_w, chosen, part_w)
    rows, hit = np.empty((STATE_ROWS, count), dtype=np.float32), np.zeros(count, dtype=np.bool_)
    yaw_0, period = np.float32(call.yaw), np.float32(dt)
    start(rows, np.float32(call.v), np.float32(call.w), yaw_0, period)
    for t in range(steps):
        if t > 0:
            step(rows, part_v, part_w, t - 1, v[t - 1], w[t - 1], yaw_0, period, t % refresh_every == 0)
        if radius < 0.0:
            _add_costs(rows, call, costs, corners, cost, near[0], near[1], sums[0], hit)
        else:
            _add_distances(rows, call, costs, corners, obstacles, near[0], near[1], radius, sums[0], sums[1], hit)
    return hit


@kernel
def score_cost(tuning, call, rollout, costs, corners, near_goal, sums):
    """Turn the sums of a sweep into values of the Cost critic; return how many trajectories collide.

    Args:
        tuning: Parameters.
        call: The call.
        rollout: ``(refresh_every, noise_v, noise_w, v, w)``, as in the sweep.
        costs: ``(rows, cols)`` uint8 costmap.
        corners: ``(n, 2)`` footprint.
        near_goal: Whether the robot is near the end of the local path.
        sums: ``(blocks, samples)``, updated.
    """
    own, width, hits = tuning.CostCritic, sums.shape[1], 0
    threshold = footprint_threshold(own.consider_footprint, tuning.circumscribed_cost)
    for b in range(sums.shape[0]):
        count = min(width, tuning.batch_size - b * width)
        chosen = np.flatnonzero(sums[b, :count] >= MARKED)
        if own.consider_footprint and len(chosen) > 0:
            value = np.zeros((2, len(chosen)), dtype=np.float32)
            hit = _walk(
                call, tuning.model_dt, rollout, chosen + b * width,
                costs, corners, own, tuning.ObstaclesCritic, -1.0, (near_goal, threshold), value,
            )  # fmt: skip
            for j in range(len(chosen)):
                sums[b, chosen[j]] = value[0, j]
            hits += hit.sum()
        else:
            for k in chosen:
                sums[b, k] = own.collision_cost
            hits += len(chosen)
    return hits


@kernel
def score_obstacles(tuning, call, rollout, costs, corners, near_goal, scores):
    """Write the weighted sum of the Obstacles critic's two terms; return how many trajectories collide.

    Arguments as in :func:`score_cost`.
    """
    own, width, hits = tuning.ObstaclesCritic, scores.shape[1], 0
    threshold = footprint_threshold(own.consider_footprint, tuning.circumscribed_cost)
    per_step = np.float32(own.repulsion_weight / tuning.time_steps)
    for b in range(scores.shape[0]):
        count = min(width, tuning.batch_size - b * width)
        sums = np.zeros((2, count), dtype=np.float32)
        hit = _walk(
            call, tuning.model_dt, rollout, np.arange(count) + b * width,
            costs, corners, tuning.CostCritic, own, tuning.inscribed_radius, (near_goal, threshold), sums,
        )  # fmt: skip
        for k in range(count):
            scores[b, k] = np.float32(own.critical_weight) * sums[1, k] + per_step * sums[0, k]
        hits += hit.sum()
    return hits
