"""How robots move while they touch nothing: the midpoint step of a differential drive, and whether walls are near."""

from __future__ import annotations

import math

import numpy as np

from gym_mapbench.kernels.geometry import wrap_angle
from gym_mapbench.kernels.jit import kernel

BODY = np.dtype(
    [(name, np.float64) for name in ("x", "y", "yaw", "wheel_v", "wheel_w", "v", "w")] + [("touching", np.bool_)],
    align=True,
)
"""A robot: true pose (m, rad), speeds of its wheels and of its body (m/s, rad/s), and whether it touches a wall."""

DRIVE = np.dtype([(name, np.float64) for name in ("tick", "forward", "reverse", "turn", "dv", "dw", "radius")])
"""What it can do: length of a tick (s), top speeds, largest change of both speeds in a tick, radius around it (m)."""

GROUND = np.dtype(
    [(name, np.float64) for name in ("resolution", "origin_x", "origin_y")]
    + [(name, np.int64) for name in ("rows", "cols")]
)
"""Where a map lies: side of a cell, world position of its lower-left corner (m), rows and columns."""

MARGIN = 0.01
"""What counts as near, beyond radius and motion, m: far more than what Box2D's slop and float32 come to."""


@kernel
def drive_bodies(bodies, commands, waiting, ticks, drive, grounds, walls):
    """Drive all robots that wait and have no wall near; the others still wait afterwards.

    Args:
        bodies: ``(n,)`` BODY, in and out.
        commands: ``(n, 2)`` forward speed (m/s) and turn rate (rad/s).
        waiting: ``(n,)`` bool, in and out.
        ticks: Number of physics steps.
        drive: ``(1,)`` DRIVE.
        grounds: ``(n,)`` GROUND.
        walls: ``(n, cells)`` bool, each row the map in a frame of walls, flat.
    """
    for i in range(len(bodies)):
        if waiting[i]:
            v, w = commands[i, 0], commands[i, 1]
            waiting[i] = not drive_body(bodies, i, v, w, ticks, drive, grounds, walls[i])


@kernel
def drive_body(bodies, i, v, w, ticks, drive, grounds, walls):
    """Drive one robot if no wall is near; return whether it was driven. Arguments as for :func:`drive_bodies`."""
    body, can = bodies[i], drive[0]
    v, w = clip(v, -can.reverse, can.forward), clip(w, -can.turn, can.turn)
    travel = max(abs(v), abs(body.wheel_v)) * ticks * can.tick
    if body.touching or not is_clear(walls, grounds, i, body.x, body.y, can.radius + travel + MARGIN):
        return False
    for _ in range(ticks):
        body.wheel_v = approach(body.wheel_v, v, can.dv)
        body.wheel_w = approach(body.wheel_w, w, can.dw)
        vx, vy = midpoint_velocity(body.yaw, body.wheel_v, body.wheel_w, can.tick)
        body.x += vx * can.tick
        body.y += vy * can.tick
        body.yaw += body.wheel_w * can.tick
    body.yaw = wrap_angle(body.yaw)
    body.v, body.w = body.wheel_v, body.wheel_w
    return True


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
    """Whether all walls, the map's edge among them, are farther than ``reach`` (m) from a point on map ``i``."""
    ground = grounds[i]
    width = ground.cols + 2
    column, line = (x - ground.origin_x) / ground.resolution + 1.0, (y - ground.origin_y) / ground.resolution + 1.0
    reach /= ground.resolution
    for row in range(max(0, int(math.floor(line - reach))), min(ground.rows + 1, int(line + reach)) + 1):
        away = max(row - line, line - (row + 1), 0.0)
        half = math.sqrt(max(reach * reach - away * away, 0.0))
        first, last = max(0, int(math.floor(column - half))), min(width - 1, int(column + half))
        for cell in range(row * width + first, row * width + last + 1):
            if walls[cell]:
                return False
    return True
