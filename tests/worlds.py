"""Small worlds for tests."""

from __future__ import annotations

import math

from gym_mapbench.world.bodies import Body, Disc
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.motions import MotionSpec
from gym_mapbench.world.scenario import Pose, Scenario

ROOM = ("#" * 30, *["#" + "." * 28 + "#"] * 28, "#" * 30)
"""An empty room of 3 m x 3 m at 0.1 m a cell."""
ROOM_START = (0.8, 0.8, 0.0)
ROOM_GOAL = (2.2, 2.2, math.pi / 2)
ROOM_OPTIONS = {"maps": ROOM, "resolution": 0.1, "start": ROOM_START, "goal": ROOM_GOAL}


def line(start, end, speed, radius=0.2):
    """A disc that moves to and fro on a line."""
    options = {"start": list(start), "end": list(end), "speed": speed}
    return Body(shape=Disc(radius=radius), motion=MotionSpec(name="line", options=options))


def among(*bodies, start=ROOM_START, goal=ROOM_GOAL, rows=ROOM):
    """The room with moving bodies in it."""
    return Scenario(GridMap.from_rows(rows, 0.1), Pose(*start), Pose(*goal), "room", bodies)


def social(*waypoints, speed=0.6, radius=0.2, **options):
    """A person who walks by social forces."""
    options |= {"waypoints": [list(one) for one in waypoints], "speed": speed}
    return Body(shape=Disc(radius=radius), motion=MotionSpec(name="social_force", options=options))
