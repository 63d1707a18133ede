"""One cycle of the optimizer: what comes before and after the trajectories.

Source: nav2_mppi_controller/src/optimizer.cpp (Humble). ``tuning_of`` and ``call_of`` are ``(1,)`` records of
:mod:`controllers.mppi.records`.
"""

from __future__ import annotations

import numpy as np

from controllers.mppi.kernels.controls import ANGLE, DISTANCE, EFFORT
from controllers.mppi.kernels.critics import is_near, near
from controllers.mppi.kernels.path import find_valid
from controllers.mppi.kernels.rollout import REFRESH_EVERY, SMALL_CHANGE
from controllers.mppi.kernels.update import add_mean_noise, add_scores, clip_controls, soft_max
from controllers.mppi.kernels.walk import footprint_threshold
from controllers.mppi.kernels.window import lay_grid, open_window, write_contributions
from gym_mapbench.kernels.jit import kernel


@kernel
def _reach_and_turn(call, longest, fastest, v, w):
    """Bounds of how far any trajectory can come, in m/s times steps, and of how fast it can turn, rad/s."""
    reach, turn = abs(call.v) + longest, abs(call.w)
    for t in range(len(v)):
        reach += abs(v[t])
        turn = max(turn, abs(w[t]) + fastest)
    return reach, turn


@kernel
def begin(call_of, pose, velocity, path, costs, place, unknown_is_free, total):
    """Write down what a call is about.

    Args:
        call_of: ``(1,)`` record, written.
        pose: Robot, m and rad.
        velocity: Measured speeds, m/s and rad/s.
        path: ``(points, 3)`` local path; its end is what MPPI calls the goal.
        costs: ``(rows, cols)`` uint8 costmap.
        place: ``(resolution, origin_x, origin_y)`` of the costmap, m.
        unknown_is_free: Whether the costmap tracks unknown space.
        total: ``(blocks, samples)`` costs, set to 0.

    Returns:
        The path as ``(3, points)`` float32, and ``(points,)`` whether each of its points is free.
    """
    call, count = call_of[0], len(path)
    points, valid = np.empty((3, count), dtype=np.float32), np.empty(count, dtype=np.bool_)
    for i in range(count):
        points[0, i], points[1, i], points[2, i] = path[i, 0], path[i, 1], path[i, 2]
    call.x, call.y, call.yaw = pose
    call.v, call.w = velocity
    call.end_x, call.end_y, call.end_yaw = points[0, count - 1], points[1, count - 1], points[2, count - 1]
    call.squared_distance = (call.x - call.end_x) ** 2 + (call.y - call.end_y) ** 2
    call.resolution, call.origin_x, call.origin_y = place
    call.unknown_is_free = unknown_is_free
    call.failed, call.obstacle_hits, call.furthest = False, 0, -1
    find_valid(points[0], points[1], costs, call, valid)
    for b in range(total.shape[0]):
        for k in range(total.shape[1]):
            total[b, k] = 0.0
    return points, valid


@kernel
def prepare(tuning_of, call_of, scan, costs, longest, fastest, v, w):
    """Say what the sweep has to do.

    Args:
        tuning_of: ``(1,)`` record of the parameters.
        call_of: ``(1,)`` record of the call.
        scan: Whether the Cost critic is asked.
        costs: ``(rows, cols)`` uint8 costmap.
        longest: Largest sum of ``|noise of v|`` over the steps of a sample.
        fastest: Largest ``|noise of w|``.
        v: ``(time_steps,)`` control sequence, m/s.
        w: The same, rad/s.

    Returns:
        Steps between two evaluations of sine and cosine, and the sweep's ``grid``, ``scale``, ``window``, ``measure``
        and ``look``.
    """
    tuning, call = tuning_of[0], call_of[0]
    reach, turn = _reach_and_turn(call, longest, fastest, v, w)
    (rows, cols), grid, scale = lay_grid(call, reach * tuning.model_dt, costs.shape)
    own = tuning.CostCritic
    window = np.empty((rows + 2) * (cols + 2) if scan else 0, dtype=np.float32)
    if scan:
        table = np.empty(256, dtype=np.float32)
        threshold = footprint_threshold(own.consider_footprint, tuning.circumscribed_cost)
        write_contributions(
            near(call, own.near_goal_distance), own.critical_cost, own.consider_footprint, threshold,
            call.unknown_is_free, table,
        )  # fmt: skip
        open_window(costs, grid[4], grid[5], rows, cols, table, window)
    refresh_every = REFRESH_EVERY if turn * tuning.model_dt < SMALL_CHANGE else 1
    return refresh_every, grid, scale, window, is_near(DISTANCE, tuning, call), is_near(ANGLE, tuning, call)


@kernel
def finish(tuning_of, rollout, collected, rows, factors, powers, critic_costs, total):
    """Add up what the critics say and replace the control sequence by the soft-max mean of the sampled ones.

    Args:
        tuning_of: ``(1,)`` record of the parameters.
        rollout: ``(refresh_every, noise_v, noise_w, v, w)``; the control sequence is updated.
        collected: ``(12, blocks, samples)`` scores.
        rows: ``(critics,)`` their rows, -1 for those that do not apply.
        factors: ``(critics,)`` what scores are multiplied with.
        powers: ``(critics,)`` powers they are then raised to.
        critic_costs: ``(critics, blocks, samples)`` what each critic adds, written.
        total: ``(blocks, samples)`` costs, added to.
    """
    tuning, (_, noise_v, noise_w, v, w) = tuning_of[0], rollout
    for i in range(len(rows)):
        add_scores(collected[rows[i]], factors[i], powers[i], rows[i] >= 0, critic_costs[i], total)
    for b in range(total.shape[0]):
        for k in range(total.shape[1]):
            total[b, k] += collected[EFFORT, b, k]
    weights = np.empty(total.shape, dtype=np.float32)
    weight = soft_max(total, tuning.batch_size, tuning.temperature, weights)
    add_mean_noise(noise_v, noise_w, weights, weight, v, w)
    radius = tuning.AckermannConstraints.min_turning_r if tuning.ackermann else 0.0
    clip_controls(v, w, tuning.lowest_speed, tuning.highest_speed, tuning.fastest_turn, radius)
