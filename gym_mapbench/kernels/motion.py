"""Motion of robots that touch nothing: the midpoint step of a differential drive, and whether walls are near."""

from __future__ import annotations

import math

import numpy as np

from gym_mapbench.kernels.geometry import wrap_angle
from gym_mapbench.kernels.jit import kernel

ROBOT = np.dtype(
    [(name, np.float64) for name in ("x", "y", "yaw", "wheel_v", "wheel_w", "v", "w", "target_v", "target_w")]
    + [("held", np.bool_)],
    align=True,
)
"""A robot: true pose (m, rad), speeds of its wheels and of its body (m/s, rad/s), speeds that its wheels approach
(m/s, rad/s), and whether Box2D has walls at hand for it, touched or not."""

BOX = np.dtype([(name, np.float32) for name in ("left", "bottom", "right", "top", "from_x", "from_y", "to_x", "to_y")])
"""The box that Box2D keeps around a disc, and the motion for which it was last made while Box2D rested, 0 if it was not
(Box2D's units)."""

DRIVE = np.dtype(
    [(name, np.float64) for name in ("tick", "forward", "reverse", "turn", "dv", "dw", "radius")]
    + [("substeps", np.int64), ("late", np.bool_)],
    align=True,
)
"""Limits of a robot: length of a tick (s), top speeds, largest change of both speeds in a substep, its radius (m),
substeps of a tick, and whether a command takes effect one substep after it arrives."""

GROUND = np.dtype(
    [(name, np.float64) for name in ("resolution", "origin_x", "origin_y")]
    + [(name, np.int64) for name in ("rows", "cols")]
)
"""Where a map lies: side of a cell, world position of its lower-left corner (m), rows and columns."""

SCALE = 40.0
"""Lengths inside Box2D are metres times this."""

MAX_TICK_TRAVEL = 0.05
"""Longest distance that anything moves in one tick, m: Box2D moves no body by more than 2 of its units at once."""

ZERO, SLACK, AHEAD = np.float32(0.0), np.float32(0.1), np.float32(2.0)
"""How much larger than the disc Box2D makes its box: by so much on all sides, and by so many steps ahead."""

MARGIN = 0.01
"""Distance that counts as near, beyond radius and motion, m: more than three times the slack and float32's rounding."""


@kernel
def drive_robots(robots, boxes, commands, waiting, ticks, drive, grounds, walls):
    """Drive all robots that wait and have no wall near; the others still wait afterwards.

    Args:
        robots: ``(n,)`` ROBOT, in and out.
        boxes: ``(n,)`` BOX, in and out.
        commands: ``(n, 2)`` forward speed (m/s) and turn rate (rad/s).
        waiting: ``(n,)`` bool, in and out.
        ticks: Number of physics steps.
        drive: ``(1,)`` DRIVE.
        grounds: ``(n,)`` GROUND.
        walls: ``(n, cells)`` bool, each row the map in a frame of walls, flat.
    """
    for i in range(len(robots)):
        if waiting[i]:
            v, w = commands[i, 0], commands[i, 1]
            waiting[i] = not drive_robot(robots, boxes, i, v, w, ticks, drive, grounds, walls[i])


@kernel
def drive_robot(robots, boxes, i, v, w, ticks, drive, grounds, walls):
    """Drive one robot if no wall is near; return whether it was driven. Arguments as for :func:`drive_robots`."""
    robot, box, can = robots[i], boxes[i], drive[0]
    v, w = clip(v, -can.reverse, can.forward), clip(w, -can.turn, can.turn)
    travel = max(abs(v), abs(robot.wheel_v)) * ticks * can.tick
    if robot.held or not is_clear(walls, grounds, i, robot.x, robot.y, reach_of_box(can, travel)):
        return False
    x, y = place_in_box2d(robot, grounds[i])
    keep_box(box, x, y, x, y, can.radius)
    for number in range(ticks):
        vx, vy, turn = tick_velocity(robot, robot.yaw, v, w, can, number == 0)
        robot.x += vx * can.tick
        robot.y += vy * can.tick
        robot.yaw += turn * can.tick
        to_x, to_y = x + step_in_box2d(vx, can.tick), y + step_in_box2d(vy, can.tick)
        keep_box(box, x, y, to_x, to_y, can.radius)
        x, y = to_x, to_y
    robot.yaw = wrap_angle(robot.yaw)
    robot.v, robot.w = robot.wheel_v, robot.wheel_w
    return True


