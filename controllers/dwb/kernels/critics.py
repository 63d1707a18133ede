"""The critics: each gives every candidate a raw score, or rejects it.

``critic`` is a CRITIC, ``tuning`` a TUNING and ``memory`` a MEMORY of :mod:`controllers.dwb.records`; ``robot`` is
``(5,)`` x, y, yaw, v, omega; ``goal`` is the last pose of the global plan; ``place`` is the costmap: its costs, x and
y of its corner, and the side of its cells. ``candidates`` is what :func:`~controllers.dwb.kernels.rollout.roll_out`
returns, with the commands in front. All are compiled into the decision that calls them: compiled one by one they would
take twice as long.

Source: nav2_dwb_controller/dwb_critics.
"""

from __future__ import annotations

from controllers.dwb.kernels.scoring import (
    ILLEGAL,
    LAST,
    aggregated_grid_scores,
    last_footprint_scores,
    last_grid_scores,
    last_obstacle_scores,
    rotation_errors,
    summed_footprint_scores,
    summed_obstacle_scores,
)
from gym_mapbench.kernels.geometry import normalize_angle
from gym_mapbench.kernels.jit import inlined

(BASE_OBSTACLE, OBSTACLE_FOOTPRINT, MAP_GRID, ROTATE_TO_GOAL, OSCILLATION, PREFER_FORWARD, TWIRLING) = range(7)


@inlined
def squared_distance(robot, goal):
    """Distance from the robot to the goal, squared, m^2."""
    dx, dy = robot[0] - goal[0], robot[1] - goal[1]
    return dx * dx + dy * dy


@inlined
def prepare(tuning, memory, robot, goal):
    """Let RotateToGoal remember that the goal is near, and that the robot has stopped there, until the next plan."""
    tolerance, stopped = tuning.xy_goal_tolerance, tuning.trans_stopped_velocity
    near = squared_distance(robot, goal) <= tolerance * tolerance
    memory.in_window = memory.in_window or (near and not memory.is_far)
    memory.rotating = memory.rotating or (memory.in_window and robot[3] * robot[3] <= stopped * stopped)


@inlined
def weight_of(critic, robot, goal, resolution):
    """Weight of a critic's raw score, 0 for one that is left out, as PathAlign is close to the goal."""
    if critic.silent_at_goal and squared_distance(robot, goal) <= critic.forward * critic.forward:
        return 0.0
    if critic.kind == MAP_GRID:
        return resolution * 0.5 * critic.scale
    return resolution * critic.scale if critic.kind == OBSTACLE_FOOTPRINT else critic.scale


@inlined
def score(critic, tuning, memory, robot, goal, place, corners, candidates, fields, scores):
    """Write the raw scores ``(n,)`` of a critic over zeros: never negative, but ``ILLEGAL`` where it rejects.

    What it rejects along the way need not be found out here; see :mod:`controllers.dwb.kernels.verdict`. ``fields``
    are the map grids of :func:`~controllers.dwb.kernels.plan.distance_fields`.
    """
    if critic.kind == BASE_OBSTACLE:
        score_obstacles(critic, tuning, robot, place, candidates, scores)
    elif critic.kind == OBSTACLE_FOOTPRINT:
        score_footprints(critic, tuning, robot, place, corners, candidates, scores)
    elif critic.kind == MAP_GRID:
        score_grid(critic, tuning, robot, place, candidates, fields, scores)
    elif critic.kind == ROTATE_TO_GOAL:
        score_rotation(tuning, memory, robot, goal, candidates, scores)
    elif critic.kind == OSCILLATION:
        score_oscillation(memory, candidates[0], scores)
    elif critic.kind == PREFER_FORWARD:
        score_forward(tuning.PreferForward, candidates[0], scores)
    else:
        for i in range(len(scores)):
            scores[i] = abs(candidates[0][i, 1])


@inlined
def score_obstacles(critic, tuning, robot, place, candidates, scores):
    """BaseObstacle: cost of the cell under the robot's centre."""
    costs, origin_x, origin_y, resolution = place
    _, twists, steps, headings, _, _, cos, sin, cells = candidates
    if not critic.sum_scores:
        last_obstacle_scores(cells[critic.row], costs, scores)
        return
    summed_obstacle_scores(
        robot, tuning.limits, tuning.sim_time, twists, steps, headings, cos, sin, costs, origin_x, origin_y, resolution,
        tuning.include_last_point, scores,
    )  # fmt: skip


@inlined
def score_footprints(critic, tuning, robot, place, corners, candidates, scores):
    """ObstacleFootprint: largest cost under the footprint's outline."""
    costs, origin_x, origin_y, resolution = place
    _, twists, steps, headings, ends, yaw, cos, sin, cells = candidates
    if not critic.sum_scores:
        last_footprint_scores(
            steps, headings, ends, yaw, cells[critic.row], costs, origin_x, origin_y, resolution, corners, scores
        )
        return
    summed_footprint_scores(
        robot, tuning.limits, tuning.sim_time, twists, steps, headings, yaw, cos, sin, costs, origin_x, origin_y,
        resolution, corners, tuning.include_last_point, scores,
    )  # fmt: skip


