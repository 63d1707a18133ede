"""One cycle of the optimizer: what comes before and after the trajectories.

Source: nav2_mppi_controller/src/optimizer.cpp (Humble, Jazzy and Lyrical). ``tuning_of`` and ``call_of`` are ``(1,)``
records of :mod:`controllers.mppi.records`.
"""

from __future__ import annotations

import numpy as np

from controllers.mppi.kernels.accelerations import limit_samples, limit_sequence
from controllers.mppi.kernels.align import score_align
from controllers.mppi.kernels.controls import ALIGNED, ANGLE, DISTANCE, EFFORT, write_effort
from controllers.mppi.kernels.critics import is_near, judge, near
from controllers.mppi.kernels.elementary import ZERO
from controllers.mppi.kernels.path import find_valid
from controllers.mppi.kernels.points import sweep
from controllers.mppi.kernels.rollout import REFRESH_EVERY, SMALL_CHANGE
from controllers.mppi.kernels.update import add_mean_noise, add_scores, clip_controls, clip_turns, soft_max
from controllers.mppi.kernels.walk import footprint_threshold
from controllers.mppi.kernels.window import lay_grid, open_window, write_contributions
from gym_mapbench.kernels.jit import kernel


@kernel
def _reach_and_turn(call, longest, fastest, v, w):
    """Bounds of the distance that any trajectory can cover, in m/s times steps, and of its turn rate, rad/s."""
    reach, turn = abs(call.v) + longest, abs(call.w)
    for t in range(len(v)):
        reach += abs(v[t])
        turn = max(turn, abs(w[t]) + fastest)
    return reach, turn


@kernel
def _path_length(path):
    """Length of a path, m."""
    length = 0.0
    for i in range(1, len(path)):
        length += np.hypot(path[i, 0] - path[i - 1, 0], path[i, 1] - path[i - 1, 1])
    return length


