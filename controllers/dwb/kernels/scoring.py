"""Kernels of the critics: one raw score per candidate, ``ILLEGAL`` where the critic rejects it.

Candidate ``i`` has ``steps[i] + 1`` poses; ``places[i]`` says where they lie in the flat arrays (see
:func:`controllers.dwb.kernels.sampling.lay_out`). ``twice`` says that the last pose counts twice, as Nav2's
``include_last_point`` has it.

Source: nav2_dwb_controller/dwb_critics and dwb_core/src/dwb_local_planner.cpp (scoreTrajectory).
"""

from __future__ import annotations

import numpy as np

from controllers.dwb.kernels.rollout import OFF_MAP
from gym_mapbench.kernels.footprint import footprint_cost
from gym_mapbench.kernels.geometry import cell_index, normalize_angle
from gym_mapbench.kernels.jit import kernel

ILLEGAL = -1.0
INSCRIBED = 253
LETHAL = 254

LAST, SUM, PRODUCT = 0, 1, 2


@kernel
def obstacle_scores(steps, places, cells, costs, worst, sum_scores, twice, scores):
    """BaseObstacle: cost of the last pose, or of all; illegal from the inscribed cost on."""
    flat = costs.ravel()
    for i in range(len(steps)):
        if worst[i] >= INSCRIBED:
            scores[i] = ILLEGAL
            continue
        place, width = places[i, 0], places[i, 1]
        last = flat[cells[place + steps[i] * width]]
        score = float(last)
        if sum_scores:
            for k in range(steps[i]):
                score += flat[cells[place + k * width]]
            score += last * twice
        scores[i] = score


@kernel
def footprint_scores(
    steps, places, x, y, yaw, worst, costs, origin_x, origin_y, resolution, corners, sum_scores, twice, scores
):
    """ObstacleFootprint: cost under the outline of the last pose, or of all; illegal where it touches an obstacle."""
    for i in range(len(steps)):
        scores[i] = ILLEGAL
        if worst[i] == OFF_MAP:
            continue
        place, width, heading = places[i, 0], places[i, 1], places[i, 2]
        total, cost = 0.0, 0
        for k in range(steps[i] + 1):
            pose = place + k * width
            cost = footprint_cost(costs, resolution, origin_x, origin_y, x[pose], y[pose], yaw[heading + k], corners)
            if cost >= LETHAL:
                break
            total += cost
        if cost < LETHAL:
            scores[i] = total + cost * twice if sum_scores else cost


@kernel
def grid_value(x, y, distances, first_row, rows, origin_x, origin_y, resolution):
    """Value of the field at a point, ``ILLEGAL`` off the map."""
    cols = distances.shape[1]
    cell = cell_index(x, y, origin_x, origin_y, resolution, rows, cols)
    return ILLEGAL if cell < 0 else float(distances.ravel()[cell - first_row * cols])


@kernel
def accumulate(score, value, aggregation):
    """Add the value of one more pose to a score, or multiply by it; a product that is 0 stays so."""
    if aggregation == SUM:
        return score + value
    return score * value if score > 0.0 else score


@kernel
def map_grid_scores(
    steps, places, x, y, cos, sin, forward, distances, first_row, rows, origin_x, origin_y, resolution,
    aggregation, twice, scores,
):  # fmt: skip
    """The map-grid critics: field value at the point ``forward`` of the last pose, or aggregated over all poses."""
    for i in range(len(steps)):
        place, width, heading = places[i, 0], places[i, 1], places[i, 2]
        score, value = (1.0 if aggregation == PRODUCT else 0.0), 0.0
        for k in range(steps[i] if aggregation == LAST else 0, steps[i] + 1):
            pose, turn = place + k * width, heading + k
            value = grid_value(
                x[pose] + forward * cos[turn], y[pose] + forward * sin[turn],
                distances, first_row, rows, origin_x, origin_y, resolution,
            )  # fmt: skip
            if value < 0.0:
                break
            score = value if aggregation == LAST else accumulate(score, value, aggregation)
        if value >= 0.0 and twice and aggregation != LAST:
            score = accumulate(score, value, aggregation)
        scores[i] = ILLEGAL if value < 0.0 else score


@kernel
def reject_off_map(worst, scores):
    """Reject the trajectories that leave the map."""
    for i in range(len(worst)):
        if worst[i] == OFF_MAP:
            scores[i] = ILLEGAL


@kernel
def rotation_errors(steps, places, yaw, sim_time, lookahead_time, goal_yaw, errors):
    """Write the heading errors at the end of every trajectory, or at ``lookahead_time`` if that is not negative."""
    for i in range(len(steps)):
        heading, count = places[i, 2], steps[i]
        end = yaw[heading + count]
        if 0.0 <= lookahead_time < sim_time:
            at = lookahead_time * count / sim_time
            k = min(int(at), count - 1)
            end = yaw[heading + k] * (1.0 - (at - k)) + yaw[heading + k + 1] * (at - k)
        errors[i] = abs(normalize_angle(goal_yaw - end))


@kernel
def add_scores(raw, scale, totals):
    """Add the weighed scores of one critic."""
    for i in range(len(totals)):
        totals[i] = np.float32(totals[i] + raw[i] * scale)


@kernel
def blame(raw, critic, illegal_by):
    """Note which candidates this critic is the first to reject."""
    for i in range(len(raw)):
        if raw[i] < 0.0 and illegal_by[i] < 0:
            illegal_by[i] = critic


@kernel
def pick(raw, totals, illegal_by):
    """Overwrite the scores of illegal candidates; return the first legal one of smallest total, -1 without any."""
    best = -1
    for i in range(len(totals)):
        if illegal_by[i] >= 0:
            raw[:, i] = ILLEGAL
            totals[i] = ILLEGAL
        elif best < 0 or totals[i] < totals[best]:
            best = i
    return best


@kernel
def total_scores(raw, scales, totals, illegal_by):
    """Weigh and add the raw scores as Nav2 does: the total is rounded to float32 after every critic.

    Args:
        raw: ``(critics, n)``; the column of an illegal candidate is overwritten with ``ILLEGAL``.
        scales: ``(critics,)`` float32; a critic of scale 0 does not judge.
        totals: Written: ``(n,)`` float32, -1 for an illegal candidate.
        illegal_by: Written: ``(n,)`` index of the first critic that rejects it, -1 if none does.

    Returns:
        Index of the candidate to choose, -1 if all are illegal.
    """
    totals[:] = 0.0
    illegal_by[:] = -1
    for c in range(len(scales)):
        if scales[c] != 0.0:
            add_scores(raw[c], scales[c], totals)
            blame(raw[c], c, illegal_by)
    return pick(raw, totals, illegal_by)
