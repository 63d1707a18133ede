"""Poses seen from other frames."""

from __future__ import annotations

import math

import numpy as np

from gym_mapbench.kernels.geometry import wrap_angle
from gym_mapbench.kernels.jit import kernel

TWO_PI = 2.0 * math.pi


@kernel
def move_path(x, y, yaw, path):
    """Return ``path`` ``(n, 3)`` moved into the frame in which ``path``'s own frame has the pose ``x``, ``y``, ``yaw``.

    Headings are wrapped to (-pi, pi].
    """
    cos, sin = math.cos(yaw), math.sin(yaw)
    moved = np.empty((len(path), 3))
    for i in range(len(path)):
        moved[i, 0] = x + (cos * path[i, 0] - sin * path[i, 1])
        moved[i, 1] = y + (sin * path[i, 0] + cos * path[i, 1])
        turned = math.pi - (yaw + path[i, 2])
        # A remainder takes most of the time, and is only needed where there is more than one turn.
        moved[i, 2] = -((turned if 0.0 <= turned < TWO_PI else turned % TWO_PI) - math.pi)
    return moved


@kernel
def compose(frame_x, frame_y, frame_yaw, x, y, yaw):
    """Transform a pose from a frame into the one in which the frame itself is given; m, rad in (-pi, pi]."""
    cos, sin = math.cos(frame_yaw), math.sin(frame_yaw)
    return frame_x + (cos * x - sin * y), frame_y + (sin * x + cos * y), wrap_angle(frame_yaw + yaw)


@kernel
def relate(here_x, here_y, here_yaw, there_x, there_y, there_yaw):
    """Pose of one frame in another, from a pose that is known in both; the identity where both are equal."""
    turn = wrap_angle(there_yaw - here_yaw)
    cos, sin = math.cos(turn), math.sin(turn)
    return there_x - (cos * here_x - sin * here_y), there_y - (sin * here_x + cos * here_y), turn


@kernel
def count_motion(before, now, counted, distance, turn, veer):
    """Where wheels that count wrongly believe the robot is, after it has moved between two true poses.

    Args:
        before: True pose at the last count, m and rad.
        now: True pose.
        counted: Where they believed the robot was.
        distance: Relative error of the distance.
        turn: Relative error of the turn.
        veer: Turn counted for each metre straight on, rad/m.
    """
    cos, sin = math.cos(before[2]), math.sin(before[2])
    back_x, back_y = -(cos * before[0] + sin * before[1]), sin * before[0] - cos * before[1]
    ahead, aside, turned = compose(back_x, back_y, wrap_angle(-before[2]), now[0], now[1], now[2])
    turned = turned * (1 + turn) + ahead * veer
    return compose(counted[0], counted[1], counted[2], ahead * (1 + distance), aside * (1 + distance), turned)


@kernel
def in_robot_frame(goal_x, goal_y, goal_yaw, x, y, yaw):
    """Return x, y (m) and yaw (rad) of a goal, seen from a pose."""
    dx, dy = goal_x - x, goal_y - y
    cos, sin = math.cos(yaw), math.sin(yaw)
    return cos * dx + sin * dy, cos * dy - sin * dx, wrap_angle(goal_yaw - yaw)