@kernel
def plan_ticks(robots, yaw, v, w, first, drive, rows):
    """Write what the robot does in the ticks of a control step from a tick on, if nothing stops it.

    Args:
        robots: ``(1,)`` ROBOT; the speeds of its wheels change, its pose does not.
        yaw: Heading at the beginning of that tick, rad.
        v: Commanded forward speed, m/s.
        w: Commanded turn rate, rad/s.
        first: Number of that tick in the control step; the rows before it are known.
        drive: ``(1,)`` DRIVE.
        rows: ``(ticks, 5)`` mean velocity of each tick (m/s, m/s, rad/s), and speeds of the wheels after it (m/s,
            rad/s); in and out.
    """
    robot, can = robots[0], drive[0]
    v, w = clip(v, -can.reverse, can.forward), clip(w, -can.turn, can.turn)
    if first > 0:
        robot.wheel_v, robot.wheel_w = rows[first - 1, 3], rows[first - 1, 4]
    for number in range(first, len(rows)):
        vx, vy, turn = tick_velocity(robot, yaw, v, w, can, number == 0)
        yaw += turn * can.tick
        rows[number, 0], rows[number, 1], rows[number, 2] = vx, vy, turn
        rows[number, 3], rows[number, 4] = robot.wheel_v, robot.wheel_w


@kernel
def tick_velocity(robot, yaw, v, w, can, arrives):
    """Let the wheels approach a command for one tick; return the mean velocity of the tick (m/s, m/s, rad/s).

    Args:
        robot: ROBOT; the speeds of its wheels change, its pose does not.
        yaw: Heading at the beginning of the tick, rad.
        v: Commanded forward speed within the limits, m/s.
        w: Commanded turn rate within the limits, rad/s.
        can: DRIVE.
        arrives: Whether the command arrives at the beginning of this tick.
    """
    sum_x, sum_y, sum_w, substep = 0.0, 0.0, 0.0, can.tick / can.substeps
    for number in range(can.substeps):
        if number > 0 or not (arrives and can.late):
            robot.target_v, robot.target_w = v, w
        robot.wheel_v = approach(robot.wheel_v, robot.target_v, can.dv)
        robot.wheel_w = approach(robot.wheel_w, robot.target_w, can.dw)
        vx, vy = midpoint_velocity(yaw + sum_w * substep, robot.wheel_v, robot.wheel_w, substep)
        sum_x += vx
        sum_y += vy
        sum_w += robot.wheel_w
    return sum_x / can.substeps, sum_y / can.substeps, sum_w / can.substeps


@kernel
def reach_of_box(can, travel):
    """How far from the robot Box2D's box can extend along an axis while it travels ``travel`` m."""
    return can.radius + travel + (AHEAD + 1.0) * max(can.forward, can.reverse) * can.tick + MARGIN


@kernel
def place_in_box2d(robot, ground):
    """Where Box2D sets the robot at the beginning of a control step, in its units."""
    return np.float32((robot.x - ground.origin_x) * SCALE), np.float32((robot.y - ground.origin_y) * SCALE)


@kernel
def step_in_box2d(speed, tick):
    """How far Box2D moves the robot along an axis in a tick, in its units."""
    return np.float32(tick) * np.float32(speed * SCALE)


@kernel
def keep_box(box, x, y, to_x, to_y, radius):
    """Make a new box, as Box2D does, where the disc leaves it on its way between two points (Box2D's units).

    Source: Box2D 2.3, ``b2DynamicTree::MoveProxy``. Box2D knows the walls that meet this box in the order in which it
    met them, and that is the order in which it solves several contacts: so the box is kept even where Box2D rests.
    """
    radius = np.float32(radius * SCALE)
    left, right, bottom, top = (
        min(x, to_x) - radius,
        max(x, to_x) + radius,
        min(y, to_y) - radius,
        max(y, to_y) + radius,
    )
    if box.left <= left and box.bottom <= bottom and right <= box.right and top <= box.top:
        return
    ahead_x, ahead_y = AHEAD * (to_x - x), AHEAD * (to_y - y)
    box.left, box.right = left - SLACK + min(ahead_x, ZERO), right + SLACK + max(ahead_x, ZERO)
    box.bottom, box.top = bottom - SLACK + min(ahead_y, ZERO), top + SLACK + max(ahead_y, ZERO)
    box.from_x, box.from_y, box.to_x, box.to_y = x, y, to_x, to_y


@kernel
def clip(value, low, high):
    """Limit a number to a range."""
    return min(max(value, low), high)


@kernel
def approach(speed, target, change):
    """Move a speed towards its target by at most ``change``."""
    error = target - speed
    return speed + (change if error > change else -change if error < -change else error)


@kernel
def midpoint_velocity(yaw, v, w, tick):
    """Velocity along x and y of a robot that drives for one tick along its heading in the middle of it."""
    heading = yaw + w * tick / 2
    return v * math.cos(heading), v * math.sin(heading)


@kernel
def is_clear(walls, grounds, i, x, y, reach):
    """Whether no wall, the map's edge among them, meets the square of half side ``reach`` (m) around a point."""
    ground = grounds[i]
    width = ground.cols + 2
    column, line = (x - ground.origin_x) / ground.resolution + 1.0, (y - ground.origin_y) / ground.resolution + 1.0
    reach /= ground.resolution
    first, last = max(0, int(math.floor(column - reach))), min(width - 1, int(column + reach))
    for row in range(max(0, int(math.floor(line - reach))), min(ground.rows + 1, int(line + reach)) + 1):
        for cell in range(row * width + first, row * width + last + 1):
            if walls[cell]:
                return False
    return True
