"""Bodies, which are discs, as the robot meets them: which are near, and what the scanner sees of them.

``poses`` is ``(n, 3)`` x, y (m), yaw (rad) of every body, ``radii`` is ``(n,)`` m. Where many worlds lie side by side,
a row with radius 0 is no body.
"""

from __future__ import annotations

import math

import numpy as np

from gym_mapbench.kernels.frames import compose
from gym_mapbench.kernels.jit import kernel
from gym_mapbench.kernels.motion import MARGIN, clip, drive_robot
from gym_mapbench.kernels.raycast import cast_rays


@kernel
def move_bodies(clocks, running, ticks, period, firsts, counts, tables, poses):
    """Let time pass in the worlds that are running, and write where their bodies are then.

    Args:
        clocks: ``(worlds,)`` ticks since the start, in and out.
        running: ``(worlds,)`` bool.
        ticks: Number of physics steps.
        period: Ticks per control step.
        firsts: ``(worlds,)`` control step with which a table begins.
        counts: ``(worlds,)`` number of control steps in a table; 0 in a world without bodies.
        tables: ``(worlds, steps, n, 3)`` where the bodies are at control steps; in between, they move evenly.
        poses: ``(worlds, n, 3)`` bodies, out.

    Returns:
        The numbers of the worlds whose tables end, or begin later because a reset failed; their poses were not written.
    """
    ends = np.zeros(len(clocks), np.bool_)
    for i in range(len(clocks)):
        if running[i] and counts[i] > 0:
            clocks[i] += ticks
            row, share = clocks[i] // period - firsts[i], clocks[i] % period / period
            ends[i] = row < 0 or row + 1 >= counts[i]
            if not ends[i]:
                for k in range(poses.shape[1]):
                    place_between(tables[i, row, k], tables[i, row + 1, k], share, poses[i, k])
    return np.flatnonzero(ends)


@kernel
def place_between(before, after, share, pose):
    """Write the pose of a body a share of the way from one pose ``(3,)`` to the next; it turns at the next one."""
    for axis in range(2):
        pose[axis] = before[axis]
        if share > 0.0:
            pose[axis] += share * (after[axis] - before[axis])
    pose[2] = before[2]


@kernel
def farthest_step(table):
    """Return the square of the longest step in a table ``(steps, n, 3)``, m², and the number of the body."""
    farthest, number = 0.0, 0
    for k in range(table.shape[1]):
        for row in range(1, len(table)):
            dx, dy = table[row, k, 0] - table[row - 1, k, 0], table[row, k, 1] - table[row - 1, k, 1]
            if dx * dx + dy * dy > farthest:
                farthest, number = dx * dx + dy * dy, k
    return farthest, number


@kernel
def is_near_body(robots, i, v, poses, radii, pace, drive, ticks):
    """Return whether a robot that touches no body might touch one within some ticks.

    Args:
        robots: ``(worlds,)`` ROBOT.
        i: Number of the robot.
        v: Commanded forward speed, m/s.
        poses: Bodies.
        radii: Bodies.
        pace: Longest distance that a body moves in a tick, m.
        drive: ``(1,)`` DRIVE.
        ticks: Number of physics steps.
    """
    robot, can = robots[i], drive[0]
    speed = max(abs(clip(v, -can.reverse, can.forward)), abs(robot.wheel_v))
    reach = can.radius + MARGIN + ticks * (pace + speed * can.tick)
    met = False
    for k in range(len(radii)):
        met = met or meets(poses[k], radii[k], robot.x, robot.y, reach)
    return met


@kernel
def bodies_near(poses, radii, pace, x, y, drive, ticks):
    """Return the numbers of the bodies that a robot might meet within some ticks, pushed by another body as well.

    Args:
        poses: Bodies.
        radii: Bodies.
        pace: Longest distance that a body moves in a tick, m.
        x: Position of the robot, m.
        y: The same.
        drive: ``(1,)`` DRIVE of the robot.
        ticks: Number of physics steps.
    """
    near, reach = np.empty(len(radii), np.bool_), reach_of_robot(drive[0], pace, ticks)
    for k in range(len(radii)):
        near[k] = meets(poses[k], radii[k], x, y, reach)
    return np.flatnonzero(near)


@kernel
def drive_robots_among(robots, boxes, commands, waiting, ticks, drive, grounds, walls, poses, radii, paces):
    """Drive all robots that wait and have neither wall nor body near; the others still wait afterwards.

    Args:
        robots: ``(worlds,)`` ROBOT, in and out.
        boxes: ``(worlds,)`` BOX, in and out.
        commands: ``(worlds, 2)`` m/s, rad/s.
        waiting: ``(worlds,)`` bool, in and out.
        ticks: Number of physics steps.
        drive: ``(1,)`` DRIVE.
        grounds: ``(worlds,)`` GROUND.
        walls: ``(worlds, cells)`` bool, each row the map in a frame of walls, flat.
        poses: ``(worlds, n, 3)`` bodies.
        radii: ``(worlds, n)`` bodies.
        paces: ``(worlds,)`` longest distance that a body moves in a tick, m.
    """
    for i in range(len(robots)):
        if waiting[i]:
            v, w = commands[i, 0], commands[i, 1]
            waiting[i] = not drive_robot_among(
                robots, boxes, i, v, w, ticks, drive, grounds, walls[i], poses[i], radii[i], paces[i]
            )


