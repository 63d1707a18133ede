"""Scores that follow single trajectories point by point, as Nav2's critics do.

This is slower than a sweep over all samples. It is needed for the few samples whose footprint has to be checked, and
for the whole batch if the Obstacles critic is enabled. The samples are rolled out again by the same arithmetic, so
their points are the same to the last bit.
"""

from __future__ import annotations

import math

import numpy as np

from controllers.mppi.kernels.controls import CELLS, CLOSENESS
from controllers.mppi.kernels.elementary import ZERO
from controllers.mppi.kernels.rollout import first_state, next_state
from controllers.mppi.kernels.window import INSCRIBED, LETHAL, MARKED
from gym_mapbench.kernels.footprint import footprint_cost
from gym_mapbench.kernels.geometry import cell_index
from gym_mapbench.kernels.jit import kernel

NO_INFORMATION = 255
NEVER = 256.0


@kernel
def footprint_threshold(consider_footprint, circumscribed_cost):
    """Cost of the centre from which on the outline of the footprint is checked."""
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
def _centre_cost(costs, call, x, y, single):
    """Cost of the cell under a point, 255 off the map, and whether it is on it; ``single``: found in float32."""
    rows, cols = costs.shape
    if single:
        place = np.float32(call.origin_x), np.float32(call.origin_y), np.float32(call.resolution)
        cell = cell_index(np.float32(x), np.float32(y), *place, rows, cols)
    else:
        cell = cell_index(x, y, call.origin_x, call.origin_y, call.resolution, rows, cols)
    return (NO_INFORMATION, False) if cell < 0 else (int(costs[cell // cols, cell % cols]), True)


@kernel
def _outline_cost(costs, call, corners, x, y, yaw):
    """Largest cost under the outline of the footprint at a pose; 254 if it reaches off the map."""
    return int(footprint_cost(costs, call.resolution, call.origin_x, call.origin_y, x, y, yaw, corners))


@kernel
def _first(call, dt):
    """State of every sample at step 0."""
    return first_state(call, np.float32(dt))


@kernel
def _next(state, call, dt, rollout, b, k, t):
    """State of sample ``k`` of block ``b`` at step ``t``, from the one before."""
    refresh_every, noise_v, noise_w, v, w = rollout
    speed, turn = v[t - 1] + noise_v[b, t - 1, k], w[t - 1] + noise_w[b, t - 1, k]
    return next_state(state, speed, turn, np.float32(call.base_yaw), np.float32(dt), t % refresh_every == 0)


@kernel
def _pose(state, call):
    """Pose of a sample as Nav2 rounds it."""
    x, y = np.float32(call.base_x + state[0]), np.float32(call.base_y + state[1])
    return np.float64(x), np.float64(y), np.float64(state[2] + np.float32(call.base_yaw))


@kernel
def _cost_along(call, dt, rollout, b, k, costs, corners, own, looks, near_goal, threshold, single):
    """Sum of the Cost critic along one trajectory; MARKED if it collides."""
    value, state, every = ZERO, _first(call, dt), own.trajectory_point_step
    for t in range((looks - 1) * every + 1):
        if t > 0:
            state = _next(state, call, dt, rollout, b, k, t)
        if t % every != 0:
            continue
        x, y, yaw = _pose(state, call)
        cost, _ = _centre_cost(costs, call, x, y, single)
        if cost < 1:
            continue
        worst = _outline_cost(costs, call, corners, x, y, yaw) if cost >= threshold else cost
        if collides(worst, call.unknown_is_free, own.consider_footprint):
            return MARKED
        if cost >= own.near_collision_cost:
            value += np.float32(own.critical_cost)
        elif not near_goal:
            value += np.float32(cost)
    return value


@kernel
def _closeness_along(call, dt, rollout, b, k, costs, corners, own, near_goal, threshold, inscribed_radius, both):
    """Both sums of the Obstacles critic along one trajectory, and whether it collides.

    ``both`` says whether a point within the margin repels as well. A point off the map is of unknown cost, and its
    outline is not checked; Cost's is.
    """
    repulsion, critical, state = ZERO, ZERO, _first(call, dt)
    for t in range(len(rollout[3])):
        if t > 0:
            state = _next(state, call, dt, rollout, b, k, t)
        x, y, yaw = _pose(state, call)
        cost, on_map = _centre_cost(costs, call, x, y, False)
        by_footprint = on_map and cost >= threshold
        if by_footprint:
            cost = _outline_cost(costs, call, corners, x, y, yaw)
        if cost < 1:
            continue
        if collides(cost, call.unknown_is_free, own.consider_footprint):
            return repulsion, np.float32(own.collision_cost), True
        if own.cost_scaling_factor == 0.0 or own.inflation_radius == 0.0:
            continue
        distance = (math.log(253.0) - math.log(cost)) / own.cost_scaling_factor
        distance += inscribed_radius if by_footprint else 0.0
        if distance < own.collision_margin_distance:
            critical += np.float32(own.collision_margin_distance - distance)
        if not near_goal and (both or distance >= own.collision_margin_distance):
            repulsion += np.float32(own.inflation_radius - distance)
    return repulsion, critical, False


@kernel
def walk_cost(tuning_of, call_of, rollout, costs, corners, near_goal, collected):
    """Check the footprints of the marked trajectories: sum up their points again, or mark them as colliding.

    Args:
        tuning_of: ``(1,)`` record of the parameters.
        call_of: ``(1,)`` record of the call.
        rollout: ``(refresh_every, noise_v, noise_w, v, w)``, as in the sweep.
        costs: ``(rows, cols)`` uint8 costmap.
        corners: ``(n, 2)`` footprint.
        near_goal: Whether the robot is near the goal.
        collected: ``(12, blocks, samples)``; row CELLS is updated.
    """
    tuning, call = tuning_of[0], call_of[0]
    own, width, sums = tuning.CostCritic, collected.shape[2], collected[CELLS]
    threshold = footprint_threshold(own.consider_footprint, tuning.circumscribed_cost)
    for b in range(len(sums)):
        for k in range(min(width, tuning.batch_size - b * width)):
            if sums[b, k] >= MARKED:
                sums[b, k] = _cost_along(
                    call, tuning.model_dt, rollout, b, k, costs, corners, own, tuning.looks, near_goal, threshold,
                    tuning.jazzy,
                )  # fmt: skip


@kernel
def walk_obstacles(tuning_of, call_of, rollout, costs, corners, near_goal, collected):
    """Write the weighted sum of the Obstacles critic's two terms, and into the call how many trajectories collide.

    Jazzy measures repulsion from that of the least repelled trajectory. Arguments as in :func:`walk_cost`; row
    CLOSENESS is written.
    """
    tuning, call = tuning_of[0], call_of[0]
    own, width = tuning.ObstaclesCritic, collected.shape[2]
    threshold = footprint_threshold(own.consider_footprint, tuning.circumscribed_cost)
    weight, gain = np.float32(own.critical_weight), np.float32(own.repulsion_weight / tuning.time_steps)
    repulsions, least = np.empty(collected.shape[1:], dtype=np.float32), np.float32(np.inf)
    call.obstacle_hits = 0
    for b in range(collected.shape[1]):
        for k in range(min(width, tuning.batch_size - b * width)):
            repulsion, critical, hit = _closeness_along(
                call, tuning.model_dt, rollout, b, k, costs, corners, own, near_goal, threshold,
                tuning.inscribed_radius, tuning.jazzy,
            )  # fmt: skip
            collected[CLOSENESS, b, k], repulsions[b, k] = critical, repulsion
            least = min(least, repulsion)
            call.obstacle_hits += 1 if hit else 0
    base = least if tuning.jazzy else ZERO
    for b in range(collected.shape[1]):
        for k in range(min(width, tuning.batch_size - b * width)):
            collected[CLOSENESS, b, k] = weight * collected[CLOSENESS, b, k] + gain * (repulsions[b, k] - base)
