"""How far a robot could drive along arcs before it touches something that its scanner sees."""

from __future__ import annotations

import math

from gym_mapbench.kernels.jit import kernel

STRAIGHT = 1e-6
"""Curvature below which an arc is a straight line, 1/m."""


@kernel
def free_arcs(scans, beams, x, y, seen, radius, curvatures, reach, free):
    """Write the length that a disc can drive along every arc until it touches a point of the scan.

    Args:
        scans: ``(worlds, n)`` ranges, m.
        beams: ``(n, 2)`` cosine and sine of every beam's angle in the robot's frame.
        x: Place of the scanner in the robot's frame, m.
        y: The same, m to the left.
        seen: Ranges from here on are no reading, m; neither is 0.
        radius: Of the disc, m.
        curvatures: ``(arcs,)`` of the arcs, 1/m; positive ones turn left when driven forwards.
        reach: Longest length, m.
        free: ``(worlds, 2, arcs)`` out, m: forwards and backwards; 0 where the disc covers a point already.
    """
    for world in range(len(scans)):
        free[world] = reach
        for i in range(len(beams)):
            distance = scans[world, i]
            if distance <= 0.0 or distance >= seen:
                continue
            along, aside = x + distance * beams[i, 0], y + distance * beams[i, 1]
            for k in range(len(curvatures)):
                free[world, 0, k] = min(free[world, 0, k], free_length(along, aside, radius, curvatures[k], reach))
                # Backwards is forwards in the mirror: the arc stays on the same side.
                free[world, 1, k] = min(free[world, 1, k], free_length(-along, aside, radius, curvatures[k], reach))


@kernel
def free_length(along, aside, radius, curvature, reach):
    """Length of an arc from the origin, along x at first, until a disc on it touches a point; ``reach`` if never.

    Args:
        along: x of the point, m.
        aside: y of the point, m.
        radius: Of the disc, m.
        curvature: Of the arc, 1/m.
        reach: Longest length, m.
    """
    if along * along + aside * aside <= radius * radius:
        return 0.0 if along > 0.0 else reach
    if abs(curvature) < STRAIGHT:
        if along <= 0.0 or abs(aside) >= radius:
            return reach
        return min(reach, along - math.sqrt(radius * radius - aside * aside))
    turning = 1.0 / abs(curvature)
    side = aside if curvature > 0.0 else -aside
    from_centre = math.hypot(along, side - turning)
    if abs(from_centre - turning) >= radius or from_centre == 0.0:
        return reach
    bearing = math.atan2(along, turning - side) % (2.0 * math.pi)
    share = (turning * turning + from_centre * from_centre - radius * radius) / (2.0 * turning * from_centre)
    angle = bearing - math.acos(min(1.0, max(-1.0, share)))
    return min(reach, turning * (angle if angle >= 0.0 else angle + 2.0 * math.pi))
