"""People as ``<actor>`` of Gazebo: the trajectory of one round of a walk, in a loop.

Source: SDFormat's specification of ``actor``. A lidar that renders its scan sees an actor, as gz-sim's does; one that
measures collision shapes does not, as Gazebo Classic's. Nothing collides with an actor.

gz-sim reads the times of waypoints in whole milliseconds and leads a Catmull-Rom spline through the waypoints, whatever
their times are. Such a spline is a walk at a constant speed only where neighbours are equally far apart.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gym_mapbench.errors import ConfigError
from gym_mapbench.world.bodies import Body
from gym_mapbench.world.clearance import check_clearance
from gym_mapbench.world.pedestrians import HARMONICS, Scripted, Wander
from gym_mapbench.world.robot import RobotSpec
from gym_mapbench.world.scenario import Scenario

TURN = 0.01
"""Time that an actor takes to turn at a corner, s."""
SPACING = 0.1
"""Longest way between two waypoints, m; the spline then leaves the walk by less than a third of it."""
PER_HARMONIC = 16
"""Fewest waypoints for each wave of a wander's fastest sine term."""
ROUNDS = (Scripted, Wander)
"""Motions that repeat; people of ``social_force`` have no round, and may see the robot."""
STAND = 1.0
"""Time of a round of an actor that stands, s."""


class Waypoint(NamedTuple):
    """A pose of an actor: seconds since the start of the simulation; x, y (m) and yaw (rad)."""

    time: float
    x: float
    y: float
    yaw: float


class Actor(NamedTuple):
    """A walking person.

    Args:
        name: Name in the world.
        waypoints: One round, which begins and ends at the same place.
    """

    name: str
    waypoints: tuple[Waypoint, ...]


def actors_of(scenario: Scenario) -> tuple[Actor, ...]:
    """Return the people of a scenario, whose motions are among :data:`ROUNDS`."""
    return tuple(map(Actor, names_of_actors(scenario), map(round_of, scenario.bodies)))


def names_of_actors(scenario: Scenario) -> tuple[str, ...]:
    """Return the names of the people of a scenario, which its own model cannot have."""
    return tuple(f"person_{number}" for number in range(len(scenario.bodies)))


def check_actors(scenarios: Iterable[Scenario], robot: RobotSpec) -> None:
    """Refuse scenarios with bodies that cannot be actors, or with which no run of the robot begins here.

    Raises:
        ConfigError: If a body moves in another way than :data:`ROUNDS`, walks through walls, or leaves the robot no
            room at start or goal.
    """
    for scenario in (one for one in scenarios if one.bodies):
        for number, body in enumerate(scenario.bodies):
            if not isinstance(body.motion.motion, ROUNDS):
                raise ConfigError(
                    f"Gazebo: {scenario.name!r}: body {number}: expected the motion 'scripted' or 'wander', whose walk "
                    f"repeats, got {body.motion.name!r}"
                )
        try:
            check_clearance(scenario, robot)
        except ConfigError as error:
            raise ConfigError(f"Gazebo: {scenario.name!r}: {error}") from None


def round_of(body: Body) -> tuple[Waypoint, ...]:
    """Return one round of a walk from its place at time 0, in whole milliseconds.

    Each corner has a waypoint before and one after it; a corner at the end of the round has the waypoint before it and
    the end itself. A walk whose round is shorter than a turn stands.
    """
    walk = body.motion.motion
    assert isinstance(walk, ROUNDS)
    if walk.period < TURN:
        times, poses = np.array([0.0, STAND]), walk.at(np.zeros(2))
    else:
        times = np.unique(np.round(_even_times(walk) if isinstance(walk, Wander) else _times_of(walk), 3))
        poses = walk.at(times)
    poses[-1, :2] = poses[0, :2]
    return tuple(Waypoint(*values) for values in np.column_stack([times, poses]).tolist())


def _even_times(walk: Wander) -> NDArray[np.float64]:
    """Return times that are evenly spread over a round, s: a spline follows a smooth curve with its speed."""
    legs = max(PER_HARMONIC * HARMONICS, math.ceil(walk.longest_way / SPACING))
    return np.linspace(0.0, walk.period, legs + 1)


def _times_of(walk: Scripted) -> NDArray[np.float64]:
    """Return the times of the waypoints of a round, s: around the corners, and evenly spread between them."""
    corners = walk.corner_times
    within = corners[(corners > TURN) & (corners < walk.period - TURN)]
    ends = [0.0, *(within - TURN / 2), *(within + TURN / 2), walk.period - TURN / 2, walk.period]
    legs = [
        np.linspace(begin, end, math.ceil((end - begin) * walk.speed / SPACING), endpoint=False)
        for begin, end in pairwise(sorted(ends))
    ]
    return np.array([*np.concatenate(legs), walk.period])
