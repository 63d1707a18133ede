"""The robot's state as its wheels and its localisation estimate it, and errors with a time constant."""

from __future__ import annotations

import numpy as np

from gym_mapbench.kernels.frames import compose, count_motion, relate
from gym_mapbench.kernels.geometry import wrap_angle
from gym_mapbench.kernels.jit import kernel

POSES = "true", "odom", "shift", "corrected", "frame"
BELIEF = np.dtype(
    [(f"{pose}_{part}", np.float64) for pose in POSES for part in ("x", "y", "yaw")]
    + [(name, np.float64) for name in ("distance", "turn", "veer", "update_min_d", "update_min_a")]
    + [(name, np.bool_) for name in ("drifts", "is_shifted", "is_exact", "is_corrected", "jitters")],
    align=True,
)
"""What a robot believes about its state.

``true`` and ``odom`` are its poses at the last count of the wheels, on the map and in the odom frame, ``shift`` is the
true pose of the map in the odom frame, ``corrected`` the odom pose at the last correction of the localisation, and
``frame`` the pose of the odom frame on the map according to it. Then follow the errors of the wheels, the motion after
which the localisation corrects itself (m, rad), and whether the wheels drift, the odom frame is another than the map's,
the localisation is exact, it has corrected itself at all, and the measured velocity has errors."""


@kernel
def estimate_state(beliefs, robots, error_x, error_y, error_yaw, error_v, error_w, state):
    """Write the state of one moment, true and as it is estimated; call it once a control step.

    Args:
        beliefs: ``(1,)`` BELIEF, in and out.
        robots: ``(1,)`` ROBOT.
        error_x: Error that a correction of the localisation has now, m.
        error_y: The same.
        error_yaw: The same of the heading, rad.
        error_v: Error of the measured forward speed, m/s.
        error_w: Error of the measured turn rate, rad/s.
        state: ``(13,)`` out: true pose on the map (m, m, rad), true forward speed (m/s) and turn rate (rad/s), and the
            estimates: pose on the map, pose in the odom frame, forward speed and turn rate.
    """
    belief, robot = beliefs[0], robots[0]
    x, y, yaw, v, w = robot.x, robot.y, robot.yaw, robot.v, robot.w
    state[0], state[1], state[2], state[3], state[4] = x, y, yaw, v, w
    odom_x, odom_y, odom_yaw = count_wheels(belief, x, y, yaw)
    state[8], state[9], state[10] = odom_x, odom_y, odom_yaw
    if belief.is_exact:
        state[5], state[6], state[7] = x, y, yaw
    else:
        if not belief.is_corrected or has_moved(belief, odom_x, odom_y, odom_yaw):
            correct(belief, odom_x, odom_y, odom_yaw, x + error_x, y + error_y, wrap_angle(yaw + error_yaw))
        state[5], state[6], state[7] = compose(
            belief.frame_x, belief.frame_y, belief.frame_yaw, odom_x, odom_y, odom_yaw
        )
    state[11], state[12] = v, w
    if belief.drifts:
        state[11], state[12] = v * (1 + belief.distance), w * (1 + belief.turn) + v * belief.veer
    if belief.jitters:
        state[11] += error_v
        state[12] += error_w


@kernel
def count_wheels(belief, x, y, yaw):
    """Odom pose (m, m, rad), now that the robot is at a true pose on the map."""
    if belief.drifts:
        before = belief.true_x, belief.true_y, belief.true_yaw
        counted = belief.odom_x, belief.odom_y, belief.odom_yaw
        counted = count_motion(before, (x, y, yaw), counted, belief.distance, belief.turn, belief.veer)
        belief.true_x, belief.true_y, belief.true_yaw = x, y, yaw
        belief.odom_x, belief.odom_y, belief.odom_yaw = counted
        return counted
    if belief.is_shifted:
        return compose(belief.shift_x, belief.shift_y, belief.shift_yaw, x, y, yaw)
    return x, y, yaw


@kernel
def has_moved(belief, x, y, yaw):
    """Whether it is time for a correction at an odom pose; AMCL looks at x and y separately."""
    moved = max(abs(x - belief.corrected_x), abs(y - belief.corrected_y))
    return moved > belief.update_min_d or abs(wrap_angle(yaw - belief.corrected_yaw)) > belief.update_min_a


@kernel
def correct(belief, odom_x, odom_y, odom_yaw, x, y, yaw):
    """Correct the localisation at an odom pose: the robot is now believed at a pose on the map."""
    belief.is_corrected = True
    belief.corrected_x, belief.corrected_y, belief.corrected_yaw = odom_x, odom_y, odom_yaw
    belief.frame_x, belief.frame_y, belief.frame_yaw = relate(odom_x, odom_y, odom_yaw, x, y, yaw)


@kernel
def wander(values, normals, kept, fresh, deviations, errors):
    """Write the next errors of an Ornstein-Uhlenbeck process.

    Args:
        values: ``(n,)`` the process of this moment in standard deviations, in and out.
        normals: ``(moments, n)`` standard normal numbers.
        kept: Share of a value that is kept until the next moment.
        fresh: Share of a normal number that is added.
        deviations: ``(n,)`` stationary standard deviations.
        errors: ``(moments, n)`` out, from this moment on.
    """
    for row in range(len(normals)):
        for i in range(len(values)):
            errors[row, i] = deviations[i] * values[i]
            values[i] = kept * values[i] + fresh * normals[row, i]
