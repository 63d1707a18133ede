"""The social force model: how people accelerate towards their goals, away from others and away from walls.

Formulas and parameters are those of PySocialForce 1.1: the desired force of Helbing and Molnar, Social force model for
pedestrian dynamics (1995), and the social force of Moussaid et al., Experimental study of the behavioural mechanisms
underlying self-organization in human crowds (2009). Angles are wrapped here, as the model has them; PySocialForce
leaves them unwrapped.
"""

from __future__ import annotations

import math

import numpy as np

from gym_mapbench.kernels.geometry import wrap_angle
from gym_mapbench.kernels.jit import kernel

PERSON = np.dtype(
    [(name, np.float64) for name in ("x", "y", "yaw", "vx", "vy", "speed", "radius", "wall_factor")]
    + [(name, np.int64) for name in ("first", "count", "goal")]
    + [(name, np.bool_) for name in ("walks", "sees_robot")],
    align=True,
)
"""A body of a crowd: pose (m, rad), velocity (m/s), its top speed (m/s), radius (m), its factor of the obstacle force,
where its goals begin among all goals, how many it has, which one it walks to, whether social forces move it, and
whether it sees the robot."""

STEP = 0.05
"""Time of a step, s."""
ARRIVAL = 0.5
"""Distance from its goal at which a person turns to the next one, m."""
DESIRE, RELAXATION_TIME, GOAL_THRESHOLD = 1.0, 0.5, 0.2
"""Desired force: factor; time (s) in which a person takes up its speed; distance (m) within which a person stops."""
SOCIABILITY, LAMBDA_IMPORTANCE, GAMMA, N, N_PRIME = 5.1, 2.0, 0.35, 2.0, 3.0
"""Social force: factor; weight of the relative velocity; range (m) per length of the interaction; and how fast the
force falls with the angle: its part that turns, and its part that slows down."""
WALLS, SIGMA, REACH = 10.0, 0.2, 3.0
"""Obstacle force: factor; distance (m) in which it falls to 1/e; and distance (m) up to which points of walls count."""
MOVES = 0.01
"""Smallest speed of a person that turns its heading, m/s."""


@kernel
def walk_people(people, goals, others, walls, robots, poses):
    """Move a crowd on, one step for every row of ``poses``.

    Args:
        people: ``(n,)`` PERSON, in and out.
        goals: ``(k, 2)`` the goals of all people, m.
        others: ``(steps + 1, n, 3)`` poses of the bodies that no social force moves, from now on.
        walls: ``(m, 3)`` x, y (m) of points on walls, and how many points of PySocialForce each stands for.
        robots: ``(steps, 5)`` x, y (m), yaw (rad), speed (m/s), turn rate (rad/s) of the robot; not finite where there
            is none.
        poses: ``(steps, n, 3)`` x, y (m), yaw (rad), out.
    """
    forces = np.empty((len(people), 2))
    for step in range(len(poses)):
        follow(people, others[step], others[step + 1])
        for i in range(len(people)):
            if people[i].walks:
                forces[i, 0], forces[i, 1] = force_on(people, i, goals, walls, robots[step])
        for i in range(len(people)):
            person = people[i]
            if person.walks:
                accelerate(person, forces[i, 0], forces[i, 1], goals)
                poses[step, i, 0], poses[step, i, 1], poses[step, i, 2] = person.x, person.y, person.yaw
            else:
                for axis in range(3):
                    poses[step, i, axis] = others[step + 1, i, axis]


@kernel
def follow(people, now, then):
    """Put the bodies that no social force moves where they are ``(n, 3)``, with the velocity of the coming step."""
    for i in range(len(people)):
        if not people[i].walks:
            people[i].x, people[i].y = now[i, 0], now[i, 1]
            people[i].vx, people[i].vy = (then[i, 0] - now[i, 0]) / STEP, (then[i, 1] - now[i, 1]) / STEP


