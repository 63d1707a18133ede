"""Scores that follow single trajectories point by point, exactly as Nav2's critics do.

Slower than a sweep over all samples, and needed for few: those that pass within rounding of a cell border, those
whose footprint has to be looked at, and the whole batch for the Obstacles critic. The chosen samples are rolled
out again by the same kernels, so their points are the same to the last bit.
"""

from __future__ import annotations

import math

import numpy as np

from controllers.mppi.kernels.rollout import YAW, X, Y, start, step
from gym_mapbench.kernels.footprint import footprint_cost
from gym_mapbench.kernels.geometry import cell_index
from gym_mapbench.kernels.jit import kernel

INSCRIBED, LETHAL, NO_INFORMATION = 253, 254, 255

# Within so many fixed-point units of a cell border, the point may lie on either side of it.
DOUBTFUL = 4


@kernel
def pick(noise, chosen, out):
    """Copy the noise of the ``chosen`` samples, ``(time_steps, len(chosen))``; columns beyond them become 0."""
    samples = noise.shape[2]
    for t in range(out.shape[0]):
        for j in range(out.shape[1]):
            k = chosen[j] if j < len(chosen) else -1
            out[t, j] = noise[k // samples, t, k % samples] if k >= 0 else np.float32(0.0)


@kernel
def centre_cost(costs, place, x, y):
    """Cost of the cell under a point; 255 off the map."""
    resolution, origin_x, origin_y = place
    rows, cols = costs.shape
    cell = cell_index(x, y, origin_x, origin_y, resolution, rows, cols)
    return NO_INFORMATION if cell < 0 else int(costs[cell // cols, cell % cols])


@kernel
def outline_cost(costs, place, corners, x, y, yaw):
    """Largest cost under the outline of the footprint at a pose; 254 if it reaches off the map."""
    resolution, origin_x, origin_y = place
    return int(footprint_cost(costs, resolution, origin_x, origin_y, x, y, yaw, corners))


@kernel
def collides(cost, unknown_is_free, inscribed_is_free):
    """Whether a cost value means contact."""
    if cost == NO_INFORMATION:
        return not unknown_is_free
    return cost == LETHAL or (cost == INSCRIBED and not inscribed_is_free)


@kernel
def _walk_cost_row(rows, x_0, y_0, costs, place, corners, threshold, free, near_goal, critical_cost, value, hit):
    for j in range(len(value)):
        if hit[j]:
            continue
        x, y = np.float64(np.float32(x_0 + rows[X, j])), np.float64(np.float32(y_0 + rows[Y, j]))
        centre = centre_cost(costs, place, x, y)
        if centre < 1:
            continue
        worst = centre
        if centre >= threshold:
            worst = outline_cost(costs, place, corners, x, y, np.float64(rows[YAW, j]))
        if collides(worst, free[0], free[1]):
            hit[j] = True
        elif centre >= INSCRIBED:
            value[j] += critical_cost
        elif not near_goal:
            value[j] += np.float32(centre)


@kernel
def walk_cost(
    noise_v, noise_w, v, w, state, dt, refresh_every, rows,
    costs, place, corners, threshold, free, near_goal, critical_cost, value, hit,
):  # fmt: skip
    """Sum up the Cost critic's points of a few samples, until each ends or collides.

    Args:
        noise_v, noise_w: ``(time_steps, samples)`` noise of the chosen samples.
        v, w: ``(time_steps,)`` control sequence.
        state: ``(x, y, yaw, v, w)`` at the start.
        dt: Period, s.
        refresh_every: Steps between two evaluations of sine and cosine, the same as in the sweep.
        rows: ``(7, samples)`` scratch.
        costs: ``(rows, cols)`` uint8 costmap.
        place: ``(resolution, origin_x, origin_y)`` of the costmap.
        corners: ``(n, 2)`` footprint.
        threshold: Cost of the centre from which on the outline is looked at; 256 for never.
        free: Whether unknown and whether inscribed cells are no collision.
        near_goal: Whether cells below the inscribed cost are left out.
        critical_cost: What an inscribed cell adds.
        value, hit: ``(samples,)`` float32 sum and whether it collided; set to 0 and False before.
    """
    yaw_0, v_0, w_0 = np.float32(state[2]), np.float32(state[3]), np.float32(state[4])
    period, critical = np.float32(dt), np.float32(critical_cost)
    start(rows, v_0, w_0, yaw_0, period)
    for t in range(noise_v.shape[0]):
        if t > 0:
            step(rows, noise_v, noise_w, t - 1, v[t - 1], w[t - 1], yaw_0, period, t % refresh_every == 0)
        _walk_cost_row(
            rows, state[0], state[1], costs, place, corners, threshold, free, near_goal, critical, value, hit
        )


@kernel
def _walk_obstacles_row(
    rows, x_0, y_0, costs, place, corners, threshold, free, near_goal, layer, collision_cost, repulsion, critical, hit
):
    decay, inflation_radius, inscribed_radius, margin = layer
    for j in range(len(hit)):
        if hit[j]:
            continue
        x, y = np.float64(np.float32(x_0 + rows[X, j])), np.float64(np.float32(y_0 + rows[Y, j]))
        cost = centre_cost(costs, place, x, y)
        by_footprint = cost >= threshold
        if by_footprint:
            cost = outline_cost(costs, place, corners, x, y, np.float64(rows[YAW, j]))
        if cost < 1:
            continue
        if collides(cost, free[0], free[1]):
            hit[j] = True
            critical[j] = collision_cost
            continue
        distance = (math.log(253.0) - math.log(cost)) / decay + (inscribed_radius if by_footprint else 0.0)
        if distance < margin:
            critical[j] += np.float32(margin - distance)
        elif not near_goal:
            repulsion[j] += np.float32(inflation_radius - distance)


@kernel
def walk_obstacles(
    noise_v, noise_w, v, w, state, dt, refresh_every, rows,
    costs, place, corners, threshold, free, near_goal, layer, collision_cost, repulsion, critical, hit,
):  # fmt: skip
    """Sum up the Obstacles critic's two terms.

    Args:
        noise_v, noise_w, v, w, state, dt, refresh_every, rows, costs, place, corners, threshold, free, near_goal:
            As in :func:`walk_cost`.
        layer: ``(cost_scaling_factor 1/m, inflation_radius m, inscribed radius m, collision margin m)``.
        collision_cost: What replaces the critical term on collision.
        repulsion, critical, hit: ``(samples,)`` results; set to 0, 0 and False before.
    """
    yaw_0, v_0, w_0 = np.float32(state[2]), np.float32(state[3]), np.float32(state[4])
    period, contact = np.float32(dt), np.float32(collision_cost)
    start(rows, v_0, w_0, yaw_0, period)
    for t in range(noise_v.shape[0]):
        if t > 0:
            step(rows, noise_v, noise_w, t - 1, v[t - 1], w[t - 1], yaw_0, period, t % refresh_every == 0)
        _walk_obstacles_row(
            rows, state[0], state[1], costs, place, corners, threshold, free, near_goal,
            layer, contact, repulsion, critical, hit,
        )  # fmt: skip


@kernel
def settle_sums(sums, doubt, samples, marked, collision_cost, look_closer, chosen):
    """Turn the sums of a sweep into values of the Cost critic.

    Args:
        sums: ``(blocks, samples)``, updated: a sum that contains a mark becomes ``collision_cost``.
        doubt: ``(blocks, samples)`` fixed-point units to the nearest cell border, plus 2.
        samples: How many samples count.
        marked: Sums from here on contain a mark.
        collision_cost: Value of a trajectory that collides.
        look_closer: Whether marks stand for points whose footprint decides.
        chosen: Indices of the samples to walk, written.

    Returns:
        How many samples were chosen, and how many of the others collide.
    """
    count, hits, width = 0, 0, sums.shape[1]
    for b in range(sums.shape[0]):
        for k in range(min(width, samples - b * width)):
            is_marked = sums[b, k] >= marked
            if doubt[b, k] <= DOUBTFUL or (is_marked and look_closer):
                chosen[count] = b * width + k
                count += 1
            elif is_marked:
                sums[b, k] = collision_cost
                hits += 1
    return count, hits