@kernel
def drive_robot_among(robots, boxes, i, v, w, ticks, drive, grounds, walls, poses, radii, pace):
    """Drive one robot if neither wall nor body is near; return whether it was driven."""
    if is_near_body(robots, i, v, poses, radii, pace, drive, ticks):
        return False
    return drive_robot(robots, boxes, i, v, w, ticks, drive, grounds, walls)


@kernel
def meets(pose, radius, x, y, reach):
    """Return whether a body ``(3,)`` is within ``reach`` (m) of a point."""
    dx, dy = pose[0] - x, pose[1] - y
    return radius > 0.0 and is_near(dx, dy, reach + radius) and math.hypot(dx, dy) - radius <= reach


@kernel
def is_near(dx, dy, distance):
    """Return whether ``(dx, dy)`` may be as near as a distance >= 0, m: false only where it certainly is not.

    The margin covers all rounding, so the exact ``hypot``, which takes ten times as long, decides wherever it matters.
    """
    return dx * dx + dy * dy <= distance * distance * (1.0 + 1e-9)


@kernel
def reach_of_robot(can, pace, ticks):
    """How far from a robot's centre a body can be, at its nearest point, that meets the robot within some ticks.

    The body moves, and another body may push the robot as fast.
    """
    return can.radius + MARGIN + ticks * (2.0 * pace + max(can.forward, can.reverse) * can.tick)


@kernel
def scan_bodies(robots, seen, poses, radii, place, beams, range_max, ranges):
    """Shorten the ranges of many worlds where a body is nearer than the wall.

    Args:
        robots: ``(worlds,)`` ROBOT.
        seen: ``(worlds,)`` bool, which worlds to look at.
        poses: ``(worlds, n, 3)`` bodies.
        radii: ``(worlds, n)`` bodies.
        place: ``(3,)`` pose of the scanner on the robot, m, rad.
        beams: ``(beams, 2)`` cosine and sine of every beam's angle.
        range_max: Longest range, m.
        ranges: ``(worlds, beams)`` m, in and out.
    """
    centred = place[0] == 0.0 and place[1] == 0.0 and place[2] == 0.0
    for i in range(len(robots)):
        if seen[i]:
            x, y, yaw = robots[i].x, robots[i].y, robots[i].yaw
            if not centred:
                x, y, yaw = compose(x, y, yaw, place[0], place[1], place[2])
            see_bodies(poses[i], radii[i], x, y, yaw, beams, range_max, ranges[i])


@kernel
def cast_rays_among(walls, resolution, origin_x, origin_y, x, y, yaw, beams, range_max, ranges, poses, radii):
    """Write the distance to the first wall or body along every beam; arguments as for ``cast_rays``, and bodies."""
    cast_rays(walls, resolution, origin_x, origin_y, x, y, yaw, beams, range_max, ranges)
    see_bodies(poses, radii, x, y, yaw, beams, range_max, ranges)


@kernel
def see_bodies(poses, radii, x, y, yaw, beams, range_max, ranges):
    """Shorten ranges where a body is nearer than the wall.

    Args:
        poses: Bodies.
        radii: Bodies.
        x: Sensor, m.
        y: Sensor, m.
        yaw: Heading of the sensor, rad.
        beams: ``(beams, 2)`` cosine and sine of every beam's angle to the heading.
        range_max: Longest range, m.
        ranges: ``(beams,)`` m, in and out; 0 inside a body.
    """
    cos, sin = math.cos(yaw), math.sin(yaw)
    for k in range(len(radii)):
        dx, dy, radius = poses[k, 0] - x, poses[k, 1] - y, radii[k]
        if radius == 0.0 or not is_near(dx, dy, range_max + radius):
            continue
        outside = math.hypot(dx, dy) - radius
        if outside >= range_max:
            continue
        if outside <= 0.0:
            ranges[:] = 0.0
            return
        shorten(ranges, beams, dx * cos + dy * sin, dy * cos - dx * sin, radius)


@kernel
def shorten(ranges, beams, ahead, left, radius):
    """Shorten ranges ``(beams,)`` where rays from outside enter a disc around ``(ahead, left)``."""
    radius_squared = radius * radius
    for i in range(len(beams)):
        aside = left * beams[i, 0] - ahead * beams[i, 1]
        half_squared = radius_squared - aside * aside
        if half_squared >= 0.0:
            along = ahead * beams[i, 0] + left * beams[i, 1]
            if along > 0.0:
                ranges[i] = min(ranges[i], along - math.sqrt(half_squared))
