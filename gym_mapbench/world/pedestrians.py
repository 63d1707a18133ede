"""Motions of people: a scripted walk between waypoints, a smooth random walk, and a walk by social forces.

The first two motions do not react to the robot, so every controller meets identical people. Both repeat, and so the
whole course of a body can be checked against the walls before a run. The third is computed by
:mod:`gym_mapbench.world.crowd`.
"""

from __future__ import annotations

import functools
import math
from typing import Annotated, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gym_mapbench.kernels.walks import walk_round
from gym_mapbench.quantities import Natural
from gym_mapbench.settings import Settings

Floats = NDArray[np.float64]
Phase = Annotated[float, Field(ge=0, lt=1)]
WalkingSpeed = Annotated[float, Field(gt=0, le=3)]
Coordinate = Annotated[float, Field(ge=-1e8, le=1e8)]
"""A coordinate in the frame of the map, m."""
Waypoints = Annotated[tuple[tuple[Coordinate, Coordinate], ...], Field(min_length=2, max_length=1000)]
"""Corners of a walk: x and y, m."""

HARMONICS = 3
"""Number of sine terms for each axis of a wander."""


@runtime_checkable
class Course(Protocol):
    """A motion that keeps to a closed course, which has to stay clear of walls."""

    def course(self, spacing: float) -> Floats:
        """Return points of the whole course, ``(n, 2)`` x, y (m), at most ``spacing`` (m) apart.

        An infinite ``spacing`` asks for the corners of the course alone.
        """
        ...


class Scripted(Settings):
    """A body walks along waypoints at a constant speed, turns round at the last one, walks back, and so on.

    Args:
        waypoints: Two or more points ``(x, y)``, m.
        speed: Speed, m/s; people walk at 0.3 to 1.3 m/s.
        phase: Share of the way there and back that lies behind the body at time 0.
        loop: Whether the body walks from the last waypoint straight to the first one, and does not turn round.
    """

    waypoints: Waypoints
    speed: WalkingSpeed
    phase: Phase = 0.0
    loop: bool = False

    def at(self, times: Floats) -> Floats:
        """As :meth:`~gym_mapbench.world.motions.Motion.at`."""
        corners, marks, headings = _round_of(self.waypoints, self.loop)
        poses = np.empty((len(times), 3))
        walk_round(corners, marks, headings, self.phase * marks[-1], self.speed, times, poses)
        return poses

    @property
    def period(self) -> float:
        """Time of one round, s."""
        return float(_round_of(self.waypoints, self.loop)[1][-1]) / self.speed

    @property
    def corner_times(self) -> Floats:
        """Times within the first round at which the body is at a corner, ascending, ``(n,)`` s."""
        _, marks, _ = _round_of(self.waypoints, self.loop)
        times: Floats = np.sort(np.mod(marks[:-1] - self.phase * marks[-1], marks[-1])) / self.speed
        return times

    def course(self, spacing: float) -> Floats:
        """As :meth:`Course.course`."""
        corners, marks, _ = _round_of(self.waypoints, self.loop)
        along = np.union1d(marks, np.linspace(0.0, marks[-1], math.ceil(marks[-1] / spacing) + 1))
        return np.stack([np.interp(along, marks, corners[:, axis]) for axis in (0, 1)], axis=1)


