"""Metrics of social navigation: measures of one recorded run among moving bodies. Pure functions of an Episode.

The choice of metrics follows Francis et al., Principles and Guidelines for Evaluating Social Robot Navigation
Algorithms (ACM Transactions on Human-Robot Interaction 14(2), 2025); names in brackets are theirs. Their space
compliance is the share of a run beyond one distance from people. Here are times within two distances, those of Hall,
The Hidden Dimension (1966): intimate space up to 0.45 m, personal space up to 1.2 m. Distances are those between the
outlines of robot and body, so 0 is a contact. The time that people cost is a measure of two runs:
:func:`evolution.benchmark.time_lost`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gym_mapbench.metrics.episode import Episode
from gym_mapbench.world.crowd import Track, place_crowd
from gym_mapbench.world.proximity import Proximity
from gym_mapbench.world.world import stands_still

Floats = NDArray[np.float64]

INTIMATE_SPACE = 0.45
"""Size of a person's intimate space, m."""
PERSONAL_SPACE = 1.2
"""Size of a person's personal space, m."""
FAR_AWAY = 1e3
"""The distance to the nearest body where there is none, m; metrics must be finite."""


def min_distance_to_people(episode: Episode) -> float:
    """Smallest distance to a moving body, m (minimum distance to human), negative in a disc; 1000 m without bodies."""
    return float(min(_gaps(episode).min(), FAR_AWAY))


def intimate_space_time(episode: Episode) -> float:
    """Time within 0.45 m of a moving body, s (cf. space compliance)."""
    return _time(episode, _gaps(episode) < INTIMATE_SPACE)


def personal_space_time(episode: Episode) -> float:
    """Time within 1.2 m of a moving body, s (cf. space compliance); the intimate space is included."""
    return _time(episode, _gaps(episode) < PERSONAL_SPACE)


def freezing_time(episode: Episode) -> float:
    """Time for which the robot stands still within 1.2 m of a moving body, s (cf. stalled time).

    The freezing robot is a term of Trautman and Krause, Unfreezing the Robot (2010).
    """
    return _time(episode, _stands(episode) & (_gaps(episode) < PERSONAL_SPACE))


def n_collisions_with_people(episode: Episode) -> float:
    """Number of contacts with a moving body that began while the robot moved (human collisions)."""
    return float(sum(not rests for rests in _contacts(episode)))


def n_contacts_by_people(episode: Episode) -> float:
    """Number of contacts with a moving body that began while the robot stood still: the contact is the other's."""
    return float(sum(_contacts(episode)))


def n_collisions_with_walls(episode: Episode) -> float:
    """Number of contacts with a wall that began (wall collisions)."""
    return float(sum(event.kind == "contact" and event.detail != "body" for event in episode.events))


SOCIAL = (
    min_distance_to_people,
    intimate_space_time,
    personal_space_time,
    freezing_time,
    n_collisions_with_people,
    n_contacts_by_people,
    n_collisions_with_walls,
)
"""The metrics of social navigation, measured on every run among bodies."""


def _contacts(episode: Episode) -> list[bool]:
    """Return for every contact with a body whether the robot stood still at the end of the step before."""
    stands = _stands(episode)
    times = [one.time for one in episode.events if one.kind == "contact" and "body" in one.detail]
    steps = [round(time / episode.control_period) for time in times]
    return [bool(stands[max(0, min(step, len(stands)) - 1)]) for step in steps]


def _stands(episode: Episode) -> NDArray[np.bool_]:
    """Return for every recorded pose whether the robot stands still there, ``(n + 1,)``."""
    return stands_still(episode.trajectory[:, 3:5])


def _time(episode: Episode, holds: NDArray[np.bool_]) -> float:
    """Return the seconds of the control steps at whose end something holds."""
    return float(np.count_nonzero(holds[1:]) * episode.control_period)


def _gaps(episode: Episode) -> Floats:
    """Return the distance to the nearest body at every recorded pose, ``(n + 1,)`` m."""
    bodies = episode.scenario.bodies
    count = len(episode.trajectory)
    times = np.arange(count, dtype=np.float64) * episode.control_period
    track = Track(episode.control_period, episode.trajectory)
    places = place_crowd(episode.scenario.map, bodies, times, track)
    radii = np.tile(np.array([body.shape.radius for body in bodies]), (count, 1))
    states = np.ascontiguousarray(episode.trajectory[:, :3])
    return Proximity(episode.robot).gaps(states, np.ascontiguousarray(places), radii)