@kernel
def accelerate(person, force_x, force_y, goals):
    """Move one person on by a step: first its velocity, at most its speed, then its position."""
    vx, vy = person.vx + STEP * force_x, person.vy + STEP * force_y
    speed = math.hypot(vx, vy)
    share = min(1.0, person.speed / speed) if speed > 0.0 else 0.0
    person.vx, person.vy = vx * share, vy * share
    person.x += STEP * person.vx
    person.y += STEP * person.vy
    if speed > MOVES:
        person.yaw = math.atan2(vy, vx)
    goal = person.first + person.goal
    if math.hypot(goals[goal, 0] - person.x, goals[goal, 1] - person.y) < ARRIVAL:
        person.goal = (person.goal + 1) % person.count


@kernel
def force_on(people, i, goals, walls, robot):
    """Return the sum of all forces on one person, m/s².

    Who does not see the robot does not react to people who do, either: the robot changes nothing for that person.
    """
    me = people[i]
    goal = me.first + me.goal
    x, y = desired_force(me, goals[goal, 0], goals[goal, 1])
    for j in range(len(people)):
        other = people[j]
        if j != i and (me.sees_robot or not other.sees_robot):
            force_x, force_y = social_force(other.x - me.x, other.y - me.y, me.vx - other.vx, me.vy - other.vy)
            x, y = x + force_x, y + force_y
    if me.sees_robot and math.isfinite(robot[0]):
        vx, vy = robot[3] * math.cos(robot[2]), robot[3] * math.sin(robot[2])
        force_x, force_y = social_force(robot[0] - me.x, robot[1] - me.y, me.vx - vx, me.vy - vy)
        x, y = x + force_x, y + force_y
    force_x, force_y = obstacle_force(me.x, me.y, me.radius, walls)
    return x + me.wall_factor * force_x, y + me.wall_factor * force_y


@kernel
def desired_force(me, goal_x, goal_y):
    """Return the force that lets a person take up its speed towards its goal, m/s²."""
    dx, dy = goal_x - me.x, goal_y - me.y
    distance = math.hypot(dx, dy)
    wanted = me.speed / distance if distance > GOAL_THRESHOLD else 0.0
    rate = DESIRE / RELAXATION_TIME
    return rate * (wanted * dx - me.vx), rate * (wanted * dy - me.vy)


@kernel
def social_force(dx, dy, approach_x, approach_y):
    """Return the force that somebody else exerts, m/s².

    Args:
        dx: Way to the other, m.
        dy: The same.
        approach_x: Own velocity less that of the other, m/s.
        approach_y: The same.
    """
    distance = math.hypot(dx, dy)
    if distance == 0.0:
        return 0.0, 0.0
    ux = LAMBDA_IMPORTANCE * approach_x + dx / distance
    uy = LAMBDA_IMPORTANCE * approach_y + dy / distance
    interaction = math.hypot(ux, uy)
    if interaction == 0.0:
        return 0.0, 0.0
    ux, uy = ux / interaction, uy / interaction
    angle = wrap_angle(math.atan2(uy, ux) - math.atan2(dy, dx))
    reach = GAMMA * interaction
    slows = SOCIABILITY * math.exp(-distance / reach - (N_PRIME * reach * angle) ** 2)
    turns = SOCIABILITY * math.exp(-distance / reach - (N * reach * angle) ** 2)
    if angle <= 0.0:
        turns = -turns if angle < 0.0 else 0.0
    return -slows * ux - turns * uy, -slows * uy + turns * ux


@kernel
def obstacle_force(x, y, radius, walls):
    """Return the force of walls, m/s²; arguments as for :func:`walk_people`, and the radius of the person, m."""
    force_x, force_y = 0.0, 0.0
    reach = REACH + 2.0 * radius
    for k in range(len(walls)):
        dx, dy = x - walls[k, 0], y - walls[k, 1]
        squared = dx * dx + dy * dy
        if 0.0 < squared < reach * reach:
            distance = math.sqrt(squared)
            force = WALLS * walls[k, 2] * math.exp(-(distance - radius) / SIGMA) / distance
            force_x, force_y = force_x + force * dx, force_y + force * dy
    return force_x, force_y
