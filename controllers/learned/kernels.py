"""How far a robot could drive along arcs before it touches something that its scanner sees."""

from __future__ import annotations

import math

from gym_mapbench.kernels.jit import kernel

FULL_TURN = 2.0 * math.pi
STRAIGHT = 1e-6
"""Curvature below which an arc is a straight line, 1/m."""


@kernel
def free_arcs(scans, beams, x, y, seen, radii, curvatures, reach, free):
    """Write the length that discs can drive along every arc until they touch a point of the scan.

    Args:
        scans: ``(worlds, n)`` ranges, m.
        beams: ``(n, 2)`` cosine and sine of every beam's angle in the robot's frame.
        x: Place of the scanner in the robot's frame, m.
        y: The same, m to the left.
        seen: Ranges from here on are no reading, m; neither is 0.
        radii: ``(discs,)`` m.
        curvatures: ``(arcs,)`` of the arcs, 1/m; positive ones turn left when driven forwards.
        reach: Longest length, m.
        free: ``(worlds, discs, 2, arcs)`` out, m: forwards and backwards.
    """
    for world in range(len(scans)):
        free[world] = reach
        for i in range(len(beams)):
            distance = scans[world, i]
            if 0.0 < distance < seen:
                along, aside = x + distance * beams[i, 0], y + distance * beams[i, 1]
                block_arcs(along, aside, radii, curvatures, free[world])


@kernel
def block_arcs(along, aside, radii, curvatures, free):
    """Shorten the arcs on which discs meet a point.

    Args:
        along: x of the point, m.
        aside: y of the point, m.
        radii: ``(discs,)`` m.
        curvatures: ``(arcs,)`` 1/m.
        free: ``(discs, 2, arcs)`` free lengths forwards and backwards, m, in and out.
    """
    straight = math.sqrt(along * along + aside * aside)
    for disc in range(len(radii)):
        if straight <= radii[disc]:
            free[disc, 0 if along > 0.0 else 1] = 0.0  # covered: only the way out of it is free
    for k in range(len(curvatures)):
        if abs(curvatures[k]) < STRAIGHT:
            block_line(along, aside, straight, radii, free, k)
        else:
            block_arc(along, aside, straight, radii, curvatures[k], free, k)


@kernel
def block_line(along, aside, straight, radii, free, k):
    """Shorten the way straight ahead, arc ``k``, and straight back."""
    way = 0 if along > 0.0 else 1
    for disc in range(len(radii)):
        radius = radii[disc]
        if abs(aside) < radius < straight:
            free[disc, way, k] = min(free[disc, way, k], abs(along) - math.sqrt(radius * radius - aside * aside))


@kernel
def block_arc(along, aside, straight, radii, curvature, free, k):
    """Shorten arc ``k``, forwards and backwards."""
    turning = 1.0 / abs(curvature)
    inwards = aside if curvature > 0.0 else -aside
    away = math.sqrt(along * along + (turning - inwards) * (turning - inwards))  # from the arc's centre
    bearing = -1.0
    for disc in range(len(radii)):
        radius = radii[disc]
        least = straight - radius  # no arc is shorter than the straight way
        if abs(away - turning) >= radius or away <= radius - turning or least <= 0.0:
            continue
        if least >= free[disc, 0, k] and least >= free[disc, 1, k]:
            continue
        if bearing < 0.0:
            bearing = math.atan2(along, turning - inwards)
            bearing += FULL_TURN if bearing < 0.0 else 0.0
        share = (turning * turning + away * away - radius * radius) / (2.0 * turning * away)
        early = math.acos(max(-1.0, min(1.0, share)))
        # Backwards is forwards in the mirror: the centre stays on the same side.
        free[disc, 0, k] = min(free[disc, 0, k], turning * (bearing - early))
        free[disc, 1, k] = min(free[disc, 1, k], turning * (FULL_TURN - bearing - early))
