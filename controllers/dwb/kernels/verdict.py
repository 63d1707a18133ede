"""Kernels that weigh the scores, check what lies on the way, and choose.

``raw`` is ``(critics, n)``: raw scores, 0 throughout for a critic of scale 0; ``scales`` ``(critics,)`` float32.
``critics`` say from which cost under the robot's centre they reject, and whether they also reject a pose whose outline
touches an obstacle; one of scale 0 rejects nothing. The other arguments are those of
:mod:`controllers.dwb.kernels.critics`.

Source: nav2_dwb_controller/dwb_core/src/dwb_local_planner.cpp (scoreTrajectory, coreScoringAlgorithm).
"""

from __future__ import annotations

import numpy as np

from controllers.dwb.kernels.rollout import advance
from controllers.dwb.kernels.scoring import ILLEGAL, LETHAL
from gym_mapbench.kernels.footprint import critic_footprint_cost
from gym_mapbench.kernels.geometry import cell_index
from gym_mapbench.kernels.jit import inlined, kernel

OFF_MAP = 256
NO_LIMIT = 257


@inlined
def add_scores(raw, scale, totals):
    """Add the weighed scores of one critic; Nav2 rounds the total to float32 each time."""
    for i in range(len(totals)):
        totals[i] = np.float32(totals[i] + raw[i] * scale)


@inlined
def blame(raw, critic, illegal_by):
    """Write the index of this critic for the candidates that it is the first to reject."""
    for i in range(len(raw)):
        if raw[i] < 0.0 and illegal_by[i] < 0:
            illegal_by[i] = critic


@kernel
def weigh(raw, scales, totals, illegal_by):
    """Write the totals, and the first critic known to reject each candidate, -1 if none is known."""
    totals[:] = 0.0
    illegal_by[:] = -1
    for c in range(len(scales)):
        add_scores(raw[c], scales[c], totals)
        blame(raw[c], c, illegal_by)


@inlined
def dearest_cell(i, tuning, robot, candidates, place):
    """Largest cost under the way of candidate ``i``, ``OFF_MAP`` if it leaves the map."""
    costs, origin_x, origin_y, resolution = place
    _, twists, steps, headings, _, _, cos, sin, _ = candidates
    rows, cols = costs.shape
    dt, first = tuning.sim_time / steps[i], headings[i]
    v, x, y = robot[3], robot[0], robot[1]
    dearest = 0
    for k in range(steps[i] + 1):
        cell = cell_index(x, y, origin_x, origin_y, resolution, rows, cols)
        if cell < 0:
            return OFF_MAP
        dearest = max(dearest, costs.flat[cell])
        v, x, y = advance(v, x, y, twists[i, 0], tuning.limits, dt, cos[first + k], sin[first + k])
    return dearest


@inlined
def outline_touches(i, tuning, robot, candidates, place, corners):
    """Whether the outline touches an obstacle, the unknown or the map's border on the way of candidate ``i``."""
    costs, origin_x, origin_y, resolution = place
    _, twists, steps, headings, _, yaw, cos, sin, _ = candidates
    dt, first = tuning.sim_time / steps[i], headings[i]
    v, x, y = robot[3], robot[0], robot[1]
    for k in range(steps[i] + 1):
        if critic_footprint_cost(costs, resolution, origin_x, origin_y, x, y, yaw[first + k], corners) >= LETHAL:
            return True
        v, x, y = advance(v, x, y, twists[i, 0], tuning.limits, dt, cos[first + k], sin[first + k])
    return False


@kernel
def rejected_by(i, raw, scales, critics, tuning, robot, candidates, place, corners):
    """First critic that rejects candidate ``i``, -1 if none does."""
    dearest = dearest_cell(i, tuning, robot, candidates, place)
    for c in range(len(raw)):
        if scales[c] == 0.0:
            continue
        if raw[c, i] < 0.0 or dearest >= critics[c].forbidden:
            return c
        if critics[c].outline and outline_touches(i, tuning, robot, candidates, place, corners):
            return c
    return -1


@inlined
def cheapest(totals, illegal_by):
    """First candidate of smallest total among those not known to be illegal, -1 without any."""
    best = -1
    for i in range(len(totals)):
        if illegal_by[i] < 0 and (best < 0 or totals[i] < totals[best]):
            best = i
    return best


@inlined
def strike_out(raw, totals, illegal_by):
    """Overwrite the scores of illegal candidates, as Nav2 records them."""
    for i in range(len(totals)):
        if illegal_by[i] >= 0:
            raw[:, i] = ILLEGAL
            totals[i] = ILLEGAL


@kernel
def judge(raw, scales, critics, tuning, robot, candidates, place, corners, totals, illegal_by, drives):
    """Return the cheapest legal candidate, -1 without any.

    Where one is found that ``drives``, that is all. Otherwise the totals of all candidates are written, and the first
    critic that rejects each, -1 for none.
    """
    weigh(raw, scales, totals, illegal_by)
    best = cheapest(totals, illegal_by)
    if drives:
        # What lies on the way only rejects candidates and adds no score, so it can be checked last: for the cheapest
        # candidate first, then for the next, until one is legal.
        while best >= 0:
            illegal_by[best] = rejected_by(
                np.int64(best), raw, scales, critics, tuning, robot, candidates, place, corners
            )
            if illegal_by[best] < 0:
                return best
            best = cheapest(totals, illegal_by)
    for i in range(len(totals)):
        illegal_by[i] = rejected_by(i, raw, scales, critics, tuning, robot, candidates, place, corners)
    strike_out(raw, totals, illegal_by)
    return cheapest(totals, illegal_by)
