"""The social force model as its papers write it, for one person, in complex numbers."""

from __future__ import annotations

import cmath
import math


def desired(velocity, to_goal, speed):
    """Force towards the goal: the desired velocity is taken up in half a second."""
    wanted = speed * to_goal / abs(to_goal) if abs(to_goal) > 0.2 else 0.0
    return (wanted - velocity) / 0.5


def social(to_other, velocity, other_velocity):
    """Force of another person: one part slows down, one turns aside."""
    interaction = 2.0 * (velocity - other_velocity) + to_other / abs(to_other)
    direction, reach = interaction / abs(interaction), 0.35 * abs(interaction)
    angle = cmath.phase(direction / (to_other / abs(to_other)))
    slows = math.exp(-abs(to_other) / reach - (3 * reach * angle) ** 2)
    turns = math.exp(-abs(to_other) / reach - (2 * reach * angle) ** 2) * (math.copysign(1, angle) if angle else 0)
    return 5.1 * direction * complex(-slows, turns)


def obstacle(place, radius, points):
    """Force of the points of walls, each with its weight."""
    total = 0j
    for x, y, weight in points:
        away = place - complex(x, y)
        if 0 < abs(away) < 3.0 + 2 * radius:
            total += 10.0 * weight * away / abs(away) * math.exp(-(abs(away) - radius) / 0.2)
    return total


def step(people, points, robot=None):
    """Move people on by 0.05 s; dicts of place, velocity, speed, radius, goals, goal, sees_robot."""
    forces = [_force(person, people, points, robot) for person in people]
    for person, force in zip(people, forces, strict=True):
        velocity = person["velocity"] + 0.05 * force
        person["velocity"] = velocity * min(1.0, person["speed"] / abs(velocity))
        person["place"] += 0.05 * person["velocity"]
        if abs(person["goals"][person["goal"]] - person["place"]) < 0.5:
            person["goal"] = (person["goal"] + 1) % len(person["goals"])


def _force(me, people, points, robot):
    total = desired(me["velocity"], me["goals"][me["goal"]] - me["place"], me["speed"])
    total += obstacle(me["place"], me["radius"], points)
    for other in people:
        if other is not me and (me["sees_robot"] or not other["sees_robot"]):
            total += social(other["place"] - me["place"], me["velocity"], other["velocity"])
    if me["sees_robot"] and robot is not None:
        total += social(robot[0] - me["place"], me["velocity"], robot[1])
    return total
