"""One cycle of the optimizer: roll out, score, take the soft-max mean.

Source: nav2_mppi_controller/src/optimizer.cpp (Humble).
"""

from __future__ import annotations

import math

import numpy as np

from controllers.mppi.kernels.controls import COLLECTED_ROWS, EFFORT
from controllers.mppi.kernels.critics import (
    COST,
    GOAL,
    GOAL_ANGLE,
    PATH_ALIGN,
    asks_for,
    free_speeds,
    near,
    score,
    weight_of,
)
from controllers.mppi.kernels.path import find_valid
from controllers.mppi.kernels.points import HEADING, NOTHING, sweep
from controllers.mppi.kernels.rollout import REFRESH_EVERY, SMALL_CHANGE
from controllers.mppi.kernels.update import add_mean_noise, add_scores, clip_controls, soft_max
from controllers.mppi.kernels.walk import footprint_threshold
from controllers.mppi.kernels.window import lay_grid, open_window, write_contributions
from gym_mapbench.kernels.jit import kernel


@kernel
def _choose_steps(tuning, call, order, keep):
    """Write which steps' points the critics need, as rows or -1; return how many and whether with headings."""
    own, steps = tuning.PathAlignCritic, tuning.time_steps
    aligned = asks_for(order, PATH_ALIGN) and not near(call, own.threshold_to_consider)
    count = 0
    for t in range(steps):
        keep[t] = -1
        if t == steps - 1 or (aligned and t % own.trajectory_point_step == 0):
            keep[t] = count
            count += 1
    return count, aligned and own.use_path_orientations


@kernel
def _open_window(tuning, call, order, reach, costs):
    """Cut out the contributions of the cells that trajectories can reach; return whether to scan, grid, scale, cells."""
    own = tuning.CostCritic
    scan = asks_for(order, COST)
    (rows, cols), grid, scale = lay_grid(call, reach, costs.shape)
    window = np.empty((rows + 2) << grid[1] if scan else 0, dtype=np.float32)
    if scan:
        table = np.empty(256, dtype=np.float32)
        threshold = footprint_threshold(own.consider_footprint, tuning.circumscribed_cost)
        near_goal = near(call, own.near_goal_distance)
        write_contributions(
            near_goal, own.critical_cost, own.consider_footprint, threshold, call.unknown_is_free, table
        )
        open_window(costs, grid[6], grid[7], rows, cols, grid[1], table, window)
    return scan, grid, scale, window


@kernel
def _rollout_of(tuning, call, noise_v, noise_w, fastest, v, w):
    """Collect what a rollout needs; sine and cosine are evaluated afresh at every step if headings may change fast."""
    turn = abs(call.w)
    for t in range(len(w)):
        turn = max(turn, abs(w[t]) + fastest)
    refresh_every = REFRESH_EVERY if turn * tuning.model_dt < SMALL_CHANGE else 1
    return refresh_every, noise_v, noise_w, v, w


@kernel
def _reach(tuning, call, longest, v):
    """How far from the start any trajectory can come, m."""
    total = abs(call.v) + longest
    for t in range(len(v)):
        total += abs(v[t])
    return total * tuning.model_dt


@kernel
def collect(tuning, call, order, rollout, longest, costs, collected):
    """Roll out all samples and collect what the critics ask for; return the points kept."""
    refresh_every, noise_v, noise_w, v, w = rollout
    blocks, steps, samples = noise_v.shape
    keep = np.empty(steps, dtype=np.int64)
    count, with_yaw = _choose_steps(tuning, call, order, keep)
    kept = np.empty((3 if with_yaw else 2, count, blocks, samples), dtype=np.float32)
    scan, grid, scale, window = _open_window(tuning, call, order, _reach(tuning, call, longest, v), costs)
    highest, lowest = free_speeds(tuning)
    speeds = (highest, lowest, tuning.gamma / tuning.vx_std**2, tuning.gamma / tuning.wz_std**2)
    measure = asks_for(order, GOAL) and near(call, tuning.GoalCritic.threshold_to_consider)
    own = tuning.GoalAngleCritic
    look = HEADING if asks_for(order, GOAL_ANGLE) and near(call, own.threshold_to_consider) else NOTHING
    heading = (math.cos(call.end_yaw), math.sin(call.end_yaw))
    sweep(
        call, tuning.model_dt, refresh_every, noise_v, noise_w, v, w, speeds, keep, kept,
        scan, grid, scale, costs.shape, window, measure, look, heading, own.symmetric_yaw_tolerance, collected,
    )  # fmt: skip
    return kept


@kernel
def optimize(
    tuning_of, call_of, order, path, costs, corners, noise_v, noise_w, longest, fastest, v, w, critic_costs, total
):
    """Improve the control sequence once.

    Args:
        tuning_of: ``(1,)`` record of the parameters.
        call_of: ``(1,)`` record of the call; ``failed`` and ``furthest`` are written.
        order: Numbers of the critics, in their order.
        path: ``(3, points)`` local path, float32.
        costs: ``(rows, cols)`` uint8 costmap.
        corners: ``(n, 2)`` footprint, m.
        noise_v: ``(blocks, time_steps, samples)`` m/s.
        noise_w: The same, rad/s.
        longest: Largest sum of ``|noise_v|`` over the steps of a sample.
        fastest: Largest ``|noise_w|``.
        v: ``(time_steps,)`` control sequence, m/s, updated.
        w: The same, rad/s.
        critic_costs: ``(critics, blocks, samples)`` what each critic adds, written.
        total: ``(blocks, samples)`` costs, added to.
    """
    tuning, call = tuning_of[0], call_of[0]
    blocks, _, samples = noise_v.shape
    collected = np.empty((COLLECTED_ROWS, blocks, samples), dtype=np.float32)
    rollout = _rollout_of(tuning, call, noise_v, noise_w, fastest, v, w)
    kept = collect(tuning, call, order, rollout, longest, costs, collected)
    valid = np.empty(path.shape[1], dtype=np.bool_)
    find_valid(path[0], path[1], costs, call, valid)
    for i in range(len(order)):
        row = -1
        if not call.failed:
            row = score(order[i], tuning, call, rollout, path, valid, costs, corners, kept, collected)
        factor, power = weight_of(order[i], tuning)
        add_scores(collected[row], factor, power, row >= 0, critic_costs[i], total)
    update(tuning, noise_v, noise_w, collected[EFFORT], v, w, total)


@kernel
def update(tuning, noise_v, noise_w, effort, v, w, total):
    """Replace the control sequence by the soft-max mean of the sampled ones, within the limits in force."""
    for b in range(total.shape[0]):
        for k in range(total.shape[1]):
            total[b, k] += effort[b, k]
    weights = np.empty(total.shape, dtype=np.float32)
    weight = soft_max(total, tuning.batch_size, tuning.temperature, weights)
    add_mean_noise(noise_v, noise_w, weights, weight, v, w)
    radius = tuning.AckermannConstraints.min_turning_r if tuning.ackermann else 0.0
    clip_controls(v, w, tuning.lowest_speed, tuning.highest_speed, tuning.fastest_turn, radius)