@kernel
def begin(tuning_of, call_of, pose, velocity, path, goal, costs, place, unknown_is_free, total):
    """Write the record of a call, and look up the path on the costmap.

    Args:
        tuning_of: ``(1,)`` record of the parameters.
        call_of: ``(1,)`` record of the call, written.
        pose: Pose of the robot, m and rad.
        velocity: Speeds at the start of the rollout, m/s and rad/s.
        path: ``(points, 3)`` local path.
        goal: The goal in the sense of the critics, m.
        costs: ``(rows, cols)`` uint8 costmap.
        place: ``(resolution, origin_x, origin_y)`` of the costmap, m.
        unknown_is_free: Whether the costmap tracks unknown space, which is then no obstacle.
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
    (call.goal_x, call.goal_y), call.end_yaw = goal, points[2, count - 1]
    call.squared_distance = (call.x - call.goal_x) ** 2 + (call.y - call.goal_y) ** 2
    call.base_x, call.base_y, call.base_yaw = pose
    call.sum_x = call.sum_y = call.sum_yaw = 0.0
    if tuning_of[0].lyrical:
        call.squared_distance = _path_length(path) ** 2
        call.sum_x, call.sum_y, call.sum_yaw = pose
        call.base_x = call.base_y = call.base_yaw = 0.0
    call.resolution, call.origin_x, call.origin_y = place
    call.unknown_is_free = unknown_is_free
    call.failed, call.obstacle_hits, call.furthest = False, 0, -1
    find_valid(points[0], points[1], costs, call, valid)
    for b in range(total.shape[0]):
        for k in range(total.shape[1]):
            total[b, k] = 0.0
    return points, valid


@kernel
def _weigh_effort(tuning, v, w):
    """Factors of the samples in their control effort, and the effort of a sample of zero.

    The effort is the sum over the steps of factor times (sampled control - control). In Humble a sample is its noise,
    which is this difference; in Jazzy, where accelerations are limited, it is the sampled control itself.
    """
    gain_v = np.float32(tuning.gamma / tuning.vx_std**2)
    gain_w = np.float32(tuning.gamma / tuning.wz_std**2)
    factors_v, factors_w, effort = gain_v * v, gain_w * w, ZERO
    if tuning.jazzy:
        for t in range(len(v)):
            effort -= factors_v[t] * v[t] + factors_w[t] * w[t]
    return factors_v, factors_w, effort


@kernel
def _sample(tuning, call, noise, v, w, limited):
    """Return the samples as the rollout takes them: in Humble the noise, in Jazzy controls of limited acceleration.

    Jazzy's samples include the control sequence, which is therefore set to zero.

    Returns:
        ``(noise_v, noise_w, longest, fastest)``: the samples, the largest sum of ``|v|`` over the steps of a sample,
        and the largest ``|w|``.
    """
    if not tuning.jazzy:
        return noise
    longest, fastest = limit_samples(tuning, call, noise[0], noise[1], v, w, limited[0], limited[1])
    for t in range(len(v)):
        v[t] = w[t] = ZERO
    return limited[0], limited[1], np.float64(longest), np.float64(fastest)


@kernel
def explore(
    tuning_of, call_of, scan, costs, noise_v, noise_w, longest, fastest, v, w, highest, lowest, keep, kept, looked,
    limited, collected,
):  # fmt: skip
    """Sample the controls, roll them out and score them on the way.

    Args:
        tuning_of: ``(1,)`` record of the parameters.
        call_of: ``(1,)`` record of the call.
        scan: Whether the Cost critic is enabled.
        costs: ``(rows, cols)`` uint8 costmap.
        noise_v: ``(blocks, time_steps, samples)`` m/s.
        noise_w: The same, rad/s.
        longest: Largest sum of ``|noise_v|`` over the steps of a sample, m/s.
        fastest: Largest ``|noise_w|``, rad/s.
        v: ``(time_steps,)`` control sequence, m/s; zero afterwards if accelerations are limited.
        w: The same, rad/s.
        highest: Highest speed without cost in Constraint, m/s; float32.
        lowest: Lowest such speed.
        keep: As in the sweep, as are ``kept``, ``looked`` and ``collected``.
        kept: See there.
        looked: See there.
        limited: ``(2, blocks, time_steps, samples)``, written if accelerations are limited.
        collected: See there.

    Returns:
        Steps between two evaluations of sine and cosine in the roll-out.
    """
    efforts = _weigh_effort(tuning_of[0], v, w)
    samples = _sample(tuning_of[0], call_of[0], (noise_v, noise_w, longest, fastest), v, w, limited)
    return roll_out(
        tuning_of, call_of, scan, costs, samples, v, w, efforts, highest, lowest, keep, kept, looked, collected
    )


@kernel
def roll_out(
    tuning_of, call_of, scan, costs, samples, v, w, efforts, highest, lowest, keep, kept, looked, collected
):  # fmt: skip
    """Roll sampled controls out and score them on the way.

    Args:
        tuning_of: ``(1,)`` record of the parameters.
        call_of: ``(1,)`` record of the call.
        scan: As in :func:`explore`, as are all others that are not named here.
        costs: See there.
        samples: ``(noise_v, noise_w, longest, fastest)``, which are added to the control sequence.
        v: ``(time_steps,)`` control sequence, m/s.
        w: The same, rad/s.
        efforts: ``(time_steps,)`` factors of the two noises in the control effort, and the effort of a noise of zero.
        highest: See there.
        lowest: See there.
        keep: See there.
        kept: See there.
        looked: See there.
        collected: See there.

    Returns:
        Steps between two evaluations of sine and cosine in the roll-out.
    """
    tuning, call = tuning_of[0], call_of[0]
    noise_v, noise_w, longest, fastest = samples
    reach, turn = _reach_and_turn(call, longest, fastest, v, w)
    (rows, cols), grid, scale = lay_grid(call, reach * tuning.model_dt, costs.shape, tuning.jazzy)
    own = tuning.CostCritic
    window = np.empty((rows + 2) * (cols + 2) if scan else 0, dtype=np.float32)
    if scan:
        table = np.empty(256, dtype=np.float32)
        threshold = footprint_threshold(own.consider_footprint, tuning.circumscribed_cost)
        write_contributions(near(call, own.near_goal_distance), own, threshold, call.unknown_is_free, table)
        open_window(costs, grid[4], grid[5], rows, cols, table, window)
    refresh_every = REFRESH_EVERY if turn * tuning.model_dt < SMALL_CHANGE else 1
    sweep(
        call_of, tuning.model_dt, (refresh_every, noise_v, noise_w, v, w), efforts, (highest, lowest), keep, kept,
        looked, grid, scale, window, is_near(np.int64(DISTANCE), tuning, call), is_near(np.int64(ANGLE), tuning, call),
        tuning.GoalAngleCritic.symmetric_yaw_tolerance, collected,
    )  # fmt: skip
    return refresh_every


@kernel
def assess(tuning_of, call_of, critics, points, valid, speeds, kept, collected):
    """Find out which critics apply, and score those that need no roll-out of their own; see :func:`judge`."""
    own = tuning_of[0].PathAlignCritic
    rows = judge(tuning_of, call_of, critics, points, valid, speeds, kept, collected)
    for row in rows:
        if row == ALIGNED:
            compared = (tuning_of[0].time_steps - 1) // own.trajectory_point_step + 1
            score_align(call_of, points, valid, kept, compared, own.humble_search, collected)
    return rows


@kernel
def add_up_and_average(tuning, noise_v, noise_w, v, w, collected, rows, factors, powers, critic_costs, total):
    """Add up the critics' costs and add the soft-max mean of the noise; arguments as in :func:`finish`."""
    for i in range(len(rows)):
        add_scores(collected[rows[i]], factors[i], powers[i], rows[i] >= 0, critic_costs[i], total)
    for b in range(total.shape[0]):
        for k in range(total.shape[1]):
            total[b, k] += collected[EFFORT, b, k]
    weights = np.empty(total.shape, dtype=np.float32)
    weight = soft_max(total, tuning.batch_size, tuning.temperature, weights)
    add_mean_noise(noise_v, noise_w, weights, weight, v, w)


