"""The critics, in the words of Nav2: each adds ``(weight * score)^cost_power`` to the costs, or nothing.

Source: nav2_mppi_controller/src/critics (Humble). ``tuning`` and ``call`` are records of
:mod:`controllers.mppi.records`; a critic's own parameters are a group of ``tuning``.
"""

from __future__ import annotations

import math

import numpy as np

from controllers.mppi.kernels.align import score_align, too_many_invalid
from controllers.mppi.kernels.controls import (
    ANGLE,
    CELLS,
    COLLECTED_ROWS,
    DISTANCE,
    EXCESS,
    REVERSE,
    SPARE,
    add_below,
    add_too_tight,
    add_turning,
)
from controllers.mppi.kernels.path import furthest_reached, nearest_point, score_follow
from controllers.mppi.kernels.points import BEARING, sweep
from controllers.mppi.kernels.walk import score_cost, score_obstacles
from gym_mapbench.kernels.geometry import normalize_angle
from gym_mapbench.kernels.jit import kernel

CRITICS = (
    "ConstraintCritic",
    "CostCritic",
    "ObstaclesCritic",
    "GoalCritic",
    "GoalAngleCritic",
    "PathAlignCritic",
    "PathFollowCritic",
    "PathAngleCritic",
    "PreferForwardCritic",
    "TwirlingCritic",
    "VelocityDeadbandCritic",
)
(
    CONSTRAINT, COST, OBSTACLES, GOAL, GOAL_ANGLE, PATH_ALIGN, PATH_FOLLOW, PATH_ANGLE, PREFER_FORWARD, TWIRLING, DEADBAND,
) = range(len(CRITICS))  # fmt: skip


@kernel
def near(call, distance):
    """Whether the robot is nearer than ``distance`` (m) to the end of the local path."""
    return call.squared_distance < distance * distance


@kernel
def asks_for(order, critic):
    """Whether a critic is among those in ``order``."""
    for each in order:
        if each == critic:
            return True
    return False


@kernel
def weight_of(critic, tuning):
    """Factor and power of a critic's score. Sums over the steps become means or integrals here."""
    mean, dt = 1.0 / tuning.time_steps, tuning.model_dt
    if critic == CONSTRAINT:
        return tuning.ConstraintCritic.cost_weight * dt, tuning.ConstraintCritic.cost_power
    if critic == COST:
        return tuning.CostCritic.cost_weight / 254.0 * mean, tuning.CostCritic.cost_power
    if critic == OBSTACLES:
        return 1.0, tuning.ObstaclesCritic.cost_power
    if critic == GOAL:
        return tuning.GoalCritic.cost_weight * mean, tuning.GoalCritic.cost_power
    if critic == GOAL_ANGLE:
        return tuning.GoalAngleCritic.cost_weight * mean, tuning.GoalAngleCritic.cost_power
    if critic == PATH_ALIGN:
        return tuning.PathAlignCritic.cost_weight, tuning.PathAlignCritic.cost_power
    if critic == PATH_FOLLOW:
        return tuning.PathFollowCritic.cost_weight, tuning.PathFollowCritic.cost_power
    if critic == PATH_ANGLE:
        return tuning.PathAngleCritic.cost_weight * mean, tuning.PathAngleCritic.cost_power
    if critic == PREFER_FORWARD:
        return tuning.PreferForwardCritic.cost_weight * dt, tuning.PreferForwardCritic.cost_power
    if critic == TWIRLING:
        return tuning.TwirlingCritic.cost_weight * mean, tuning.TwirlingCritic.cost_power
    return tuning.VelocityDeadbandCritic.cost_weight * dt, tuning.VelocityDeadbandCritic.cost_power


@kernel
def free_speeds(tuning):
    """Highest and lowest speed that Constraint lets pass; ``vy_max`` counts, for DiffDrive too (m/s)."""
    lowest = math.hypot(tuning.vx_min, tuning.vy_max)
    return math.hypot(tuning.vx_max, tuning.vy_max), lowest if tuning.vx_min > 0.0 else -lowest


@kernel
def find_furthest(tuning, call, path, kept):
    """Find the furthest path point a trajectory reaches, once per call."""
    if call.furthest < 0:
        last = kept.shape[1] - 1
        call.furthest = furthest_reached(path[0], path[1], kept[0, last], kept[1, last], tuning.batch_size)
    return call.furthest


@kernel
def score_path_follow(tuning, call, path, valid, kept, scores):
    """Distance of the last points from a path point ahead; returns whether it applies."""
    own, points = tuning.PathFollowCritic, path.shape[1]
    if points < 2 or near(call, own.threshold_to_consider):
        return False
    target = min(find_furthest(tuning, call, path, kept) + own.offset_from_furthest, points - 1)
    while target < points - 2 and not valid[target]:
        target += 1
    last = kept.shape[1] - 1
    score_follow(kept[0, last], kept[1, last], path[0, target], path[1, target], scores)
    return True


