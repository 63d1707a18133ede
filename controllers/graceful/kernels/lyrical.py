"""One call of the Graceful Controller in Lyrical: the farthest target of the local plan to which the way is free.

``scene`` and ``tuning`` as in :mod:`controllers.graceful.kernels.following`.

Source: nav2_graceful_controller (Lyrical): src/graceful_controller.cpp.
"""

from __future__ import annotations

import math

import numpy as np

from controllers.graceful.kernels.control_law import law_command, turn_command
from controllers.graceful.kernels.following import (
    COLLISION,
    HERE,
    OK,
    can_turn,
    lengths_along,
    local_path,
    simulate,
    steps_to,
    turned_for,
)
from gym_mapbench.kernels.geometry import normalize_angle
from gym_mapbench.kernels.jit import kernel

MOST_VALID = 252
MOST_VALID_OUTLINE = 253
"""Costs at the centre from which on a way is not safe, for a disc and for a robot with an outline."""


@kernel
def lookahead_target(local, lengths, max_lookahead):
    """The point at ``max_lookahead`` (m) along the path with the direction of its segment, else the last pose."""
    for i in range(1, len(local)):
        if lengths[i] - lengths[0] >= max_lookahead and lengths[i] > lengths[i - 1]:
            share = (max_lookahead - (lengths[i - 1] - lengths[0])) / (lengths[i] - lengths[i - 1])
            dx, dy = local[i, 0] - local[i - 1, 0], local[i, 1] - local[i - 1, 1]
            return local[i - 1, 0] + share * dx, local[i - 1, 1] + share * dy, math.atan2(dy, dx)
    return local[-1, 0], local[-1, 1], local[-1, 2]


@kernel
def enlarged(scene, v, fastest, tuning):
    """The scene with the outline that a command of speed ``v`` (m/s) asks for; a disc or a triangle stays."""
    slowest = tuning.footprint_scaling_linear_vel
    costs, resolution, origin_x, origin_y, track_unknown, corners, use_radius, robot = scene
    if not use_radius and len(corners) > 3 and v > slowest and fastest > slowest:  # rounding may leave v above fastest
        corners = corners * (1.0 + tuning.footprint_scaling_factor * (v - slowest) / (fastest - slowest))
    return costs, resolution, origin_x, origin_y, track_unknown, corners, use_radius, robot


@kernel
def approach(scene, pose, turns_first, tuning):
    """Simulate driving to a target, at ever lower top speeds until the way is free; the outline is as the command asks.

    Returns:
        As :func:`~controllers.graceful.kernels.following.simulate`.
    """
    backward, target = turned_for(pose, tuning)
    most_steps = steps_to(target, 3, scene[1])
    fastest = tuning.v_linear_max
    dt = scene[1] / fastest
    free, v, w, steps, worst = False, 0.0, 0.0, 0, 0
    top = fastest
    while True:
        tuning.v_linear_max = top
        commanded = 0.0 if turns_first else law_command(HERE, target, backward, tuning)[0]
        with_outline = enlarged(scene, commanded, fastest, tuning)
        free, v, w, steps, worst = simulate(with_outline, target, backward, turns_first, most_steps, dt, tuning)
        top -= tuning.footprint_scaling_step
        if free or not (tuning.footprint_scaling_step > 0.0 and top >= tuning.footprint_scaling_linear_vel):
            break
    tuning.v_linear_max = fastest
    return free, v, w, steps, worst


@kernel
def command_round(scene, x, y, turns_first, command, safe, most_valid, tuning):
    """Search the headings of a target for a safe way there of few steps; ``command`` is kept if there is none.

    As in Nav2, the last safe heading is kept as long as it is safe, each one found moves the headings that are tried
    after it, and an unsafe way of few steps rules out longer ones. Ways of as many steps are equally fast here; in Nav2
    the last bits of their durations decide.

    Returns:
        The command v and w, and the last safe heading.
    """
    (best_v, best_w), least = command, np.inf
    for i in range(math.ceil(2.0 * math.pi / tuning.final_rotation_search_step)):
        tried = i * tuning.final_rotation_search_step + (0.0 if math.isnan(safe) else safe)
        free, v, w, steps, worst = approach(scene, (x, y, normalize_angle(tried)), turns_first, tuning)
        if not free or steps >= least:
            continue
        least = steps
        if worst < most_valid:
            is_kept = tried == safe
            best_v, best_w, safe = v, w, tried
            if is_kept:
                break
    return best_v, best_w, safe


@kernel
def command_near_goal(scene, x, y, turns_first, safe, tuning):
    """The command straight to a target near the goal or, where that way is expensive, to another heading there.

    Returns:
        Whether the way straight there is free, the command v and w, and the last safe heading.
    """
    most_valid = MOST_VALID if scene[6] else MOST_VALID_OUTLINE
    free, v, w, _, worst = approach(scene, (x, y, math.atan2(y, x)), turns_first, tuning)
    if free and worst >= most_valid - tuning.obstacle_cost_margin:
        v, w, safe = command_round(scene, x, y, turns_first, (v, w), safe, most_valid, tuning)
    return free, v, w, safe


@kernel
def command_to(scene, pose, remaining, turns_first, safe, tuning):
    """The command to one target.

    Returns:
        Whether the way is free, the command v and w, and the last safe heading.
    """
    if tuning.prefer_final_rotation and remaining < tuning.max_lookahead:
        free, v, w, safe = command_near_goal(scene, pose[0], pose[1], turns_first, safe, tuning)
        if free:
            return True, v, w, safe
    free, v, w, _, _ = approach(scene, pose, turns_first, tuning)
    return free, v, w, safe


@kernel
def follow(path, arrived, turns_first, safe, scene, tunings):
    """One controller call.

    Args:
        path: ``(n, 3)`` local plan, x, y in m and yaw in rad.
        arrived: Whether the goal's position is reached.
        turns_first: Whether the first turn of this path may still be to come.
        safe: The last safe heading that a search found, in the robot's frame, rad; nan for none.
        scene: Costmap, outline and pose of the robot.
        tunings: ``(1,)`` array with the record of parameters.

    Returns:
        Status, command v and w, new ``turns_first`` and ``safe``.
    """
    tuning = tunings[0]
    local = local_path(path, 0, len(path), scene[7], True)
    lengths = lengths_along(local)
    remaining = lengths[-1] - lengths[0]
    if arrived and can_turn(scene, local[-1, 2], tuning):
        return OK, 0.0, turn_command(local[-1, 2], tuning), turns_first, safe
    for i in range(len(local), -1, -1):
        if i == len(local):
            pose, distance = (
                lookahead_target(local, lengths, tuning.max_lookahead),
                min(remaining, tuning.max_lookahead),
            )
        else:
            pose, distance = (local[i, 0], local[i, 1], local[i, 2]), lengths[i]
        if distance > tuning.max_lookahead:
            continue
        turns_first = turns_first and abs(math.atan2(pose[1], pose[0])) >= tuning.initial_rotation_tolerance
        first_turn = turns_first and tuning.initial_rotation
        free, v, w, safe = command_to(scene, pose, remaining, first_turn, safe, tuning)
        if free:
            return OK, v, w, turns_first, safe
    return COLLISION, 0.0, 0.0, turns_first, safe