@kernel
def average(tuning_of, noise_v, noise_w, v, w, collected, rows, factors, powers, critic_costs, total):
    """Replace the control sequence by the soft-max mean of the controls as sampled, before any limit (Lyrical).

    Arguments as in :func:`finish`; the row of the control effort is written.
    """
    tuning = tuning_of[0]
    factors_v, factors_w, _ = _weigh_effort(tuning, v, w)
    write_effort(noise_v, noise_w, factors_v, factors_w, collected)
    add_up_and_average(tuning, noise_v, noise_w, v, w, collected, rows, factors, powers, critic_costs, total)


@kernel
def finish(tuning_of, noise_v, noise_w, v, w, collected, rows, factors, powers, critic_costs, total):
    """Add up the critics' costs and replace the control sequence by the soft-max mean of the sampled ones.

    Args:
        tuning_of: ``(1,)`` record of the parameters.
        noise_v: ``(blocks, time_steps, samples)`` what was sampled, m/s.
        noise_w: The same, rad/s.
        v: ``(time_steps,)`` control sequence, m/s, updated.
        w: The same, rad/s.
        collected: ``(12, blocks, samples)`` scores.
        rows: ``(critics,)`` rows of the critics, -1 for those that do not apply.
        factors: ``(critics,)`` factors of the scores.
        powers: ``(critics,)`` powers to which the products are raised.
        critic_costs: ``(critics, blocks, samples)`` what each critic adds, written.
        total: ``(blocks, samples)`` costs, added to.
    """
    tuning = tuning_of[0]
    add_up_and_average(tuning, noise_v, noise_w, v, w, collected, rows, factors, powers, critic_costs, total)
    clip_controls(v, w, tuning.lowest_speed, tuning.highest_speed, tuning.fastest_turn)
    if tuning.jazzy:
        limit_sequence(tuning, v, w)
    if tuning.ackermann:
        clip_turns(v, w, tuning.AckermannConstraints.min_turning_r)
