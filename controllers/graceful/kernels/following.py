"""One call of the Graceful Controller: the path near the robot, a target on it, the way there and the command.

Within a call everything is in the robot's frame: a pose is ``(x, y, yaw)`` in m and rad, the robot's own is
:data:`HERE`. ``scene`` is ``(costs, resolution, origin_x, origin_y, track_unknown, corners, use_radius, robot)``, the
costmap with the robot's outline and its pose there; ``tuning`` is one record of
:data:`controllers.graceful.controller.TUNING`.

Source: nav2_graceful_controller: src/graceful_controller.cpp (Humble and Jazzy).
"""

from __future__ import annotations

import math

import numpy as np

from controllers.graceful.kernels.control_law import law_command, move, turn_command
from controllers.local_plan import plan_window
from gym_mapbench.kernels.footprint import footprint_cost
from gym_mapbench.kernels.geometry import cell_index, normalize_angle
from gym_mapbench.kernels.jit import kernel

INSCRIBED = 253
LETHAL = 254
NO_INFORMATION = 255

OK = 0
EMPTY_PLAN = 1
COLLISION = 2

HERE = (0.0, 0.0, 0.0)
SAME_HEADING = 1e-6


@kernel
def costs_of(scene, pose):
    """Costs of a pose in the robot's frame, both -1 off the map.

    Returns:
        Cost that decides about a collision, at the centre of a disc, else along the outline; cost at the centre.
    """
    costs, resolution, origin_x, origin_y, _, corners, use_radius, robot = scene
    cos, sin = math.cos(robot[2]), math.sin(robot[2])
    x, y = robot[0] + (cos * pose[0] - sin * pose[1]), robot[1] + (sin * pose[0] + cos * pose[1])
    rows, cols = costs.shape
    cell = cell_index(x, y, origin_x, origin_y, resolution, rows, cols)
    if cell < 0:
        return -1, -1
    centre = int(costs[cell // cols, cell % cols])
    if use_radius:
        return centre, centre
    return int(footprint_cost(costs, resolution, origin_x, origin_y, x, y, robot[2] + pose[2], corners)), centre


@kernel
def is_collision(scene, cost):
    """Whether a cost is that of a collision; unknown is an obstacle unless it is tracked."""
    track_unknown, use_radius = scene[4], scene[6]
    return cost == LETHAL or (cost == INSCRIBED and use_radius) or (cost == NO_INFORMATION and not track_unknown)


@kernel
def collides(scene, pose):
    """Whether the robot touches an obstacle at a pose of its own frame; off the map it touches nothing."""
    return is_collision(scene, costs_of(scene, pose)[0])


@kernel
def all_headings_same(path, first, last):
    """Whether the window's inner poses have one heading; as in Nav2, headings further to the left count as the same."""
    same = last - first >= 3
    for i in range(first + 2, last - 1):
        same &= normalize_angle(path[first + 1, 2] - path[i, 2]) <= SAME_HEADING
    return same


@kernel
def local_path(path, first, last, robot, adds_headings):
    """Poses of the window, ``(n, 3)`` in the robot's frame; ``adds_headings`` turns poses of equal heading."""
    cos, sin = math.cos(robot[2]), math.sin(robot[2])
    local = np.empty((last - first, 3))
    for i in range(last - first):
        dx, dy = path[first + i, 0] - robot[0], path[first + i, 1] - robot[1]
        local[i, 0], local[i, 1] = cos * dx + sin * dy, cos * dy - sin * dx
        local[i, 2] = normalize_angle(path[first + i, 2] - robot[2])
    if adds_headings and all_headings_same(path, first, last):
        for i in range(len(local) - 1):
            local[i, 2] = math.atan2(local[i + 1, 1] - local[i, 1], local[i + 1, 0] - local[i, 0])
    return local


@kernel
def lengths_along(local):
    """Distance of every pose along the path, ``(n,)`` m, the way from the robot to the first included."""
    lengths = np.empty(len(local))
    lengths[0] = math.hypot(local[0, 0], local[0, 1])
    for i in range(1, len(local)):
        step = math.hypot(local[i, 0] - local[i - 1, 0], local[i, 1] - local[i - 1, 1])
        lengths[i] = lengths[i - 1] + step
    return lengths


@kernel
def turned_for(target, tuning):
    """Whether a target is driven to backwards, and the target with the heading that this asks for."""
    if tuning.allow_backward and target[0] < 0.0:
        return True, (target[0], target[1], normalize_angle(target[2] + math.pi))
    return False, target


@kernel
def simulate(scene, target, backward, turns_first, most_steps, dt, tuning):
    """Simulate driving to a target by the law, in steps of ``dt`` s, with ``turns_first`` after a turn towards it.

    The turn, on the spot, goes on with its first turn rate. It ends in the step in which the bearing has come within
    the tolerance.

    Returns:
        Whether the way is free, the first step's command v and w, the number of steps, and the highest cost at the
        robot's centre on the way.
    """
    resolution = scene[1]
    bearing = math.atan2(target[1], target[0])
    pose = HERE
    first_v = first_w = 0.0
    step, worst = 0, 0
    while True:
        if turns_first:
            if step == 0:
                first_w = turn_command(bearing, tuning)
            turns_first = abs(bearing - pose[2]) >= tuning.initial_rotation_tolerance
            pose = move(pose, 0.0, first_w, dt)
        else:
            v, w = law_command(pose, target, backward, tuning)
            if step == 0:
                first_v, first_w = v, w
            pose = move(pose, v, w, dt)
        step += 1
        cost, centre = costs_of(scene, pose)
        worst = max(worst, centre)
        if tuning.use_collision_detection and is_collision(scene, cost):
            return False, first_v, first_w, step, worst
        left = math.hypot(target[0] - pose[0], target[1] - pose[1])
        if not left > resolution or step >= most_steps:
            return True, first_v, first_w, step, worst


@kernel
def steps_to(target, per_cell, resolution):
    """How many steps a simulation may take: ``per_cell`` for every cell of the straight way."""
    return int(per_cell * math.hypot(target[0], target[1]) / resolution)


@kernel
def can_turn(scene, angle, tuning):
    """Whether the robot can turn on the spot by an angle (rad): some headings on the way are checked (since Jazzy)."""
    if not tuning.use_collision_detection:
        return True
    count = max(1, int(abs(angle) / tuning.in_place_collision_resolution))
    free = True
    for i in range(1, count + 1):
        free &= not collides(scene, (0.0, 0.0, i / count * angle))
    return free


@kernel
def command_to_farthest(scene, local, lengths, remaining, turns_first, tuning):
    """Jazzy: the command to the farthest target within ``max_lookahead`` to which the way is free.

    Returns:
        Status, command v and w, and whether the first turn of this path may still be to come.
    """
    near_goal = remaining < tuning.max_lookahead
    for i in range(len(local) - 1, -1, -1):
        if lengths[i] > tuning.max_lookahead:
            continue
        if not near_goal and lengths[i] < tuning.min_lookahead:
            break
        x, y, yaw = local[i, 0], local[i, 1], local[i, 2]
        bearing = math.atan2(y, x)
        heading = bearing if near_goal and tuning.prefer_final_rotation else yaw
        backward, target = turned_for((x, y, heading), tuning)
        turns_first = turns_first and abs(bearing) >= tuning.initial_rotation_tolerance
        most_steps = steps_to(target, 3, scene[1])
        first_turn = turns_first and tuning.initial_rotation
        free, v, w, _, _ = simulate(
            scene, target, backward, first_turn, most_steps, scene[1] / tuning.v_linear_max, tuning
        )
        if free:
            return OK, v, w, turns_first
    return COLLISION, 0.0, 0.0, turns_first


@kernel
def motion_target(local, remaining, tuning):
    """Humble: the first pose at ``motion_target_dist``, else the last; near the goal it heads as the last segment."""
    at = len(local) - 1
    for i in range(len(local)):
        if math.hypot(local[i, 0], local[i, 1]) >= tuning.motion_target_dist:
            at = i
            break
    heading = local[at, 2]
    if tuning.final_rotation and remaining < tuning.motion_target_dist and len(local) > 1:
        heading = math.atan2(local[-1, 1] - local[-2, 1], local[-1, 0] - local[-2, 0])
    return local[at, 0], local[at, 1], heading


@kernel
def command_to_target(scene, local, remaining, arrived, tuning):
    """Humble: turn at the goal, turn towards the target, or drive to it; the way to it must be free in any case."""
    x, y, heading = motion_target(local, remaining, tuning)
    bearing = math.atan2(y, x)
    backward, target = turned_for((x, y, heading), tuning)
    most_steps = steps_to(target, 2, scene[1]) - 1
    free, v, w, _, _ = simulate(scene, target, backward, False, most_steps, scene[1] / tuning.v_linear_max, tuning)
    if not free or collides(scene, HERE):
        return COLLISION, 0.0, 0.0
    if arrived:
        return OK, 0.0, turn_command(local[-1, 2], tuning)
    if tuning.initial_rotation and abs(bearing) > tuning.initial_rotation_min_angle:
        return OK, 0.0, turn_command(bearing, tuning)
    return OK, v, w


@kernel
def follow(path, steps, begin, arrived, turns_first, scene, tunings):
    """One controller call.

    Args:
        path: ``(n, 3)`` x, y in m and yaw in rad; poses before ``begin`` are already pruned.
        steps: ``(n - 1,)`` distances between consecutive poses, m.
        begin: First pose of the plan.
        arrived: Whether the goal was reached on this path.
        turns_first: Whether the first turn of this path may still be to come.
        scene: Costmap, outline and pose of the robot.
        tunings: ``(1,)`` array with the record of parameters.

    Returns:
        Status, command v and w, new first pose of the plan, new ``arrived`` and ``turns_first``.
    """
    tuning, costs, robot = tunings[0], scene[0], scene[7]
    first, last = plan_window(path, steps, begin, robot[0], robot[1], costs, scene[1], tuning)
    if first == last:
        return EMPTY_PLAN, 0.0, 0.0, first, arrived, turns_first
    local = local_path(path, first, last, robot, tuning.adds_headings)
    lengths = lengths_along(local)
    remaining = lengths[-1] - lengths[0]
    near = remaining < tuning.xy_goal_tolerance
    if not tuning.takes_farthest:
        arrived = tuning.final_rotation and (arrived or near)
        status, v, w = command_to_target(scene, local, remaining, arrived, tuning)
        return status, v, w, first, arrived, turns_first
    arrived = arrived or near
    if arrived and can_turn(scene, local[-1, 2], tuning):
        return OK, 0.0, turn_command(local[-1, 2], tuning), first, arrived, turns_first
    status, v, w, turns_first = command_to_farthest(scene, local, lengths, remaining, turns_first, tuning)
    return status, v, w, first, arrived, turns_first
