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
                for disc in range(len(radii)):
                    block_arcs(along, aside, radii[disc], curvatures, free[world, disc])


@kernel
def block_arcs(along, aside, radius, curvatures, free):
    """Shorten the arcs on which a disc meets a point.

    Args:
        along: x of the point, m.
        aside: y of the point, m.
        radius: Of the disc, m.
        curvatures: ``(arcs,)`` 1/m.
        free: ``(2, arcs)`` free lengths forwards and backwards, m, in and out.
    """
    square = along * along + aside * aside
    if square <= radius * radius:
        free[0 if along > 0.0 else 1] = 0.0  # covered: only the way out of it is free
        return
    least = math.sqrt(square) - radius  # no arc is shorter than the straight way
    for k in range(len(curvatures)):
        if least >= free[0, k] and least >= free[1, k]:
            continue
        if abs(curvatures[k]) < STRAIGHT:
            if abs(aside) < radius:
                way = 0 if along > 0.0 else 1
                free[way, k] = min(free[way, k], abs(along) - math.sqrt(radius * radius - aside * aside))
            continue
        turning = 1.0 / abs(curvatures[k])
        inwards = aside if curvatures[k] > 0.0 else -aside
        away = square - 2.0 * turning * inwards + turning * turning  # squared distance from the arc's centre
        outer = turning + radius
        if away >= outer * outer or (turning > radius and away <= (turning - radius) * (turning - radius)):
            continue
        bearing = math.atan2(along, turning - inwards) % FULL_TURN
        share = (turning * turning + away - radius * radius) / (2.0 * turning * math.sqrt(away))
        early = math.acos(max(-1.0, min(1.0, share)))
        # Backwards is forwards in the mirror: the centre stays on the same side.
        free[0, k] = min(free[0, k], turning * (bearing - early))
        free[1, k] = min(free[1, k], turning * (FULL_TURN - bearing - early))