@kernel
def score_path_align(tuning, call, path, valid, kept, scores):
    """Mean distance from the path points as far along; returns whether it applies."""
    own = tuning.PathAlignCritic
    if near(call, own.threshold_to_consider):
        return False
    furthest = find_furthest(tuning, call, path, kept)
    if furthest < max(own.offset_from_furthest, 1):
        return False
    first = nearest_point(path[0], path[1], kept[0, 0, 0, 0], kept[1, 0, 0, 0])
    if too_many_invalid(valid, first, furthest, np.float32(own.max_path_occupancy_ratio)):
        return False
    steps = (tuning.time_steps + own.trajectory_point_step - 1) // own.trajectory_point_step
    score_align(path, valid, furthest, kept, steps, own.humble_search, scores)
    return True


@kernel
def _collect_bearings(tuning, call, rollout, target, either_way, scores):
    """Roll out once more and sum up the angles between heading and bearing of ``target`` (m from the start)."""
    refresh_every, noise_v, noise_w, v, w = rollout
    blocks, steps, samples = noise_v.shape
    collected = np.empty((COLLECTED_ROWS, blocks, samples), dtype=np.float32)
    keep, kept = np.full(steps, -1), np.empty((2, 0, blocks, samples), dtype=np.float32)
    window = np.empty(0, dtype=np.float32)
    sweep(
        call, tuning.model_dt, refresh_every, noise_v, noise_w, v, w, (0.0, 0.0, 0.0, 0.0), keep, kept,
        False, (0, 0, 0, 0, 0, 0, 0, 0), (0.0, 0.0, 0.0), (0, 0), window, False, BEARING, target, either_way, collected,
    )  # fmt: skip
    scores[:] = collected[ANGLE]


@kernel
def score_deadband(tuning, call, rollout, scores):
    """Sum up how much the speeds lack to those the base can drive."""
    _, noise_v, noise_w, v, w = rollout
    scores[:] = np.float32(0.0)
    add_below(noise_v, v, call.v, abs(tuning.VelocityDeadbandCritic.deadband_velocities[0]), scores)
    add_below(noise_w, w, call.w, abs(tuning.VelocityDeadbandCritic.deadband_velocities[2]), scores)


@kernel
def score_path_angle(tuning, call, rollout, path, kept, scores):
    """Angles between heading and bearing of a path point ahead, if the robot looks away; returns whether it applies."""
    own = tuning.PathAngleCritic
    if near(call, own.threshold_to_consider):
        return False
    target = min(find_furthest(tuning, call, path, kept) + own.offset_from_furthest, path.shape[1] - 1)
    dx, dy = path[0, target] - call.x, path[1, target] - call.y
    either_way = abs(tuning.vx_min) >= 1e-6 and not own.forward_preference
    angle = abs(normalize_angle(call.yaw - math.atan2(dy, dx)))
    if (min(angle, math.pi - angle) if either_way else angle) < own.max_angle_to_furthest:
        return False
    _collect_bearings(tuning, call, rollout, (dx, dy), either_way, scores)
    return True


@kernel
def score(critic, tuning, call, rollout, path, valid, costs, corners, kept, collected):
    """Score all samples by one critic.

    Args:
        critic: Its number in CRITICS.
        tuning: Parameters.
        call: The call.
        rollout: ``(refresh_every, noise_v, noise_w, v, w)``, as in the sweep.
        path: ``(3, points)`` local path, float32.
        valid: ``(points,)`` whether each point is free.
        costs: ``(rows, cols)`` uint8 costmap.
        corners: ``(n, 2)`` footprint.
        kept: Points kept by the sweep.
        collected: Sums collected by the sweep; the last row takes other scores.

    Returns:
        Row of ``collected`` that holds the scores, -1 if the critic does not apply now.
    """
    applies, row = True, SPARE
    if critic == CONSTRAINT:
        if tuning.ackermann:
            add_too_tight(rollout, call.v, call.w, tuning.AckermannConstraints.min_turning_r, collected[EXCESS])
        row = EXCESS
    elif critic == COST:
        near_goal = near(call, tuning.CostCritic.near_goal_distance)
        hits = score_cost(tuning, call, rollout, costs, corners, near_goal, collected[CELLS])
        call.failed = hits == tuning.batch_size
        row = CELLS
    elif critic == OBSTACLES:
        near_goal = near(call, tuning.ObstaclesCritic.near_goal_distance)
        hits = score_obstacles(tuning, call, rollout, costs, corners, near_goal, collected[SPARE])
        call.failed = hits == tuning.batch_size
    elif critic == GOAL:
        applies, row = near(call, tuning.GoalCritic.threshold_to_consider), DISTANCE
    elif critic == GOAL_ANGLE:
        applies, row = near(call, tuning.GoalAngleCritic.threshold_to_consider), ANGLE
    elif critic == PATH_ALIGN:
        applies = score_path_align(tuning, call, path, valid, kept, collected[SPARE])
    elif critic == PATH_FOLLOW:
        applies = score_path_follow(tuning, call, path, valid, kept, collected[SPARE])
    elif critic == PATH_ANGLE:
        applies = score_path_angle(tuning, call, rollout, path, kept, collected[SPARE])
    elif critic == PREFER_FORWARD:
        applies, row = not near(call, tuning.PreferForwardCritic.threshold_to_consider), REVERSE
    elif critic == TWIRLING:
        applies = not near(call, tuning.xy_goal_tolerance)
        add_turning(rollout[2], rollout[4], call.w, collected[SPARE])
    elif critic == DEADBAND:
        score_deadband(tuning, call, rollout, collected[SPARE])
    return row if applies else -1