@inlined
def score_grid(critic, tuning, robot, place, candidates, fields, scores):
    """PathDist, GoalDist, PathAlign and GoalAlign: Manhattan distance in cells from a set of seed cells."""
    costs, origin_x, origin_y, resolution = place
    _, twists, steps, headings, _, _, cos, sin, cells = candidates
    distances, skipped, reached = fields
    if critic.needs_seed and not reached:
        scores[:] = ILLEGAL
    elif critic.aggregation == LAST:
        last_grid_scores(cells[critic.row], distances[critic.layer], skipped, scores)
    else:
        aggregated_grid_scores(
            robot, tuning.limits, tuning.sim_time, twists, steps, headings, cos, sin, critic.forward,
            distances[critic.layer], skipped, costs.shape, origin_x, origin_y, resolution,
            critic.aggregation, tuning.include_last_point, scores,
        )  # fmt: skip


@inlined
def score_rotation(tuning, memory, robot, goal, candidates, scores):
    """RotateToGoal, once near the goal: slow down, stop, then only turn to the goal's heading.

    With a ``lookahead_time`` Nav2 Humble reads past the end of its array of times; here it works as intended there.
    """
    velocities, _, steps, headings, _, yaw, _, _, _ = candidates
    if not memory.in_window:
        return
    own = tuning.RotateToGoal
    rotation_errors(steps, headings, yaw, tuning.sim_time, own.lookahead_time, goal[2], scores)
    for i in range(len(scores)):
        v = velocities[i, 0]
        if memory.rotating:
            scores[i] = ILLEGAL if v != 0.0 else scores[i]
        else:
            slowing = scores[i] + v * v * own.slowing_factor
            scores[i] = ILLEGAL if v * v >= robot[3] * robot[3] else slowing


@inlined
def score_oscillation(memory, velocities, scores):
    """Oscillation: after a change of sign only the new sign is legal until the robot has moved on."""
    for i in range(len(scores)):
        if velocities[i, 0] * memory.forward_only < 0.0 or velocities[i, 1] * memory.turn_only < 0.0:
            scores[i] = ILLEGAL


@inlined
def score_forward(own, velocities, scores):
    """PreferForward: a penalty on driving backwards, and on driving slowly without turning; otherwise on turning."""
    for i in range(len(scores)):
        v, turn = velocities[i, 0], abs(velocities[i, 1])
        slow = v < own.strafe_x and turn < own.strafe_theta
        scores[i] = own.penalty if v < 0.0 or slow else turn * own.theta_scale


@inlined
def follow_trend(sign, only, command):
    """Take a command on one axis.

    Returns:
        Sign of the last nonzero command, the only sign allowed since it flipped (0: both), and whether it just did.
    """
    now = (command > 0.0) - (command < 0.0)
    if now == 0:
        return sign, only, False
    flipped = now == -sign
    return now, now if flipped else only, flipped


@inlined
def debrief(own, memory, robot, now, v, w, wraps):
    """Let Oscillation take note of the command that the robot gets; ``now`` is in s, ``wraps`` is Lyrical's rule."""
    memory.forward_sign, memory.forward_only, flipped = follow_trend(memory.forward_sign, memory.forward_only, v)
    if own.x_only_threshold < 0.0 or abs(v) <= own.x_only_threshold:
        memory.turn_sign, memory.turn_only, turned = follow_trend(memory.turn_sign, memory.turn_only, w)
        flipped = flipped or turned
    if flipped:
        memory.flip_x, memory.flip_y, memory.flip_yaw, memory.flip_time = robot[0], robot[1], robot[2], now
    if (memory.forward_only != 0 or memory.turn_only != 0) and moved_on(own, memory, robot, now, wraps):
        memory.forward_sign = memory.forward_only = memory.turn_sign = memory.turn_only = 0


@inlined
def moved_on(own, memory, robot, now, wraps):
    """Whether distance, turn (wrapped in Lyrical only) or time since the flip lifts Oscillation's restrictions."""
    dx, dy, reach = robot[0] - memory.flip_x, robot[1] - memory.flip_y, own.oscillation_reset_dist
    if reach >= 0.0 and dx * dx + dy * dy > reach * reach:
        return True
    turned = normalize_angle(robot[2] - memory.flip_yaw) if wraps else robot[2] - memory.flip_yaw
    if own.oscillation_reset_angle >= 0.0 and abs(turned) > own.oscillation_reset_angle:
        return True
    return 0.0 <= own.oscillation_reset_time < now - memory.flip_time
