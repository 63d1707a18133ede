"""Scores that follow single trajectories point by point, as Nav2's critics do.

Slower than a sweep over all samples, and needed for few: those whose footprint has to be looked at, and the whole
batch for the Obstacles critic. The chosen samples are rolled out again by the same kernels, so their points are the
same to the last bit.
"""

from __future__ import annotations

import math

import numpy as np

from controllers.mppi.kernels.controls import CELLS, CLOSENESS
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
def _pick(noise, b, chosen, out):
    """Copy the noise of the ``chosen`` samples of a block to ``(time_steps, len(chosen))``."""
    for t in range(out.shape[0]):
        for j in range(len(chosen)):
            out[t, j] = noise[b, t, chosen[j]]


@kernel
def _marked(sums, b, count):
    """Indices of the first ``count`` samples of a block whose sum contains a mark."""
    marked, found = np.empty(count, dtype=np.int64), 0
    for k in range(count):
        if sums[b, k] >= MARKED:
            marked[found] = k
            found += 1
    return marked[:found]


@kernel
def _walk(call, dt, rollout, chosen, b, costs, corners, cost, obstacles, radius, near, sums, hit):
    """Walk some samples for the Cost critic (``obstacles`` False) or the Obstacles critic.

    Args:
        call: The call.
        dt: Period, s.
        rollout: ``(refresh_every, noise_v, noise_w, v, w)``, as in the sweep.
        chosen: Indices of the samples in their block.
        b: The block.
        costs: ``(rows, cols)`` uint8 costmap.
        corners: ``(n, 2)`` footprint.
        cost: Parameters of the Cost critic.
        obstacles: Parameters of the Obstacles critic.
        radius: Inscribed radius, m; negative for the Cost critic.
        near: ``(near_goal, threshold)``: whether the robot is near the end of the local path, and the cost of the
            centre from which on the outline is looked at.
        sums: ``(2, len(chosen))`` results, 0 before: value, or repulsion and critical term.
        hit: ``(len(chosen),)`` whether each collided, written.
    """
    refresh_every, noise_v, noise_w, v, w = rollout
    count, steps = len(chosen), noise_v.shape[1]
    part_v, part_w = np.empty((steps, count), dtype=np.float32), np.empty((steps, count), dtype=np.float32)
    _pick(noise_v, b, chosen, part_v)
    _pick(noise_w, b, chosen, part_w)
    rows = np.empty((STATE_ROWS, count), dtype=np.float32)
    for j in range(count):
        hit[j] = False
    yaw_0, period = np.float32(call.yaw), np.float32(dt)
    start(rows, np.float32(call.v), np.float32(call.w), yaw_0, period)
    for t in range(steps):
        if t > 0:
            step(rows, part_v, part_w, t - 1, v[t - 1], w[t - 1], yaw_0, period, t % refresh_every == 0)
        if radius < 0.0:
            _add_costs(rows, call, costs, corners, cost, near[0], near[1], sums[0], hit)
        else:
            _add_distances(rows, call, costs, corners, obstacles, near[0], near[1], radius, sums[0], sums[1], hit)


@kernel
def walk_cost(tuning_of, call_of, rollout, costs, corners, near_goal, collected):
    """Look at the footprints of the marked trajectories: sum up their points anew, or mark them as colliding.

    Args:
        tuning_of: ``(1,)`` record of the parameters.
        call_of: ``(1,)`` record of the call.
        rollout: ``(refresh_every, noise_v, noise_w, v, w)``, as in the sweep.
        costs: ``(rows, cols)`` uint8 costmap.
        corners: ``(n, 2)`` footprint.
        near_goal: Whether the robot is near the end of the local path.
        collected: ``(12, blocks, samples)``; row CELLS is updated.
    """
    tuning, call = tuning_of[0], call_of[0]
    own, width, sums = tuning.CostCritic, collected.shape[2], collected[CELLS]
    threshold = footprint_threshold(own.consider_footprint, tuning.circumscribed_cost)
    for b in range(collected.shape[1]):
        chosen = _marked(sums, b, min(width, tuning.batch_size - b * width))
        value, hit = np.zeros((2, len(chosen)), dtype=np.float32), np.empty(len(chosen), dtype=np.bool_)
        _walk(
            call, tuning.model_dt, rollout, chosen, b, costs, corners,
            own, tuning.ObstaclesCritic, -1.0, (near_goal, threshold), value, hit,
        )  # fmt: skip
        for j in range(len(chosen)):
            sums[b, chosen[j]] = MARKED if hit[j] else value[0, j]


@kernel
def walk_obstacles(tuning_of, call_of, rollout, costs, corners, near_goal, collected):
    """Write the weighted sum of the Obstacles critic's two terms, and to the call how many trajectories collide.

    Arguments as in :func:`walk_cost`; row CLOSENESS is written.
    """
    tuning, call = tuning_of[0], call_of[0]
    own, width = tuning.ObstaclesCritic, collected.shape[2]
    threshold = footprint_threshold(own.consider_footprint, tuning.circumscribed_cost)
    critical, repulsion = np.float32(own.critical_weight), np.float32(own.repulsion_weight / tuning.time_steps)
    call.obstacle_hits = 0
    for b in range(collected.shape[1]):
        count = min(width, tuning.batch_size - b * width)
        sums, hit = np.zeros((2, count), dtype=np.float32), np.empty(count, dtype=np.bool_)
        _walk(
            call, tuning.model_dt, rollout, np.arange(count), b, costs, corners,
            tuning.CostCritic, own, tuning.inscribed_radius, (near_goal, threshold), sums, hit,
        )  # fmt: skip
        for k in range(count):
            collected[CLOSENESS, b, k] = critical * sums[1, k] + repulsion * sums[0, k]
            call.obstacle_hits += 1 if hit[k] else 0
