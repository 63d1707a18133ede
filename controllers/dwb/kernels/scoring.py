"""Kernels of the critics: one raw score per candidate, ``ILLEGAL`` where it is known to be rejected.

Scores depend on the last pose of a trajectory only, unless the user asks for a sum or a product over all poses.
Whether a pose on the way is forbidden is checked in :mod:`controllers.dwb.kernels.verdict`, only for those candidates
on which the choice depends. ``twice`` says that the last pose counts twice in a sum or a product, as it does with
Nav2's ``include_last_point``. The arrays of the candidates are those of
:func:`~controllers.dwb.kernels.rollout.roll_out`.

Source: nav2_dwb_controller/dwb_critics.
"""

from __future__ import annotations

from controllers.dwb.kernels.rollout import advance
from gym_mapbench.kernels.footprint import critic_footprint_cost
from gym_mapbench.kernels.geometry import cell_index, normalize_angle
from gym_mapbench.kernels.jit import kernel

ILLEGAL = -1.0
INSCRIBED = 253
LETHAL = 254

LAST, SUM, PRODUCT = 0, 1, 2


@kernel
def last_obstacle_scores(cells, costs, scores):
    """BaseObstacle: cost of the last pose."""
    for i in range(len(cells)):
        cell = cells[i]
        cost = costs.flat[cell] if cell >= 0 else INSCRIBED
        scores[i] = cost if cost < INSCRIBED else ILLEGAL


@kernel
def summed_obstacle_scores(
    state, limits, sim_time, twists, steps, headings, cos, sin, costs, origin_x, origin_y, resolution, twice, scores
):
    """BaseObstacle with ``sum_scores``: cost of all poses."""
    rows, cols = costs.shape
    for i in range(len(steps)):
        dt, first = sim_time / steps[i], headings[i]
        v, x, y = state[3], state[0], state[1]
        total, cost = 0.0, 0
        for k in range(steps[i] + 1):
            cell = cell_index(x, y, origin_x, origin_y, resolution, rows, cols)
            cost = costs.flat[cell] if cell >= 0 else INSCRIBED
            if cost >= INSCRIBED:
                break
            total += cost
            v, x, y = advance(v, x, y, twists[i, 0], limits, dt, cos[first + k], sin[first + k])
        scores[i] = total + cost * twice if cost < INSCRIBED else ILLEGAL


@kernel
def last_footprint_scores(steps, headings, ends, yaw, cells, costs, origin_x, origin_y, resolution, corners, scores):
    """ObstacleFootprint: cost under the outline of the last pose."""
    for i in range(len(steps)):
        cost = LETHAL
        if cells[i] >= 0:
            heading = yaw[headings[i] + steps[i]]
            cost = critic_footprint_cost(
                costs, resolution, origin_x, origin_y, ends[i, 0], ends[i, 1], heading, corners
            )
        scores[i] = cost if cost < LETHAL else ILLEGAL


@kernel
def summed_footprint_scores(
    state, limits, sim_time, twists, steps, headings, yaw, cos, sin, costs, origin_x, origin_y, resolution,
    corners, twice, scores,
):  # fmt: skip
    """ObstacleFootprint with ``sum_scores``: cost under the outlines of all poses."""
    for i in range(len(steps)):
        dt, first = sim_time / steps[i], headings[i]
        v, x, y = state[3], state[0], state[1]
        total, cost = 0.0, 0
        for k in range(steps[i] + 1):
            cost = critic_footprint_cost(costs, resolution, origin_x, origin_y, x, y, yaw[first + k], corners)
            if cost >= LETHAL:
                break
            total += cost
            v, x, y = advance(v, x, y, twists[i, 0], limits, dt, cos[first + k], sin[first + k])
        scores[i] = total + cost * twice if cost < LETHAL else ILLEGAL


@kernel
def last_grid_scores(cells, distances, skipped, scores):
    """A map-grid critic: value of the field at the given cells; ``skipped`` cells of the map come before it."""
    for i in range(len(cells)):
        scores[i] = float(distances[cells[i] - skipped]) if cells[i] >= 0 else ILLEGAL


@kernel
def accumulate(score, value, aggregation):
    """Add the value of one more pose to a score, or multiply by it."""
    return score + value if aggregation == SUM else score * value


@kernel
def aggregated_grid_scores(
    state, limits, sim_time, twists, steps, headings, cos, sin, forward, distances, skipped, shape,
    origin_x, origin_y, resolution, aggregation, twice, scores,
):  # fmt: skip
    """A map-grid critic that sums or multiplies the values at the points ``forward`` of all poses."""
    for i in range(len(steps)):
        dt, first = sim_time / steps[i], headings[i]
        v, x, y = state[3], state[0], state[1]
        score, value = (1.0 if aggregation == PRODUCT else 0.0), 0.0
        for k in range(steps[i] + 1):
            ahead_x, ahead_y = x + forward * cos[first + k], y + forward * sin[first + k]
            cell = cell_index(ahead_x, ahead_y, origin_x, origin_y, resolution, shape[0], shape[1])
            value = float(distances[cell - skipped]) if cell >= 0 else ILLEGAL
            if value < 0.0:
                break
            score = accumulate(score, value, aggregation)
            v, x, y = advance(v, x, y, twists[i, 0], limits, dt, cos[first + k], sin[first + k])
        if twice and value >= 0.0:
            score = accumulate(score, value, aggregation)
        scores[i] = score if value >= 0.0 else ILLEGAL


@kernel
def rotation_errors(steps, headings, yaw, sim_time, lookahead_time, goal_yaw, errors):
    """Write the heading errors at the end of every trajectory, or at ``lookahead_time`` if that is not negative."""
    for i in range(len(steps)):
        first, count = headings[i], steps[i]
        end = yaw[first + count]
        if 0.0 <= lookahead_time < sim_time:
            at = lookahead_time * count / sim_time
            k = min(int(at), count - 1)
            end = yaw[first + k] * (1.0 - (at - k)) + yaw[first + k + 1] * (at - k)
        errors[i] = abs(normalize_angle(goal_yaw - end))
