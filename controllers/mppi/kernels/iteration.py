"""One iteration of the optimizer, from sampled controls to the next control sequence.

Source: nav2_mppi_controller/src/optimizer.cpp (Humble and Jazzy).
"""

from __future__ import annotations

from controllers.mppi.kernels.align import score_align
from controllers.mppi.kernels.bearings import score_last_bearings, sweep_bearings
from controllers.mppi.kernels.controls import (
    ALIGNED,
    BEARINGS,
    CELLS,
    CLOSENESS,
    DEADBANDS,
    EXCESS,
    TURNING,
    add_too_tight,
    score_deadband,
    score_turning,
)
from controllers.mppi.kernels.critics import judge, near
from controllers.mppi.kernels.cycle import finish, prepare
from controllers.mppi.kernels.points import sweep
from controllers.mppi.kernels.walk import walk_cost, walk_obstacles
from gym_mapbench.kernels.jit import kernel


@kernel
def iterate(
    tuning_of, call_of, critics, factors, powers, points, valid, costs, corners, noise_v, noise_w, longest, fastest,
    v, w, highest, lowest, keep, kept, looked, limited, collected, critic_costs, total,
):  # fmt: skip
    """Roll out, score and update once.

    Args:
        tuning_of: ``(1,)`` record of the parameters.
        call_of: ``(1,)`` record of the call; what is found out is written.
        critics: ``(critics,)`` rows of the critics, in their order.
        factors: ``(critics,)`` factors of their scores.
        powers: ``(critics,)`` powers to which the products are raised.
        points: ``(3, points)`` local path, float32.
        valid: ``(points,)`` whether each point of the path is free.
        costs: ``(rows, cols)`` uint8 costmap.
        corners: ``(n, 2)`` footprint, m.
        noise_v: ``(blocks, time_steps, samples)`` m/s.
        noise_w: The same, rad/s.
        longest: Largest sum of ``|noise_v|`` over the steps of a sample, m/s.
        fastest: Largest ``|noise_w|``, rad/s.
        v: ``(time_steps,)`` control sequence, m/s, updated.
        w: The same, rad/s.
        highest: Highest speed without cost in Constraint, m/s; float32.
        lowest: Lowest such speed.
        keep: ``(time_steps,)`` row of ``kept`` that takes a step's points, or -1.
        kept: ``(2 or 3, kept steps, blocks, samples)`` world x, y and perhaps yaw, written.
        looked: ``(time_steps,)`` number of the look-up of the cells under a step's points, or -1.
        limited: ``(2, blocks, time_steps, samples)``, written if accelerations are limited.
        collected: ``(12, blocks, samples)`` scores, written.
        critic_costs: ``(critics, blocks, samples)`` what each critic adds, written.
        total: ``(blocks, samples)`` costs, added to.
    """
    noise, scan = (noise_v, noise_w, longest, fastest), has(critics, CELLS)
    rollout, efforts, grid, scale, window, measure, look = prepare(
        tuning_of, call_of, scan, costs, noise, v, w, limited
    )
    sweep(
        call_of, tuning_of[0].model_dt, rollout, efforts, (highest, lowest), keep, kept, looked, grid, scale, window,
        measure, look, tuning_of[0].GoalAngleCritic.symmetric_yaw_tolerance, collected,
    )  # fmt: skip
    walk(tuning_of, call_of, scan, has(critics, CLOSENESS), rollout, costs, corners, collected)
    rows = judge(tuning_of, call_of, critics, points, valid, kept, collected)
    for i in range(len(rows)):
        look_closer(rows[i], tuning_of, call_of, rollout, points, valid, kept, collected)
    finish(tuning_of, rollout, collected, rows, factors, powers, critic_costs, total)


@kernel
def has(critics, row):
    """Whether one of the critics has this row."""
    return bool((critics == row).any())


@kernel
def walk(tuning_of, call_of, scan, repels, rollout, costs, corners, collected):
    """Follow trajectories point by point where footprints or the Obstacles critic ask for it."""
    tuning, call = tuning_of[0], call_of[0]
    if scan and tuning.CostCritic.consider_footprint:
        is_near = near(call, tuning.CostCritic.near_goal_distance)
        walk_cost(tuning_of, call_of, rollout, costs, corners, is_near, collected)
    if repels:
        is_near = near(call, tuning.ObstaclesCritic.near_goal_distance)
        walk_obstacles(tuning_of, call_of, rollout, costs, corners, is_near, collected)


@kernel
def look_closer(row, tuning_of, call_of, rollout, points, valid, kept, collected):
    """Let a critic score that applies, if it needs a pass of its own over the trajectories."""
    tuning = tuning_of[0]
    if row == ALIGNED:
        compared = (tuning.time_steps - 1) // tuning.PathAlignCritic.trajectory_point_step + 1
        score_align(call_of, points, valid, kept, compared, tuning.PathAlignCritic.humble_search, collected)
    elif row == BEARINGS and tuning.jazzy:
        score_last_bearings(tuning_of, call_of, kept, collected)
    elif row == BEARINGS:
        sweep_bearings(tuning_of, call_of, rollout, collected)
    elif row == TURNING:
        score_turning(call_of, rollout, collected)
    elif row == DEADBANDS:
        score_deadband(tuning_of, call_of, rollout, collected)
    elif row == EXCESS and tuning.ackermann:
        add_too_tight(tuning_of, call_of, rollout, collected)
