"""One decision of DWB: what of the plan counts, the candidates, how the critics judge them, and which is chosen.

Given are ``plan`` ``(m, 3)``, what is left of the global plan, and ``goal``, its last pose (m, rad); ``pose`` and
``velocity`` of the robot, and the time ``now``, s; ``tuning_of`` ``(1,)`` TUNING, ``critics`` ``(critics,)`` CRITIC and
``memory_of`` ``(1,)`` MEMORY, which is updated; ``forwards``, the distances ahead of the last poses at which points are
looked up, m, ascending; ``place``: costs of the costmap, x and y of its corner, and the side of its cells, m;
``corners`` ``(k, 2)`` of the padded footprint, m; and ``drives``, whether the command will be driven, so that the
critics take note of it: if not, all candidates are judged, as they are where none is legal.

Written are, for the first ``n`` of the most candidates there can be: ``twists`` and ``velocities`` ``(most, 2)``,
samples and commands; ``raw`` ``(critics * most,)``, ``n`` raw scores of one critic after the other; ``totals``
``(most,)`` float32; ``illegal_by`` ``(most,)``; and ``weights`` ``(critics,)`` float32.

Source: nav2_dwb_controller/dwb_core/src/dwb_local_planner.cpp (Humble, Jazzy and Lyrical).
"""

from __future__ import annotations

import math

import numpy as np

from controllers.dwb.kernels.critics import MAP_GRID, debrief, prepare, score, weight_of
from controllers.dwb.kernels.plan import distance_fields, plan_window
from controllers.dwb.kernels.rollout import first_velocities, roll_out
from controllers.dwb.kernels.verdict import judge
from gym_mapbench.kernels.jit import inlined, kernel

DECIDED, NO_PLAN = range(2)


@kernel
def decide(
    plan, pose, velocity, goal, now, tuning_of, critics, memory_of, forwards, place, corners, drives,
    twists, velocities, weights, raw, totals, illegal_by,
):  # fmt: skip
    """Judge the candidates of one cycle and choose one; the arguments are explained at the top of this module.

    Returns:
        DECIDED or NO_PLAN; index of the first pose of the plan that is kept; number ``n`` of candidates; index of the
        chosen one, -1 if none is legal; its speed and turn rate, 0 if there is none.
    """
    tuning, memory = tuning_of[0], memory_of[0]
    costs, _, _, resolution = place
    first, last = near_plan(plan, pose, tuning, max(costs.shape) * resolution / 2.0)
    kept = first if tuning.prune_plan else 0
    if first == last:
        return NO_PLAN, kept, 0, -1, 0.0, 0.0
    robot = np.empty(5)
    robot[0], robot[1], robot[2], robot[3], robot[4] = pose[0], pose[1], pose[2], velocity[0], velocity[1]
    candidates, box = fill(robot, tuning, forwards, place)
    n = len(candidates[0])
    copy_pairs(candidates[0], velocities)
    copy_pairs(candidates[1], twists)
    raw, totals, illegal_by = raw[: len(critics) * n].reshape((len(critics), n)), totals[:n], illegal_by[:n]
    let_score(plan[first:last], robot, goal, tuning, critics, memory, place, corners, candidates, box, weights, raw)
    best = judge(raw, weights, critics, tuning, robot, candidates, place, corners, totals, illegal_by, drives)
    v, w = (velocities[best, 0], velocities[best, 1]) if best >= 0 else (0.0, 0.0)
    if drives:
        debrief(tuning.Oscillation, memory, robot, now, v, w, tuning.lyrical)
    return DECIDED, kept, n, best, v, w


@inlined
def copy_pairs(pairs, rows):
    """Copy ``(n, 2)`` numbers into the first rows; assigned as arrays they would take three seconds to compile."""
    for i in range(len(pairs)):
        rows[i, 0], rows[i, 1] = pairs[i, 0], pairs[i, 1]


@inlined
def near_plan(plan, pose, tuning, half):
    """First and past-the-last pose of the part of the plan near the robot; ``half`` the costmap's longer side, m.

    In Lyrical the plan is the local plan already.
    """
    if tuning.lyrical:
        return 0, len(plan)
    ahead = math.inf if tuning.forward_prune_distance < 0.0 else tuning.forward_prune_distance
    start = min(half, tuning.prune_distance) if tuning.prune_plan else half
    end = min(half, ahead) if tuning.shorten_transformed_plan else half
    search = tuning.prune_distance if tuning.humble else ahead
    return plan_window(plan, pose[0], pose[1], search, start, end)


@inlined
def fill(robot, tuning, forwards, place):
    """Sample and roll out the candidates.

    Returns:
        ``(n, 2)`` commands, and what :func:`~controllers.dwb.kernels.rollout.roll_out` returns but the box; lowest and
        highest x, lowest and highest y of all points that critics look up, m: those ahead of the last poses or, if a
        map grid aggregates all poses, all that can be reached.
    """
    costs, origin_x, origin_y, resolution = place
    twists, steps, headings, ends, yaw, cos, sin, cells, box = roll_out(
        robot, tuning.axes, tuning.horizon, tuning.speeds, tuning.sim_time, tuning.granularity, tuning.limits, forwards,
        origin_x, origin_y, resolution, costs.shape,
    )  # fmt: skip
    velocities = twists
    if tuning.limit_vel_cmd_in_traj:
        velocities = first_velocities(robot, tuning.limits, tuning.sim_time, twists, steps)
    if tuning.whole_way:
        fastest = max(abs(robot[3]), abs(tuning.axes[0, 0]), abs(tuning.axes[0, 1]))
        reach = fastest * tuning.sim_time + forwards[-1]
        box = robot[0] - reach, robot[0] + reach, robot[1] - reach, robot[1] + reach
    return (velocities, twists, steps, headings, ends, yaw, cos, sin, cells), box


@inlined
def let_score(plan, robot, goal, tuning, critics, memory, place, corners, candidates, box, weights, raw):
    """Let every critic that counts write its raw scores, and its weight; 0 for those of the others."""
    costs, origin_x, origin_y, resolution = place
    prepare(tuning, memory, robot, goal)
    fields = np.empty((3, 0), dtype=np.int32), 0, False
    raw[:] = 0.0
    for c in range(len(critics)):
        weight = weight_of(critics[c], robot, goal, resolution)
        weights[c] = weight
        if weight == 0.0:
            continue
        if critics[c].kind == MAP_GRID and fields[0].shape[1] == 0:
            bearing = math.atan2(goal[1] - robot[1], goal[0] - robot[0])
            ahead = tuning.GoalAlign.forward_point_distance
            ahead_x, ahead_y = ahead * math.cos(bearing), ahead * math.sin(bearing)
            fields = distance_fields(plan, ahead_x, ahead_y, costs, origin_x, origin_y, resolution, box)
        score(critics[c], tuning, memory, robot, goal, place, corners, candidates, fields, raw[c])