class Wander(Settings):
    """A body wanders smoothly around a point, on a random closed curve that a seed decides.

    The offset along each axis is a sum of three sines (a Fourier curve), as smooth random motion in DynaBARN (Nair et
    al., DynaBARN: Benchmarking Metric Ground Navigation in Dynamic Environments, 2022) is a polynomial.

    Args:
        centre: ``(x, y)`` around which the body wanders, m.
        reach: Farthest distance from the centre, m; at most 1 km.
        speed: Root mean square of the speed, m/s; the fastest moment is up to three times as fast.
        seed: Seed of the curve.
        phase: Share of the curve that lies behind the body at time 0.
    """

    centre: tuple[Coordinate, Coordinate]
    reach: Annotated[float, Field(ge=1e-6, le=1e3)]
    speed: WalkingSpeed
    seed: Annotated[Natural, Field(lt=2**63)] = 0
    phase: Phase = 0.0

    def at(self, times: Floats) -> Floats:
        """As :meth:`~gym_mapbench.world.motions.Motion.at`."""
        angles = np.fmod(self._rate * times + 2 * math.pi * self.phase, 2 * math.pi)
        places, slopes = self._curve(angles)
        return np.concatenate([places, np.arctan2(slopes[:, 1:], slopes[:, :1])], axis=1)

    def course(self, spacing: float) -> Floats:
        """As :meth:`Course.course`."""
        longest = 2 * math.pi * HARMONICS * self.reach * math.sqrt(2.0)
        return self._curve(np.linspace(0.0, 2 * math.pi, math.ceil(longest / spacing) + 1))[0]

    def _curve(self, angles: Floats) -> tuple[Floats, Floats]:
        """Return places ``(n, 2)`` (m) and their derivatives by the angle ``(n, 2)`` (m/rad)."""
        amplitudes, offsets = _terms_of(self.reach, self.seed)
        places = np.tile(np.array(self.centre), (len(angles), 1))
        slopes = np.zeros_like(places)
        for term in range(HARMONICS):
            turned = (term + 1) * angles[:, None] + offsets[term]
            places += amplitudes[term] * np.sin(turned)
            slopes += amplitudes[term] * (term + 1) * np.cos(turned)
        return places, slopes

    @property
    def period(self) -> float:
        """Time of one round, s."""
        return 2 * math.pi / self._rate

    @property
    def longest_way(self) -> float:
        """Upper bound of the curve's length, m: as if the body always moved at its fastest."""
        return 2 * math.pi * HARMONICS * self.reach

    @property
    def _rate(self) -> float:
        """Angle per second, rad/s: the mean square of the curve's slope makes it the speed that was asked for."""
        amplitudes, _ = _terms_of(self.reach, self.seed)
        orders = np.arange(1, HARMONICS + 1)[:, None]
        return self.speed / math.sqrt(float(((amplitudes * orders) ** 2).sum()) / 2)


class SocialForce(Settings):
    """A person walks from waypoint to waypoint by social forces: away from other bodies, from walls and from the robot.

    Nothing stops a person: forces alone keep it off walls. A person may leave the straight way between two waypoints.

    Args:
        waypoints: Two or more points ``(x, y)``, m: the start, and the goals in their order.
        speed: Desired speed, which is never exceeded, m/s.
        loop: Whether the person walks from the last waypoint straight to the first one, and does not turn round.
        sees_robot: Whether the robot counts as a person. If not, the positions are a function of time: the person
            does not react to people who see the robot, either.
        wall_factor: Factor of the force of walls. With 1 a person at 1 m/s stops before an opening of less than 1.6 m,
            with 0.1 before one of less than 0.7 m.
    """

    waypoints: Waypoints
    speed: WalkingSpeed
    loop: bool = False
    sees_robot: bool = True
    wall_factor: Annotated[float, Field(gt=0, le=10)] = 1.0

    @property
    def goals(self) -> tuple[tuple[float, float], ...]:
        """The goals of one round, in the order in which the person walks to them; the last one is the start."""
        back = self.waypoints[:1] if self.loop else self.waypoints[-2::-1]
        return (*self.waypoints[1:], *back)

    def course(self, spacing: float) -> Floats:
        """As :meth:`Course.course`: the straight ways between the waypoints."""
        return Scripted(waypoints=self.waypoints, speed=self.speed, loop=self.loop).course(spacing)


# Arrays are kept here and not on the motions, which are compared by value.
@functools.lru_cache(maxsize=256)
def _round_of(waypoints: tuple[tuple[float, float], ...], loop: bool) -> tuple[Floats, Floats, Floats]:
    """Return the round of a scripted walk.

    Returns:
        Corners ``(n, 2)`` m, the first one again at the end; the distance along the round at every corner, ``(n,)`` m;
        and the heading on every leg, ``(n - 1,)`` rad.
    """
    corners = np.array([*waypoints, *(waypoints[:1] if loop else waypoints[-2::-1])]) + 0.0  # -0.0 becomes 0.0
    corners = corners[np.concatenate([[True], np.hypot(*np.diff(corners, axis=0).T) > 0])]
    if len(corners) == 1:
        corners = np.array([corners[0], corners[0] + (1e-9, 0.0)])
    dx, dy = np.diff(corners, axis=0).T
    return corners, np.concatenate([[0.0], np.cumsum(np.hypot(dx, dy))]), np.arctan2(dy, dx)


@functools.lru_cache(maxsize=256)
def _terms_of(reach: float, seed: int) -> tuple[Floats, Floats]:
    """Return amplitudes (m) and offsets (rad) of the sines, ``(harmonics, 2)`` each; the curve stays within reach."""
    rng = np.random.default_rng(seed)
    shares = rng.uniform(0.2, 1.0, (HARMONICS, 2))
    amplitudes = reach / math.sqrt(2.0) * shares / shares.sum(axis=0)
    return amplitudes, rng.uniform(-math.pi, math.pi, (HARMONICS, 2))
