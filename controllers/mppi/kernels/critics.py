"""Which critics apply to a call, and the scores for which the sweep has collected enough.

Source: nav2_mppi_controller/src/critics (Humble, Jazzy and Lyrical). A critic adds ``(factor * scores)^cost_power`` to
the costs; its scores are a row of what is collected per sample. Critics that need a pass of their own over the
trajectories are only chosen here; the optimizer calls them by their row.
"""

from __future__ import annotations

import math

import numpy as np

from controllers.mppi.kernels.align import too_many_invalid
from controllers.mppi.kernels.controls import (
    ALIGNED,
    ANGLE,
    BEARINGS,
    CELLS,
    CLOSENESS,
    DEADBANDS,
    DISTANCE,
    EXCESS,
    FEASIBLE,
    FOLLOWED,
    REVERSE,
    TURNING,
)
from controllers.mppi.kernels.lengths import furthest_within_length
from controllers.mppi.kernels.path import furthest_reached, nearest_point, score_follow
from controllers.mppi.kernels.window import MARKED
from gym_mapbench.kernels.geometry import normalize_angle
from gym_mapbench.kernels.jit import kernel

# Critic -> row of what is collected for it.
CRITICS = {
    "ConstraintCritic": EXCESS,
    "CostCritic": CELLS,
    "ObstaclesCritic": CLOSENESS,
    "GoalCritic": DISTANCE,
    "GoalAngleCritic": ANGLE,
    "PathAlignCritic": ALIGNED,
    "PathFollowCritic": FOLLOWED,
    "PathAngleCritic": BEARINGS,
    "PreferForwardCritic": REVERSE,
    "TwirlingCritic": TURNING,
    "VelocityDeadbandCritic": DEADBANDS,
}


@kernel
def near(call, distance):
    """Whether the robot is nearer than ``distance`` (m) to the goal."""
    return call.squared_distance < distance * distance


@kernel
def is_near(row, tuning, call):
    """Whether the robot is near the goal, by the measure of one critic."""
    distance = 0.0
    if row == DISTANCE:
        distance = tuning.GoalCritic.threshold_to_consider
    elif row == ANGLE:
        distance = tuning.GoalAngleCritic.threshold_to_consider
    elif row == ALIGNED:
        distance = tuning.PathAlignCritic.threshold_to_consider
    elif row == FOLLOWED:
        distance = tuning.PathFollowCritic.threshold_to_consider
    elif row == BEARINGS:
        distance = tuning.PathAngleCritic.threshold_to_consider
    elif row == REVERSE:
        distance = tuning.PreferForwardCritic.threshold_to_consider
    elif row == TURNING:
        distance = tuning.xy_goal_tolerance
    at_it = tuning.lyrical and row in (DISTANCE, ANGLE) and call.squared_distance == distance * distance
    return at_it or near(call, distance)


@kernel
def _settle_cells(tuning, collected):
    """Replace the sums of colliding trajectories by the collision cost; return how many there are."""
    hits, samples = 0, collected.shape[2]
    for b in range(collected.shape[1]):
        for k in range(min(samples, tuning.batch_size - b * samples)):
            if collected[CELLS, b, k] >= MARKED:
                collected[CELLS, b, k] = tuning.CostCritic.collision_cost
                hits += 1
    return hits


@kernel
def _choose_rows(tuning, call, rows, collected):
    """Drop the critics that do not apply near the goal, or away from it, and those after one that all samples fail."""
    failed = call.failed
    for i in range(len(rows)):
        row = rows[i]
        wants_near = row in (DISTANCE, ANGLE)
        if failed or is_near(row, tuning, call) != wants_near:
            rows[i] = -1
        elif row == CELLS:
            failed = _settle_cells(tuning, collected) == tuning.batch_size
        elif row == CLOSENESS:
            failed = call.obstacle_hits == tuning.batch_size
    call.failed = failed


@kernel
def _furthest(tuning, path, speeds, kept):
    """Index of the furthest path point that any trajectory reaches."""
    last = kept.shape[1] - 1
    x, y = kept[0, last], kept[1, last]
    if tuning.lyrical:
        return furthest_within_length(path[0], path[1], x, y, speeds, np.float32(tuning.model_dt), tuning.batch_size)
    return furthest_reached(path[0], path[1], x, y, tuning.batch_size, tuning.jazzy)


@kernel
def _can_align(tuning, call, path, valid, kept):
    """Whether enough of the path is reached, and enough of it is free, for PathAlign."""
    own, furthest = tuning.PathAlignCritic, call.furthest
    if furthest < max(own.offset_from_furthest, 1):
        return False
    first = 0 if tuning.jazzy else nearest_point(path[0], path[1], kept[0, 0, 0, 0], kept[1, 0, 0, 0])
    return not too_many_invalid(valid, first, furthest, np.float32(own.max_path_occupancy_ratio))


@kernel
def _looks_away(tuning, call, path):
    """Whether the robot faces away from a path point ahead, which is written to the call as its target."""
    own = tuning.PathAngleCritic
    target = min(call.furthest + own.offset_from_furthest, path.shape[1] - 1)
    call.target_x, call.target_y = path[0, target] - call.x, path[1, target] - call.y
    call.target_yaw = path[2, target]
    bearing = math.atan2(call.target_y, call.target_x)
    if own.mode == FEASIBLE and abs(normalize_angle(call.target_yaw - bearing)) > math.pi / 2:
        bearing += math.pi
    angle = abs(normalize_angle(call.yaw - bearing))
    return (min(angle, math.pi - angle) if tuning.either_way else angle) >= own.max_angle_to_furthest


@kernel
def _follow(tuning, call, path, valid, kept, scores):
    """Score the distance of the last points from a free path point ahead."""
    points, last = path.shape[1], kept.shape[1] - 1
    target = min(call.furthest + tuning.PathFollowCritic.offset_from_furthest, points - 1)
    while target < points - 2 and not valid[target]:
        target += 1
    score_follow(kept[0, last], kept[1, last], path[0, target], path[1, target], scores)


@kernel
def judge(tuning_of, call_of, critics, path, valid, speeds, kept, collected):
    """Find out which critics apply, and score those for which the sweep has collected enough.

    Args:
        tuning_of: ``(1,)`` record of the parameters.
        call_of: ``(1,)`` record of the call; ``failed``, ``furthest`` and ``target`` are written.
        critics: ``(critics,)`` rows of the critics, in their order.
        path: ``(3, points)`` local path, float32.
        valid: ``(points,)`` whether each point of the path is free.
        speeds: ``(blocks, time_steps, samples)`` sampled speeds, m/s; only Lyrical's measure their lengths.
        kept: Points kept by the sweep.
        collected: ``(rows, blocks, samples)`` what the sweep collected; rows CELLS and FOLLOWED are written.

    Returns:
        The rows again, -1 for critics that do not apply.
    """
    tuning, call, rows = tuning_of[0], call_of[0], critics.copy()
    _choose_rows(tuning, call, rows, collected)
    for i in range(len(rows)):
        row = rows[i]
        if row == FOLLOWED and path.shape[1] < 2:
            rows[i] = row = -1
        if row not in (ALIGNED, FOLLOWED, BEARINGS):
            continue
        if call.furthest < 0:
            call.furthest = _furthest(tuning, path, speeds, kept)
        if row == FOLLOWED:
            _follow(tuning, call, path, valid, kept, collected[FOLLOWED])
        elif not (_looks_away(tuning, call, path) if row == BEARINGS else _can_align(tuning, call, path, valid, kept)):
            rows[i] = -1
    return rows
